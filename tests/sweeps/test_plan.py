# SPDX-License-Identifier: GPL-3.0-or-later
"""The plan: tasks that are called by what they render, and the file that holds them."""

import dataclasses
import json
from types import SimpleNamespace

import pytest

from nim_addon.renders import asked
from nim_addon.renders.request import Request
from nim_addon.sweeps import plan, results, status
from nim_addon.sweeps.plan import Task

SMALL = {"size": (16, 12), "samples": 8, "caustics": "path", "backend": "nodes"}


def request(**values):
    return Request.of("sphere", {"n": "-1.5", **values}, **SMALL)


def sphere_at(point):
    return plan.task_at(point, lambda values: Request.of("sphere", values, **SMALL))


def test_what_is_varied_is_of_the_scene_or_of_the_render():
    task = sphere_at({"n": "-2", "seed": "7", "wavelength": "450"})
    assert (task.request.parameters.n, task.request.seed, task.request.wavelength) == (-2.0, 7, 450.0)
    assert task.title == "n = -2, seed = 7, wavelength = 450"
    with pytest.raises(ValueError, match=r"seed = '1.5' is not a whole number"):
        sphere_at({"seed": "1.5"})
    with pytest.raises(ValueError, match="n = 0 refracts nothing"):
        sphere_at({"n": "0"})


def test_a_task_is_called_by_its_pixels(monkeypatch):
    """Neither by how it is written, nor by the Blender that planned it; by all else."""
    task = Task(request(), {"n": "-1.5"})
    assert Task(request(mu="-1"), {}).key == task.key
    with monkeypatch.context() as patch:
        patch.setattr(asked, "bpy", SimpleNamespace(app=SimpleNamespace(version_string="9.9")))
        record = Task(request(), {}).record()
    assert record["request"]["blender"] == "9.9" and record["key"] == task.key
    read = Task.of(record)
    assert read.key == task.key and read.record() == record  # also for whom it was planned
    others = [request(n="-1.4"), dataclasses.replace(request(), seed=1), dataclasses.replace(request(), samples=9)]
    assert len({Task(other).key for other in others} | {task.key}) == 4


def test_the_content_of_a_mesh_file_counts(tmp_path):
    """A file of another name is the same; the same name with another content is another."""
    text = "o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"

    def key(name, content):
        (tmp_path / name).write_text(content)
        made = Request.of("glass", {"figures": str(tmp_path / name)}, **SMALL)
        return Task(made).key

    first = key("a.obj", text)
    assert key("b.obj", text) == first
    assert key("a.obj", text.replace("v 1 0 0", "v 2 0 0")) != first


def test_parts_cover_the_samples():
    parts = plan.split(Task(request()), 3)
    assert [task.part for task in parts] == [(0, 2), (2, 3), (5, 3)]
    assert len({task.image for task in parts}) == 1 and len({task.key for task in parts}) == 3
    spectral = plan.split(Task(dataclasses.replace(request(), spectral=True, spectral_passes=4)), 2)
    assert {task.request.spectral_passes for task in spectral} == {1}  # each has all wavelengths
    for wrong in (0, 9):
        with pytest.raises(ValueError, match="from 1 to 8"):
            plan.split(Task(request()), wrong)


def test_a_plan_is_written_and_read(tmp_path):
    tasks = [sphere_at({"n": "-2"}), *plan.split(sphere_at({"n": "-1.5"}), 2)]
    file = plan.write(tmp_path, tasks)
    assert plan.read(file) == tasks
    assert [json.loads(line)["key"] for line in file.read_text().splitlines()] == [task.key for task in tasks]
    plan.write(tmp_path, tasks)
    assert not (tmp_path / "plan.former.jsonl").exists()
    plan.write(tmp_path, tasks[:1])
    assert plan.read(tmp_path / "plan.former.jsonl") == tasks


def test_a_plan_may_be_edited(tmp_path):
    """A line that was changed is another task, whatever it says that it is called."""
    file = plan.write(tmp_path, [sphere_at({"n": "-2"})])
    file.write_text(file.read_text().replace('"n": -2.0', '"n": -2.5'))
    (task,) = plan.read(file)
    assert task.request.parameters.n == -2.5 and task.key != sphere_at({"n": "-2"}).key


