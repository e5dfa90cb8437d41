# SPDX-License-Identifier: GPL-3.0-or-later
"""`nimray sweep`: what it plans, renders, says and refuses, as a person runs it; stopped and killed it goes on."""

import csv
import json
import os
import random
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from nim_addon import command
from nim_addon.command.sweep_board import Board
from nim_addon.sweeps.state import State

ROOT = Path(__file__).parents[2]
SMALL = ("--size", "24x18", "--samples", "4", "--caustics", "path")


def lines(folder):
    return [json.loads(line) for line in (folder / "plan.jsonl").read_text().splitlines()]


def left_over(folder):
    """What lies in a sweep's images that is neither a picture nor its table."""
    return [
        file
        for file in (folder / "images").rglob("*")
        if file.is_file() and file.suffix not in (".exr", ".png", ".json")
    ]


def start(*words):
    return subprocess.Popen(
        [sys.executable, "-m", "nim_addon", "sweep", *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )


def test_a_sweep_from_words_to_page(nimray, tmp_path):
    words = ("sweep", "sphere", "--vary", "n=-1.5:0.5:0.5", "--measure", "mean,inner-radius", "--film", "n.mp4", *SMALL)
    done = nimray(*words, where=tmp_path)
    assert done.returncode == 0, done.stderr
    names = ["table.csv", "sheet.png", "index.html", "n.mp4"]
    made = [file for file in done.stdout.split() if not file.endswith(".parquet")]  # where pyarrow is there
    assert made == [str(Path("sweep") / name) for name in names]
    assert "nimray: left out n = 0: n = 0 refracts nothing" in done.stderr
    with open(tmp_path / "sweep" / "table.csv", newline="") as stream:
        table = list(csv.DictReader(stream))
    assert [row["n"] for row in table] == ["-1.5", "-1", "-0.5", "0.5"]
    assert 0.4 < float(table[0]["inner-radius"]) < 0.55 and table[3]["inner-radius"] == ""
    status = nimray("sweep", "--status", "sweep", where=tmp_path)
    assert status.stdout == "8 of 8 done; nobody is at work\n"  # with a probe of each
    # the same again, and its plan in the place of the scene, render nothing
    for again in (words, ("sweep", "sweep/plan.jsonl")):
        done = nimray(*again, "--progress", where=tmp_path)
        said = [json.loads(line) for line in done.stdout.splitlines()]
        assert done.returncode == 0 and said[-2]["total"] == 0 and "files" in said[-1], done.stderr


def test_how_far_a_sweep_is_is_said_without_blender():
    code = "import sys; from nim_addon.sweeps import status, worker; sys.exit('bpy' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)


def test_what_a_plan_holds(nimray, tmp_path):
    (tmp_path / "rows.csv").write_text("mu\n-1\n-10\n")
    words = ("--vary", "n=-2,-1", "--csv", "rows.csv", "--wavelengths", "450:550:100", "--split", 2, "--plan", *SMALL)
    done = nimray("sweep", "sphere", *words, "--out", "p", where=tmp_path)
    assert (done.returncode, done.stdout.strip()) == (0, str(Path("p") / "plan.jsonl")), done.stderr
    made = lines(tmp_path / "p")
    assert len(made) == 16 and made[0]["values"] == {"mu": "-1", "n": "-2", "wavelength": "450"}
    assert made[0]["request"]["wavelength"] == 450 and [line["part"] for line in made[:2]] == [[0, 2], [2, 2]]
    done = nimray("sweep", "sea", "--frames", "1-3", "--fps", 10, "--plan", *SMALL, "--out", "s", where=tmp_path)
    made = lines(tmp_path / "s")
    assert [line["values"] for line in made] == [{"frame": "1"}, {"frame": "2"}, {"frame": "3"}], done.stderr
    times = [line["request"]["parameters"]["time"] for line in made]
    assert times[1] - times[0] == pytest.approx(0.1)
    done = nimray(
        "sweep", "sphere", "--zip", "--vary", "n=-2,-1", "mu=-3,-1", "--plan", *SMALL, "--out", "z", where=tmp_path
    )
    assert [line["values"] for line in lines(tmp_path / "z")] == [{"n": "-2", "mu": "-3"}, {"n": "-1", "mu": "-1"}]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ((), "name what to sweep"),
        (("spere",), "did you mean sphere?"),
        (("sphere", "--vary", "n=1:2"), "has no step"),
        (("sphere", "--vary", "n=0:1:0"), "step of 0"),
        (("sphere", "--vary", "n=0,1", "--strict"), "n = 0: n = 0 refracts nothing"),
        (("sphere", "--vary", "n=0"), "n = 0: n = 0 refracts nothing"),
        (("sphere", "--vary", "m=1,2"), "there is no parameter 'm'"),
        (("sphere", "--vary", "n=1,2", "n=3"), "names n twice"),
        (("sphere", "--zip", "--vary", "n=1,2", "mu=1"), "need the same number"),
        (("sphere", "--vary", "seed=0:10000000:1", "n=1:2:0.01"), "more than 10000000"),
        (("sphere", "--vary", "seed=0:200000:1"), "200001 tasks; add --yes"),
        (("sphere", "--vary", "n=1.5,1.50"), "the same render twice"),
        (("sphere", "--measure", "windw"), "did you mean window"),
        (("sphere", "--measure", "window"), "a quantity of the pool"),
        (("sphere", "--film", "f.gif"), "no film that can be made"),
        (("sphere", "--on", "mars"), "--on 'mars' is no place"),
        (("sphere", "--on", "slurm=x"), "is no place"),
        (("sphere", "--film", "a\nb.mp4"), "cannot name a file"),
        (("sphere", "--film", ""), "no film that can be made"),
        (
            ("sphere", "--film", "f.mp4", "--size", "20x15"),
            "no film can be made of 20 x 15 pixels; 16 x 16 are the least",
        ),
        (("sphere", "--on", "dask="), "--on 'dask=' names no scheduler; write it like dask=tls://host:8786"),
        (("sphere", "--on", "dask=host"), "names no scheduler"),
        (("sphere", "--on", "dask=http://host:80"), "names no scheduler"),
        (("sphere", "--on", "dask=host:70000"), "names no scheduler"),
        (("sphere", "--jobs", "3"), "--jobs goes with"),
        (("sphere", "--workers", "3", "--on", "slurm"), "--workers is of this machine"),
        (("sphere", "--workers", "3", "--on", "dask=host:1"), "--workers is of this machine"),
        (("sphere", "--interface", "lo"), "--interface is of a scheduler that is started here"),
        (
            (
                "sphere",
                "--job-options=--time=1",
            ),
            "--job-options goes with --on slurm or --export slurm",
        ),
        (("sphere", "--chunk", "3"), "--chunk goes with --export"),
        (("sphere", "--out", "~nobody.at.all/x"), "there is no such home as that of ~nobody.at.all/x"),
        (("~nobody.at.all/plan.jsonl",), "there is no such home"),
        (("--status", "~nobody.at.all"), "there is no such home"),
        (("sphere", "--vary", "n=\x1b[31m"), r"there is no medium '\x1b[31m'"),
        (("sphere", "--lines", "1-2"), "--lines is of a plan"),
        (("sphere", "--scene", "S"), "--scene names one of a .blend"),
        (("sphere", "--frames", "1-2"), "nothing moves"),
        (("sphere", "--csv", "none.csv"), "none.csv: No such file"),
        (("none.jsonl",), "there is no plan none.jsonl"),
        (("none.blend",), "there is no file none.blend"),
        (("none.jsonl", "--vary", "n=1,2"), "a plan has its own values; leave --vary out"),
        (("none.jsonl", "--samples", "4"), "a plan has its own values; leave --samples out"),
        (("none.jsonl", "--seed", "0"), "leave --seed out"),
        (("none.jsonl", "--no-denoise"), "leave --denoise out"),
        (("none.jsonl", "--out", "there"), "a plan lies in the folder of its sweep"),
        (("--status", "nowhere"), "there is no sweep in nowhere"),
        (("sphere", "--status", "."), "give it alone"),
    ],
)
def test_words_that_make_no_sense(words, told, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code = command.main(["sweep", *words])
    said = capsys.readouterr().err
    assert said.startswith("nimray: ") and said.count("\n") == 1 and told in said
    assert code == (1 if "none.csv" in told else 2)
    assert [file for file in tmp_path.rglob("*") if file.is_file()] == []


def test_what_is_left_out_is_said_without_control_characters(nimray, tmp_path):
    done = nimray("sweep", "sphere", "--vary", "n=-2,\x1b[31m", "--plan", *SMALL, where=tmp_path)
    assert done.returncode == 0 and r"left out n = \x1b[31m" in done.stderr and "\x1b" not in done.stderr


def test_of_many_points_that_are_left_out_some_are_named(nimray, tmp_path):
    done = nimray("sweep", "sphere", "--vary", "n=-2,a,b,c,d,e,f,g", "--plan", *SMALL, where=tmp_path)
    said = done.stderr.splitlines()
    assert [line[: len("nimray: left out n = a")] for line in said[:-1]] == [
        f"nimray: left out n = {n}" for n in "abcde"
    ]
    assert (done.returncode, said[-1]) == (0, "nimray: left out 2 more.")


def test_progress_says_how_far_it_is_by_the_clock_and_at_the_end(tmp_path, capfd):
    at = State(tmp_path, 3, kept=False)
    with Board(at, progress=True) as board:
        said, until = "", time.monotonic() + 30
        while "\n" not in said and time.monotonic() < until:
            time.sleep(0.05)
            said += capfd.readouterr().out
        assert json.loads(said.splitlines()[0]) == at.record()
        at.done = 3
        board.end([tmp_path / "table.csv"])
    *_, last, files = map(json.loads, capfd.readouterr().out.splitlines())
    assert (last["done"], last["total"], files) == (3, 3, {"files": [str(tmp_path / "table.csv")]})


def test_a_plan_edited_into_nonsense_names_its_line(nimray, tmp_path):
    nimray("sweep", "sphere", "--vary", "n=-2,-1", "--plan", *SMALL, where=tmp_path)
    file = tmp_path / "sweep" / "plan.jsonl"
    file.write_text(file.read_text().replace('"n": -1.0', '"n": 0.0'))
    done = nimray("sweep", file)
    assert done.returncode == 2 and "nimray: line 2 of plan.jsonl: n = 0" in done.stderr


def test_a_plan_of_another_blender_is_refused(nimray, tmp_path):
    """Also by whoever renders a line of it, in the job of a queue."""
    nimray("sweep", "sphere", "--vary", "n=-2", "--plan", *SMALL, where=tmp_path)
    file = tmp_path / "sweep" / "plan.jsonl"
    (line,) = lines(file.parent)
    line["request"]["blender"] = "9.9"
    file.write_text(json.dumps(line) + "\n")
    done = nimray("sweep", file, "--lines", "1")
    assert done.returncode == 1 and "n = -2: the plan is for Blender 9.9, and " in done.stderr
    assert nimray("sweep", file, "--lines", "1", "--mixed").returncode == 0


def test_lines_of_a_plan_and_then_all_of_it(nimray, tmp_path):
    nimray("sweep", "sphere", "--vary", "n=-2,-1.5,-1", "--split", 2, "--plan", *SMALL, where=tmp_path)
    file = tmp_path / "sweep" / "plan.jsonl"
    for part in ("1-4", "5-6"):
        done = nimray("sweep", file, "--lines", part, "--quiet")
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert not (tmp_path / "sweep" / "table.csv").exists()
    assert nimray("sweep", file, "--lines", "6-7").stderr == "nimray: --lines 6-7: the plan has 6.\n"
    done = nimray("sweep", file, "--progress")
    assert json.loads(done.stdout.splitlines()[-2])["total"] == 3, done.stderr  # three pictures to be put together


@pytest.mark.parametrize("workers", [1, 2])
def test_the_time_is_told_by_three_of_them_before_the_rest(nimray, tmp_path, workers):
    words = ("sweep", "sphere", "--vary", "samples=1,2,3,4,5,6,64", "--size", "24x18", "--caustics", "path")
    done = nimray(*words, "--progress", "--workers", workers, where=tmp_path)
    said = [json.loads(line) for line in done.stdout.splitlines()]
    ended = [line for line in said if "key" in line or "estimate" in line]
    place, estimate = next((place, line["estimate"]) for place, line in enumerate(ended) if "estimate" in line)
    seconds = {line["task"].removeprefix("samples = "): line["seconds"] for line in ended if "key" in line}
    before = {line["task"].removeprefix("samples = ") for line in ended[:place]}
    assert place >= 3 and {"1", "4", "64"} <= before and len(seconds) == 7, done.stderr
    assert estimate["tasks"] == 7 - place and estimate["workers"] == workers
    expected = (seconds["1"] + 4 * seconds["4"] + seconds["64"]) / 6 * (7 - place) / workers
    assert estimate["seconds"] == pytest.approx(expected, abs=0.06)
    if workers == 1:
        assert [line["task"] for line in ended[:place]] == [f"samples = {count}" for count in (1, 4, 64)]
        four = ("sweep", "sphere", "--vary", "samples=8:11:1", "--size", "24x18", "--caustics", "path")
        done = nimray(*four, where=tmp_path)
        assert re.search(r"^nimray: the last one takes about 0:\d\d on 1 worker.$", done.stderr, re.MULTILINE)
    else:
        more = ("sweep", "sphere", "--vary", "samples=8:14:1", "--size", "24x18", "--caustics", "path")
        done = nimray(*more, "--workers", 2, where=tmp_path)
        assert re.search(
            r"^nimray: the (other [2-4] take|last one takes) about 0:\d\d on 2 workers.$", done.stderr, re.MULTILINE
        )


@pytest.mark.parametrize("on", ["local", "dask"])
def test_ctrl_c_ends_all_within_two_seconds_and_the_same_command_goes_on(on, nimray, tmp_path):
    if on == "dask":
        pytest.importorskip("distributed")
    words = (
        "sphere",
        "--vary",
        "n=-2:-1:0.25",
        "--size",
        "200x150",
        "--samples",
        "64",
        "--caustics",
        "path",
        "--on",
        on,
        "--out",
        tmp_path,
    )
    run = start(*words, "--progress")
    for line in run.stdout:
        if line.startswith('{"key"'):
            break
    children = _children(run.pid)
    run.send_signal(signal.SIGINT)
    began = time.monotonic()
    run.wait(10)
    while any(map(_lives, children)) and time.monotonic() - began < 10:
        time.sleep(0.05)
    assert time.monotonic() - began < 4, "longer than twice what it may take, on a busy machine"
    assert run.returncode == 130 and children and left_over(tmp_path) == []
    assert run.stderr.read() == "nimray: stopped.\n"
    status = nimray("sweep", "--status", tmp_path)
    assert "of 5 done" in status.stdout and "nobody is at work" in status.stdout
    had = {file: file.stat().st_mtime_ns for file in (tmp_path / "images").rglob("*.exr")}
    assert had
    done = nimray("sweep", *words, "--quiet")
    assert done.returncode == 0, done.stderr
    assert all(file.stat().st_mtime_ns == time_ for file, time_ in had.items())
    assert len(list((tmp_path / "images").rglob("*.exr"))) == 5


def test_kill_9_of_anything_leaves_whole_files_and_is_gone_on_from(nimray, tmp_path):
    """The client or its Blender, at random moments; whatever is there afterwards is whole."""
    words = ("sphere", "--vary", "n=-2:-1:0.1", *SMALL, "--out", tmp_path)
    chance = random.Random(17)
    for moment in range(4):
        run = start(*words, "--quiet")
        time.sleep(0.8 + 2 * chance.random())
        victims = [run.pid] if moment % 2 else _children(run.pid)
        for pid in victims:
            if _lives(pid):
                os.kill(pid, signal.SIGKILL)
        if moment % 2:
            run.wait()
        else:  # it starts another
            assert run.wait(120) == 0, run.stderr.read()
        for table in (tmp_path / "images").rglob("*.json"):
            assert json.loads(table.read_text())["seconds"] > 0 and table.with_suffix(".exr").is_file()
    done = nimray("sweep", *words, "--quiet")
    assert (done.returncode, done.stderr) == (0, "")
    with open(tmp_path / "table.csv", newline="") as stream:
        assert len(list(csv.DictReader(stream))) == 11
    assert len(list((tmp_path / "images").rglob("*.exr"))) == 11


def _children(pid):
    try:
        inner = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
        every = [
            int(child)
            for task in Path(f"/proc/{pid}/task").iterdir()
            for child in (task / "children").read_text().split()
        ]
    except OSError:
        return []
    return sorted({*map(int, inner), *every})


def _lives(pid):
    try:
        return "Z" not in Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
