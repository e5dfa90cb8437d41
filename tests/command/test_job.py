# SPDX-License-Identifier: GPL-3.0-or-later
"""A job of the panel: requests as JSON in, images and JSON lines out."""

import json
import subprocess

import pytest

from nim_addon.base.processes import second_blender
from nim_addon.cycles.images import read_metadata
from nim_addon.renders.request import Request

TINY = {"size": (16, 12), "samples": 2, "backend": "nodes"}


class Nothing:
    """Stands for a request whose record has nothing in it."""

    def record(self):
        return {}


def text_of(requests, folder, joined="", compared=None):
    """The JSON that asks for requests by the names of their images."""
    records = {name: request.record() for name, request in requests.items()}
    job = {"requests": records, "folder": str(folder), "joined": joined, "compared": compared or {}, "captions": []}
    return json.dumps(job)


def run(text):
    """The exit code of a job, its lines read as JSON where they are, and the others."""
    process = second_blender("command.job", [text], binary="", stdout=subprocess.PIPE)
    lines = process.stdout.read().splitlines()
    code = process.wait(60)
    process.stdin.close()
    said = [json.loads(line) for line in lines if line.startswith("{")]
    return code, said, [line for line in lines if not line.startswith("{")]


def test_a_job_renders_its_requests_and_says_how_far_it_is(tmp_path):
    requests = {f"n {n}": Request.of("sphere", {"n": n}, **TINY) for n in (1.5, -1.5)}
    code, said, rest = run(text_of(requests, tmp_path, "both", {"compares": ["n=1.5", "n=-1.5"]}))
    assert (code, rest) == (0, [])
    assert said[0] == {"done": 0, "total": 4, "left": None} and said[-2]["done"] == 4
    names = ["n 1.5", "n -1.5", "both"]
    assert said[-1] == {"files": [str(tmp_path / f"{name}.{suffix}") for name in names for suffix in ("exr", "png")]}
    assert Request.again(tmp_path / "n -1.5.png")[0] == Request.of("sphere", {"n": -1.5}, **TINY, caustics="path")
    joint = read_metadata(tmp_path / "both.exr")
    assert (joint["compares"], joint["images"]) == (["n=1.5", "n=-1.5"], names[:2])
    assert "parameters" not in joint

    code, said, rest = run(text_of({"alone": requests["n 1.5"]}, tmp_path))
    assert (code, said[-1]["files"]) == (0, [str(tmp_path / "alone.exr"), str(tmp_path / "alone.png")])


@pytest.mark.parametrize(
    ("text", "says"),
    (
        ("{", "the job is not understood"),
        ("{}", "the job is not understood"),
        (text_of({"mine": Nothing()}, "new"), "mine does not record"),
    ),
)
def test_a_job_that_makes_no_sense_is_refused(text, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, said, rest = run(text)
    assert (code, said, len(rest)) == (2, [], 1)
    assert rest[0].startswith("nimray: ") and says in rest[0]
    assert not list(tmp_path.iterdir())