@pytest.mark.parametrize(
    ("edit", "told"),
    [
        (lambda line: line[:40], "line 2 of plan.jsonl is no task"),
        (lambda line: "[1, 2]", "line 2 of plan.jsonl is no task"),
        (lambda line: line.replace('"values"', '"valued"'), "line 2 of plan.jsonl is no task"),
        (lambda line: line.replace('"n": -2.0', '"n": 0'), "line 2 of plan.jsonl: n = 0"),
        (lambda line: line.replace('"n": -2.0', '"m": 0'), "line 2 of plan.jsonl"),
        (lambda line: line.replace('"samples": 8', '"samples": "many"'), "line 2 of plan.jsonl records samples"),
        (lambda line: line.replace('"key"', '"part": [3, 9], "key"'), "line 2 of plan.jsonl has part"),
        (lambda line: line.replace('"key"', '"colour": 3, "key"'), "line 2 of plan.jsonl has colour"),
        (
            lambda line: line.replace('"n": "-2"', r'"n": "\udcff"'),
            "line 2 of plan.jsonl has values that are no Unicode",
        ),
    ],
)
def test_a_plan_that_was_edited_into_nonsense(tmp_path, edit, told):
    file = plan.write(tmp_path, [sphere_at({"n": "-1"}), sphere_at({"n": "-2"})])
    first, second = file.read_text().splitlines()
    assert edit(second) != second
    file.write_text(f"{first}\n{edit(second)}\n")
    with pytest.raises(ValueError, match=told):
        plan.read(file)


def test_a_plan_may_have_the_mark_of_an_editor(tmp_path):
    file = plan.write(tmp_path, [sphere_at({"n": "-1"})])
    text = file.read_text()
    file.write_text(text, encoding="utf-8-sig")
    assert plan.read(file) == [sphere_at({"n": "-1"})] and status.of(tmp_path).total == 1


def test_a_plan_that_is_empty_or_has_a_task_twice(tmp_path):
    file = tmp_path / "plan.jsonl"
    file.write_text("\n")
    with pytest.raises(ValueError, match=r"plan.jsonl is empty"):
        plan.read(file)
    line = json.dumps(sphere_at({"n": "-1"}).record())
    file.write_text(f"{line}\n{line}\n")
    with pytest.raises(ValueError, match="same render twice, as tasks 1 and 2"):
        plan.read(file)


def test_probes_are_measured_and_not_shown():
    tasks = [Task(Request.of("pool", {"liquid": "nim", "mu": mu}, **SMALL), {"mu": mu}) for mu in ("-1", "-10")]
    probes = plan.probes(tasks, ["mean", "R", "window"])
    assert [task.values for task in probes] == [
        {"mu": "-1"},
        {"mu": "-10"},
    ]  # R and window share one, the mean needs none
    assert plan.pictures([*tasks, *probes]) == tasks
    with pytest.raises(ValueError, match="did you mean window"):
        plan.probes(tasks, ["windows"])
    with pytest.raises(ValueError, match="window is a quantity of the pool, not of sphere"):
        plan.probes([sphere_at({})], ["window"])


def test_what_is_done_has_all_its_files(tmp_path):
    task = sphere_at({"n": "-1"})
    made = results.Made(1.0, "here", "4.5", "nodes")
    exr = results.image_of(tmp_path, task)
    exr.parent.mkdir(parents=True)
    for file in (exr, exr.with_suffix(".png")):
        assert results.to_do(tmp_path, [task]) == [task]
        file.write_bytes(b"")
    assert results.to_do(tmp_path, [task]) == [task]
    results.finish(tmp_path, task, made)
    assert results.to_do(tmp_path, [task, *plan.split(task, 2)]) == [] and results.made(tmp_path, task) == made
    for file in (exr, exr.with_suffix(".png"), exr.with_suffix(".json")):
        kept = file.read_bytes()
        file.unlink()
        assert results.to_do(tmp_path, [task]) == [task]
        file.write_bytes(kept)
    assert results.to_do(tmp_path, [task]) == []
