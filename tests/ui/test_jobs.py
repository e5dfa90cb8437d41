# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders in the background: to the end, cancelled, failing, and ended with the add-on."""

import re
import time
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest

from nim_addon import command
from nim_addon.base import processes
from nim_addon.cycles.images import read_metadata
from nim_addon.physics import MEDIA, Medium
from nim_addon.scenes import SCENES
from nim_addon.ui import jobs, preferences, scene_settings, variants

from .conftest import Layout

TINY = (2, 4)  # samples, percent of the scene's own size


@pytest.fixture
def settings(addon, monkeypatch, tmp_path):
    """The settings of a sphere that renders in no time, into tmp_path."""
    monkeypatch.setattr(jobs, "output_folder", lambda: tmp_path)
    monkeypatch.setitem(scene_settings.QUALITIES, "DRAFT", TINY)
    settings = bpy.context.scene.nim_scenes
    settings.scene, settings.quality, settings.backend = "sphere", "DRAFT", "nodes"
    return settings


def follow(until, seconds=60):
    """Look after the job, as the timer does where there is a window, until `until(job)` or its end."""
    deadline = time.monotonic() + seconds
    while jobs.job().look() and not until(jobs.job()):
        assert time.monotonic() < deadline, "the job takes too long"
        time.sleep(0.05)
    return jobs.job()


def never(job):
    return False


def test_render_headless_runs_to_the_end_and_opens(settings, press, tmp_path):
    settings.sphere.n = -1.33
    assert press("nim.render_headless") == {"FINISHED"}
    with pytest.raises(RuntimeError, match="under way"):
        press("nim.render_variants")
    with pytest.raises(RuntimeError, match="No render in the background has been finished"):
        press("nim.open_result")
    job = follow(never)
    assert (job.code, job.problem) == (0, "")
    assert (job.done, job.total) == (2, 2)
    assert job.progress() == (1.0, None)
    assert job.files == [tmp_path / "sphere_n--1.33.exr", tmp_path / "sphere_n--1.33.png"]
    assert sorted(tmp_path.iterdir()) == job.files
    made = read_metadata(job.files[0])
    assert (made["parameters"]["n"], made["samples"], made["size"]) == (-1.33, 2, [32, 24])
    assert press("nim.open_result") == {"FINISHED"}
    assert tuple(bpy.data.images["sphere_n--1.33.png"].size) == (32, 24)
    job.files[-1].unlink()
    with pytest.raises(RuntimeError, match="was it moved"):
        press("nim.open_result")


def test_all_variants_stand_side_by_side(settings, press, tmp_path, capsys):
    settings.sphere.companions = True
    assert press("nim.render_variants") == {"FINISHED"}
    seen = set()
    job = follow(lambda job: seen.add(job.done))
    assert (job.code, job.problem, job.total) == (0, "", 6)
    assert max(seen) > 2  # over all of them
    linear, shown = job.files[-2:]
    assert shown.name == "sphere_companions-yes_compare.png"
    parts = [oiio.ImageBuf(str(file)).get_pixels(oiio.UINT8) for file in job.files[1:-2:2]]
    rows = oiio.ImageBuf(str(shown)).get_pixels(oiio.UINT8)
    assert rows.shape[1:] == (3 * 32 + 2 * 2, 3)
    for number, part in enumerate(parts):
        assert np.array_equal(rows[:24, 34 * number :][:, :32], part)
        assert rows[24:, 34 * number :][:, :32].min() < 128, "its caption"
    assert not np.array_equal(parts[0], parts[2])
    assert oiio.ImageBuf(str(linear)).spec().format == oiio.FLOAT
    assert read_metadata(linear)["compares"] == ["n=1", "n=1.33", "n=-1.5"]  # the panel's own NIM
    assert command.main(["render", "--again", str(shown)]) == 2
    assert "is a comparison, not one render" in capsys.readouterr().err


def test_cancel_ends_the_process_and_leaves_nothing(settings, press, tmp_path):
    settings.quality = "FINAL"
    with pytest.raises(RuntimeError, match="No render in the background is under way"):
        press("nim.cancel_render")
    press("nim.render_headless")
    job = follow(lambda job: list(tmp_path.glob(".*.part")))
    assert job.running
    assert press("nim.cancel_render") == {"FINISHED"}
    assert job.process.poll() == 130  # by itself, not killed
    assert (job.running, job.problem, list(tmp_path.iterdir())) == (False, "", [])


