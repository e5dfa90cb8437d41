# SPDX-License-Identifier: GPL-3.0-or-later
"""A sweep on this machine: Blenders that render one task after the other, crash, are killed, and go on."""

import dataclasses
import io
import json
import os
import signal
import socket
import time

import numpy as np
import OpenImageIO as oiio
import pytest

from nim_addon.renders.request import Request
from nim_addon.sweeps import child as sweeps_child
from nim_addon.sweeps import children, plan, results, state, status
from nim_addon.sweeps.children import Child
from nim_addon.sweeps.orders import Order
from nim_addon.sweeps.plan import Task


def pixels(file):
    return np.asarray(oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT), float)


def test_a_sweep_is_what_its_renders_are_and_renders_nothing_twice(spheres, sweep, tmp_path):
    tasks = spheres(-1.5, -1)
    plan.write(tmp_path, tasks)
    said = []
    problems, at = sweep(tasks, ended=lambda order, outcome: said.append(order.task))
    assert (problems, at.done, at.total, said) == ([], 2, 2, tasks)
    for task in tasks:
        alone = task.request.render(tmp_path / "alone", task.key)
        assert np.abs(pixels(alone.exr) - pixels(results.image_of(tmp_path, task))).max() < 1e-5
        made = results.made(tmp_path, task)
        assert (made.host, made.backend) == (socket.gethostname(), "nodes") and made.seconds > 0
    # another value renders what is new alone
    said.clear()
    more = [*tasks, *spheres(-2)]
    assert sweep(more, ended=lambda order, outcome: said.append(order.task))[0] == [] and said == more[2:]
    assert status.of(tmp_path).record() == {
        "done": 2, "total": 2, "at_work": False, "left": None, "failed": 0, "workers": {}
    }  # fmt: skip


@pytest.mark.parametrize("options", [{}, {"denoise": True}, {"spectral": True}], ids=["plain", "denoised", "spectral"])
def test_parts_make_the_picture_that_one_render_is(options, spheres, sweep, tmp_path):
    (task,) = spheres(-1.5, samples=8, **options)
    parts = plan.split(task, 3)
    whole = parts[0].request.render(tmp_path / "alone", "whole")
    assert sweep(parts)[0] == []
    (picture,) = plan.pictures(parts)
    exr = results.image_of(tmp_path, picture)
    expected, found = pixels(whole.exr), pixels(exr)
    assert np.quantile(np.abs(found - expected) / (np.abs(expected) + 0.01), 0.999) < (1e-5 if options else 1e-6)
    assert np.abs(pixels(whole.png) - pixels(exr.with_suffix(".png"))).max() <= 1.01 / 255
    # the parts are in it now
    assert sorted(file.suffix for file in exr.parent.iterdir()) == [".exr", ".json", ".png"]
    assert results.to_do(tmp_path, parts) == []


def test_what_cannot_be_rendered_is_said_and_the_rest_goes_on(spheres, sweep, tmp_path):
    (good,) = spheres(-1.5)
    mesh = tmp_path / "figure.obj"
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    bad = Task(Request.of("glass", {"figures": str(mesh)}, size=(16, 12), samples=1, backend="nodes"))
    assert bad.key
    mesh.unlink()
    problems, at = sweep([bad, good])
    assert [(problem.task, results.made(tmp_path, problem.task)) for problem in problems] == [(bad, None)]
    assert "there is no file" in problems[0].problem and "\n" not in problems[0].problem
    assert (at.done, at.failed) == (1, 1) and results.made(tmp_path, good)


def test_a_plan_for_another_blender_is_refused_unless_mixed(spheres, tmp_path):
    (task,) = spheres(-1.5)
    record = Order(task).record(tmp_path)
    record["task"]["request"]["blender"] = "9.9.9"
    child = Child("")
    try:
        refused = child.carry_out(record)
        assert not refused.again and refused.problem.startswith("the plan is for Blender 9.9.9, and ")
        assert child.carry_out({**record, "mixed": True}).problem is None
    finally:
        child.end()


def test_a_child_that_is_killed_is_started_anew(spheres, sweep, tmp_path):
    """In the middle of its second task, with kill -9: both are there, whole, and nothing else."""
    tasks = spheres(-1.5, -1, -2)
    child, killed = [], []
    former = Child.carry_out

    def carry_out(self, order, report=None):
        child.append(self)
        if len(child) == 2:
            os.kill(self.pid, signal.SIGKILL)
            killed.append(self.pid)
        return former(self, order, report)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Child, "carry_out", carry_out)
        assert sweep(tasks)[0] == [] and killed
    assert results.to_do(tmp_path, tasks) == [] and len(child) == 4
    left = {file.suffix for file in (tmp_path / "images").rglob("*") if file.is_file()}
    assert left == {".exr", ".png", ".json"}


