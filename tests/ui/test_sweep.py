# SPDX-License-Identifier: GPL-3.0-or-later
"""The sweep of the panel: what may be varied, its plan, its end, and its page."""

import time

import bpy
import pytest

from nim_addon.sweeps import plan
from nim_addon.ui import jobs, scene_settings, sweep

TINY = (2, 4)  # samples, percent of the scene's own size


@pytest.fixture
def scene(addon, monkeypatch, tmp_path):
    """The scene of Blender, whose settings are those of a sphere that renders in no time, into tmp_path."""
    monkeypatch.setattr(jobs, "output_folder", lambda: tmp_path)
    monkeypatch.setitem(scene_settings.QUALITIES, "DRAFT", TINY)
    scene = bpy.context.scene
    settings = scene.nim_scenes
    settings.scene, settings.quality, settings.backend = "sphere", "DRAFT", "nodes"
    return scene


def test_what_may_be_varied_is_of_the_chosen_scene(scene):
    assert [name for name, *_ in sweep.parameters("sphere")][:2] == ["n", "mu"]
    assert sweep.parameters("pool")[0][0] == "n"  # of its liquid
    scene.nim_sweep.first = "mu"
    scene.nim_sweep.second = "n"
    scene.nim_sweep.first_from, scene.nim_sweep.first_to, scene.nim_sweep.first_count = -1, -0.7, 4
    assert sweep.axes_of(scene.nim_sweep)[0] == ("mu", ("-1", "-0.9", "-0.8", "-0.7"))
    assert [key for key, _ in sweep.axes_of(scene.nim_sweep)] == ["mu", "n"]


def test_points_that_are_no_render_are_left_out_and_said(scene):
    tasks, left_out = sweep.tasks_of(scene)
    assert [task.values["n"] for task in tasks] == ["-1.5", "-1", "-0.5", "0.5", "1", "1.5"]
    assert [text.partition(" refracts")[0] for text in left_out] == ["n = 0"]
    scene.nim_sweep.first_count = 1
    scene.nim_sweep.first_from = 0
    with pytest.raises(ValueError, match="n = 0 refracts nothing"):
        sweep.tasks_of(scene)
    scene.nim_sweep.second = "mu"
    scene.nim_sweep.first_count = scene.nim_sweep.second_count = 1000
    with pytest.raises(ValueError, match="1000000 pictures are too many"):
        sweep.tasks_of(scene)


def test_a_sweep_of_the_pool_varies_its_liquid(scene):
    scene.nim_scenes.scene = "pool"
    scene.nim_sweep.first_from, scene.nim_sweep.first_to, scene.nim_sweep.first_count = -1.4, -1.3, 2
    tasks, _ = sweep.tasks_of(scene)
    assert [task.request.parameters.liquid.n for task in tasks] == [-1.4, -1.3]


def test_a_sweep_runs_to_its_page(scene, press, tmp_path):
    with pytest.raises(RuntimeError, match="No sweep of this scene"):
        press("nim.open_sweep")
    scene.nim_sweep.first_from, scene.nim_sweep.first_to, scene.nim_sweep.first_count = -2, -1, 2
    assert press("nim.sweep") == {"FINISHED"}
    with pytest.raises(RuntimeError, match="under way"):
        press("nim.sweep")
    job, end = jobs.job(), time.monotonic() + 120
    while job.look():
        assert time.monotonic() < end
        time.sleep(0.05)
    assert (job.code, job.problem) == (0, "")
    folder = tmp_path / "sweep_sphere"
    made = [file.name for file in job.files if file.suffix != ".parquet"]  # where pyarrow is there
    assert made == ["table.csv", "sheet.png", "index.html"]
    # its plan is that of the command
    assert [task.values for task in plan.read(folder / "plan.jsonl")] == [{"n": "-2"}, {"n": "-1"}]
    assert press("nim.open_result") == {"FINISHED"} and "sheet.png" in bpy.data.images
    assert sweep.page_of(scene) == folder / "index.html" and sweep.NIM_OT_open_sweep.poll(bpy.context)


def test_a_sweep_that_is_cancelled_goes_on(scene, press, tmp_path):
    scene.nim_sweep.first_from, scene.nim_sweep.first_to, scene.nim_sweep.first_count = -2, -1, 3
    press("nim.sweep")
    press("nim.cancel_render")
    assert jobs.job().cancelled and not jobs.job().running
    assert press("nim.sweep") == {"FINISHED"}
    jobs.end()