def test_a_failing_job_says_why_in_one_sentence(settings, one_sentence, tmp_path):
    (tmp_path / "file").write_text("")
    jobs.start(jobs.one_render(settings, tmp_path), tmp_path / "file" / "below")
    job = follow(never)
    assert job.code == 1
    one_sentence(job.problem, "cannot write into")
    assert [file.name for file in tmp_path.iterdir()] == ["file"]


def test_disabling_the_add_on_ends_the_job(settings, addon, press):
    import addon_utils

    settings.quality = "FINAL"
    press("nim.render_headless")
    process = jobs.job().process
    addon_utils.disable(addon, default_set=True)
    assert process.poll() is not None
    assert jobs.job() is None
    assert not bpy.app.timers.is_registered(jobs.tick)


def test_a_process_that_cannot_be_started_is_reported(settings, press, monkeypatch):
    monkeypatch.setattr(processes.sys, "executable", "/nowhere/python")
    with pytest.raises(RuntimeError, match="could not be started"):
        press("nim.render_headless")


def test_variants_keep_the_rest_of_the_settings(settings, tmp_path):
    settings.scene = "pool"
    settings.pool.use_mu, settings.pool.mu, settings.pool.view = True, -10, "window"
    work = variants.all_variants(settings, tmp_path)
    assert work.joined == "pool_view-window_compare"
    compares = ["liquid=none", "liquid=water", "liquid=n=-1.33,mu=-10"]
    assert work.compared == {"set": ["view=window"], "compares": compares}
    assert list(work.compared) == ["set", "compares"]  # as `nimray info` lists them
    liquids = [request.parameters.liquid for request in work.requests.values()]
    assert liquids == [None, MEDIA["water"], Medium(-1.33, -10)]
    assert {request.parameters.view for request in work.requests.values()} == {"window"}
    settings.scene, settings.sphere.n = "sphere", 1.5
    assert variants.all_variants(settings, tmp_path).compared == {"compares": ["n=1", "n=1.33", "n=-1.33"]}
    settings.sphere.n, settings.sphere.use_mu, settings.sphere.mu = -1.5, True, -2
    assert variants.all_variants(settings, tmp_path).compared["compares"][-1] == "n=-1.5 mu=-2"
    settings.sphere.n_medium, settings.sphere.n_words, settings.sphere.use_mu = "words", "n=-1.5,length=2", False
    work = variants.all_variants(settings, tmp_path)
    assert work.compared["compares"][-1] == "n=n=-1.5,length=2"
    assert list(work.requests.values())[-1].parameters.medium == Medium.parse("n=-1.5,length=2")


@pytest.fixture
def asked(settings, tmp_path):
    """asked(scene, key, values) -> the Work of the variants that these ask for."""

    def work(scene, key, values=None):
        settings.scene = scene
        group = bpy.context.scene.nim_variants
        setattr(group, scene, key)
        if values is not None:
            setattr(group, f"{scene}_values", values)
        return variants.all_variants(settings, tmp_path)

    return work


@pytest.mark.parametrize("scene", SCENES)
def test_every_scene_has_its_usual_variants(asked, scene):
    work = asked(scene, variants.USUAL)
    assert len(work.requests) == len(work.captions) == len(work.compared["compares"]) == 3


@pytest.mark.parametrize(
    ("scene", "key", "values", "compares", "captions"),
    [
        ("sphere", "n", "-1.5, -1:1", None, "is not a number"),
        ("sphere", "n", "-1.5:-1:0.25", ["n=-1.5", "n=-1.25", "n=-1"], ("n = -1.5", "n = -1.25", "n = -1")),
        ("sphere", "n", "1.5, -1.33,mu=-10", ["n=1.5", "n=-1.33 mu=-10"], ("n = 1.5", "n = -1.33, mu = -10")),
        ("pool", "n", "-1.4,1.33", ["liquid=n=-1.4", "liquid=n=1.33"], ("n = -1.4", "n = 1.33")),
        (
            "pool",
            "view",
            None,
            ["view=side", "view=top", "view=window"],
            ("view = side", "view = top", "view = window"),
        ),
        ("glass", "straw", None, ["straw=no", "straw=yes"], ("straw = no", "straw = yes")),
        ("glass", "liquid", None, ["liquid=none", "liquid=water", "liquid=nim"], ("liquid = none",)),
        ("sea", "waves", "0, 0.1", ["waves=0", "waves=0.1"], ("waves = 0", "waves = 0.1")),
    ],
)
def test_any_parameter_is_varied_with_any_values(asked, scene, key, values, compares, captions):
    if compares is None:
        with pytest.raises(ValueError, match="n"):
            asked(scene, key, values)
        return
    work = asked(scene, key, values)
    assert work.compared["compares"] == compares
    assert work.captions[: len(captions)] == captions
    assert [request.parameters for request in work.requests.values()] == [
        SCENES[scene].parameters.read(text.split(" ")) for text in compares
    ]