def test_a_child_that_is_killed_before_it_has_read_its_order(spheres, tmp_path):
    child = Child("")
    child.start()
    os.kill(child.pid, signal.SIGKILL)
    time.sleep(0.5)
    outcome = child.carry_out(Order(*spheres(-1)).record(tmp_path))
    assert outcome.again and "ended (exit code -9)" in outcome.problem


def test_a_task_that_always_kills_its_blender_is_left(spheres, sweep, monkeypatch):
    tasks, tried = spheres(-1.5, -1), []
    former = Child.carry_out

    def carry_out(self, order, report=None):
        if order["task"]["values"]["n"] == "-1.5":
            tried.append(order)
            self.start()
            os.kill(self.pid, signal.SIGKILL)
        return former(self, order, report)

    monkeypatch.setattr(Child, "carry_out", carry_out)
    (problem,), at = sweep(tasks)
    assert len(tried) == 3 and problem.task == tasks[0] and at.done == 1
    assert problem.problem.startswith("the Blender that rendered it ended (exit code -9)")


def test_what_fails_without_a_word_has_failed(spheres, tmp_path, monkeypatch):
    def fail(order, progress):
        raise TimeoutError

    monkeypatch.setattr(sweeps_child, "carry_out", fail)
    answers = io.StringIO()
    sweeps_child.serve(io.StringIO(json.dumps(Order(*spheres(-1)).record(tmp_path))), answers)
    assert json.loads(answers.getvalue().splitlines()[-1])["problem"] == "TimeoutError"


def test_a_child_is_replaced_in_time(spheres, sweep, monkeypatch):
    monkeypatch.setattr(children, "RENDERS", 1)
    pids = []
    former = Child.carry_out

    def carry_out(self, order, report=None):
        outcome = former(self, order, report)
        pids.append(self.pid)
        return outcome

    monkeypatch.setattr(Child, "carry_out", carry_out)
    assert sweep(spheres(-1.5, -1))[0] == [] and len(set(pids)) == 2


def test_inputs_of_a_blend_are_varied(tmp_path, sweep):
    """A picture of a .blend with another index is that of the scene with it."""
    from nim_addon.scenes import scene_type

    sphere = scene_type("sphere")
    import bpy

    scene = sphere.build(sphere.parameters(n=-2), "nodes")
    bpy.data.libraries.write(str(tmp_path / "mine.blend"), {scene}, fake_user=True)
    (material,) = {
        slot.material.name
        for thing in scene.objects
        if thing.name.startswith("Sphere")
        for slot in thing.material_slots
    }
    base = Request.of_blend(tmp_path / "mine.blend", size=(24, 18), samples=4, caustics="path")

    def at(values):
        return dataclasses.replace(base, inputs={key: float(value) for key, value in values.items()})

    tasks = [plan.task_at({f"{material}:Index Inside": n}, at) for n in ("-2", "-1.2")]
    wrong = [plan.task_at({"Sphear:Index Inside": "-1"}, at), plan.task_at({f"{material}:Index": "-1"}, at)]
    problems, _ = sweep([*tasks, *wrong])
    assert [problem.problem.partition(";")[0] for problem in problems] == [
        "there is no NIM material 'Sphear'",
        f"there is no input of {material} 'Index'",
    ]
    two, other = (pixels(results.image_of(tmp_path, task)) for task in tasks)
    expected = pixels(dataclasses.replace(base).render(tmp_path / "alone", "two").exr)
    assert np.abs(two - expected).max() < 1e-4 and np.abs(other - expected).max() > 0.1


def test_one_process_at_a_time(tmp_path):
    assert not state.is_at_work(tmp_path)
    with state.alone(tmp_path):
        assert state.is_at_work(tmp_path)
        with pytest.raises(RuntimeError, match="another process"), state.alone(tmp_path):
            pass
    assert not state.is_at_work(tmp_path)


def test_status_of_no_sweep(tmp_path):
    with pytest.raises(ValueError, match="there is no sweep in"):
        status.of(tmp_path)
    for nonsense in ([1], {}, {"key": [1]}, {"key": 3}):
        (tmp_path / "plan.jsonl").write_text(json.dumps(nonsense))
        with pytest.raises(ValueError, match="is not understood"):
            status.of(tmp_path)