WRONG = [
    ("sphere", "n", "", "n has no values; write them like -1.5, -1, 1.33"),
    ("sphere", "n", "1.5, many", "media are"),
    ("sphere", "n", "0, 1.5", "refracts nothing"),
    ("sphere", "n", "-1.5", "give at least two"),
    ("sphere", "n", "1.5, 1.50", "is there twice"),
    ("sphere", "n", "1.5, 1.5", "names 1.5 twice"),
    ("sphere", "n", "1.5,,2", "has an empty value"),
    ("sphere", "n", "1:2", "has no step"),
    ("sphere", "n", "1:2:0", "never ends"),
    ("sphere", "n", "1.1:9.9:0.01", "881 pictures are too many"),
    ("pool", "waves", "0, 1", "out of range"),
    ("pool", "waves", None, "waves has no values"),
    ("pool", "seed", "1, 1.5", "is not a whole number"),
    ("pool", "view", "side, below", "below"),
]


@pytest.mark.parametrize(("scene", "key", "values", "says"), WRONG, ids=[f"{case[1]}-{case[3]}" for case in WRONG])
def test_values_that_are_none_get_one_sentence_in_the_panel(
    asked, settings, press, one_sentence, scene, key, values, says
):
    with pytest.raises(ValueError) as caught:
        asked(scene, key, values)
    one_sentence(str(caught.value), says)
    layout = Layout()
    variants.NIM_PT_variants.draw(SimpleNamespace(layout=layout), context_of_panel())
    assert says.split()[0] in layout.text and ("operator", "nim.render_variants") in layout.drawn
    with pytest.raises(RuntimeError, match=re.escape(says)):
        press("nim.render_variants")


def context_of_panel():
    """What a panel is drawn in, wide enough for any sentence."""
    ui = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))
    return SimpleNamespace(scene=bpy.context.scene, region=SimpleNamespace(width=9000), preferences=ui)


def test_the_panel_says_how_many_variants_and_what_it_renders(settings):
    class Named(Layout):
        def operator(self, name, text=None, **_):
            self.drawn.append((name, text))

    settings.quality = "DEFAULT"
    layout = Named()
    jobs.NIM_PT_jobs.draw(SimpleNamespace(layout=layout), context_of_panel())
    variants.NIM_PT_variants.draw(SimpleNamespace(layout=layout), context_of_panel())
    assert ("nim.render_headless", "Render Sphere") in layout.drawn
    assert ("nim.render_variants", "Render 3 Variants") in layout.drawn
    told = jobs.NIM_OT_render_headless.description(context_of_panel(), None)
    assert "Sphere" in told and "800 x 600 pixels, 128 samples" in told
    settings.scene, settings.quality = "pool", "GOOD"
    assert "Pool" in jobs.NIM_OT_render_headless.description(context_of_panel(), None)
    bpy.context.scene.nim_variants.pool = "view"
    jobs.NIM_PT_jobs.draw(SimpleNamespace(layout=layout), context_of_panel())
    assert ("nim.render_headless", "Render Pool") in layout.drawn


def test_renders_go_where_the_preferences_say_and_overwrite_nothing(addon, monkeypatch, tmp_path):
    assert jobs.output_folder() == Path.home() / "renders"
    preferences.settings().folder = str(tmp_path)
    assert jobs.output_folder() == tmp_path
    preferences.settings().folder = ""
    (tmp_path / "one.png").touch()
    (tmp_path / "one_2.exr").touch()
    assert jobs.free_name(tmp_path, "one") == "one_3"


def test_progress_goes_by_the_clock_between_reports(settings, tmp_path):
    job = jobs.start(jobs.one_render(settings, tmp_path), tmp_path)
    job.cancel()
    job.done, job.total, job.left, job.when = 50, 100, 100.0, time.monotonic() - 50
    part, left = job.progress()
    assert part == pytest.approx(0.75, abs=0.01)
    assert left == pytest.approx(50, abs=1)
    assert job.text() == "75%, 0:50 left"
