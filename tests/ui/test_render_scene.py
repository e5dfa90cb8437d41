# SPDX-License-Identifier: GPL-3.0-or-later
"""A person's own scene, rendered in the background as it is: what is in the picture, where it goes, and what stays as it was."""

import time
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest

from nim_addon.base.streams import quiet
from nim_addon.cycles.images import read_metadata
from nim_addon.ui import escape, jobs, preferences, render_scene

from .conftest import Layout


@pytest.fixture
def scene(addon, tmp_path):
    """Blender's first scene, saved, of 16 x 9 pixels in Cycles."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.render.resolution_percentage = 1, False, 1
    scene.render.resolution_x, scene.render.resolution_y = 1600, 900
    with quiet():
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    return scene


def followed():
    deadline = time.monotonic() + 90
    while jobs.job().look():
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return jobs.job()


def pixels(file):
    return oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT)[..., :3]


def test_the_scene_is_rendered_with_what_is_not_saved(scene, press, tmp_path):
    before = (tmp_path / "shot.blend").read_bytes()
    bpy.data.objects["Cube"].location.x = 100  # out of sight, and not saved
    scene.frame_set(3)
    assert press("nim.render_scene") == {"FINISHED"}
    copies = jobs.job().work.passing
    assert copies.is_dir()
    job = followed()
    assert (job.problem, job.code) == ("", 0)
    assert job.files == [tmp_path / "renders" / f"shot.{suffix}" for suffix in ("exr", "png")]
    assert not copies.exists() and (tmp_path / "shot.blend").read_bytes() == before
    assert bpy.data.filepath == str(tmp_path / "shot.blend")
    empty = pixels(job.files[0])
    assert empty.shape == (9, 16, 3) and np.ptp(empty) < 1e-3

    scene.nim_render.keep = True
    scene.frame_start, scene.frame_end, scene.frame_step = 2, 4, 2
    cube = bpy.data.objects["Cube"]
    cube.keyframe_insert("location", frame=2)
    cube.location.x = 0
    cube.keyframe_insert("location", frame=4)
    assert press("nim.render_scene", animation=True) == {"FINISHED"}
    job = followed()
    folder = tmp_path / "renders"
    assert job.files[::2] == [folder / "shot_2_0002.exr", folder / "shot_2_0004.exr"]  # nothing is written over
    first, second = map(pixels, job.files[::2])
    assert np.ptp(first) < 1e-3 < np.ptp(second)
    assert read_metadata(job.files[0])["blend"]["file"] == str(folder / "shot_2.blend")
    assert render_scene.free_name(folder, "shot") == "shot_3"


def test_what_the_second_blender_says_of_the_scene_is_drawn(scene, press):
    bpy.data.objects["Cube"].driver_add("location", 0).driver.expression = "mine(frame)"
    scene.frame_start = scene.frame_end = 2
    assert press("nim.render_scene", animation=True) == {"FINISHED"}
    job = followed()
    assert (job.problem, job.code) == ("", 0)
    assert any("driver 'mine(frame)' of 'Cube' does not run here" in note for note in job.notes)
    drawn = Layout()
    jobs.draw(drawn, bpy.context, job)
    assert "does not run here" in " ".join(drawn.text.split())


def test_what_was_said_before_is_not_why_the_second_blender_ended(scene, press, one_sentence):
    """It is killed after a note, long before it has rendered."""
    bpy.data.objects["Cube"].driver_add("location", 0).driver.expression = "mine(frame)"
    scene.frame_start = scene.frame_end = 2
    scene.cycles.samples, scene.render.resolution_percentage = 4096, 100
    press("nim.render_scene", animation=True)
    job = jobs.job()
    deadline = time.monotonic() + 90
    while not (job.problem or job.notes):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    job.process.kill()
    followed()
    one_sentence(job.problem, "without a word", "exit code -9")
    assert any("does not run here" in note for note in job.notes)


def test_a_copy_finds_what_lies_beside_the_file_and_takes_the_place_of_none(scene, tmp_path):
    image = bpy.data.images.new("Grain", 4, 4)
    image.filepath_raw, image.file_format = "//grain.png", "PNG"
    image.save()
    image.source, image.use_fake_user = "FILE", True
    folder = tmp_path / "else" / "where"
    render_scene.save_copy(folder / "shot.blend")
    assert render_scene.free_name(folder, "shot") == "shot_2"
    with bpy.data.libraries.load(str(folder / "shot.blend"), link=True) as (_, wanted):
        wanted.images = ["Grain"]
    (linked,) = wanted.images
    found = Path(bpy.path.abspath(linked.filepath, library=linked.library))
    assert found.resolve() == (tmp_path / "grain.png").resolve()
    assert image.filepath == "//grain.png"


def test_frames_are_from_0_on_as_in_blender(scene):
    scene.frame_start, scene.frame_end, scene.frame_step = 0, 12000, 4000
    words = render_scene.work_of(scene, True)[0].words
    assert words[words.index("--frames") :][:4] == ("--frames", "0-12000", "--step", "4000")
    (folder := render_scene.place_of(scene)[0]).mkdir(exist_ok=True)
    (folder / "shot_12000.png").touch()
    assert render_scene.free_name(folder, "shot") == "shot_2"


def test_a_scene_and_a_file_may_be_called_as_options_are(scene, press, tmp_path):
    scene.name, scene.render.filepath = "-Night", "/tmp/"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "-x.blend"))
    preferences.settings().folder = str(tmp_path / "all")
    assert press("nim.render_scene") == {"FINISHED"}
    preferences.settings().folder = ""
    job = followed()
    assert (job.problem, job.files) == ("", [tmp_path / "all" / f"x.{suffix}" for suffix in ("exr", "png")])
    assert read_metadata(job.files[0])["blend"]["scene"] == "-Night"


def test_pictures_go_where_the_scene_says(scene, tmp_path):
    for path, folder, name in (
        ("//out/beauty_####.png", "out", "beauty"),
        ("//out/", "out", "shot"),
        ("//final", "", "final"),
        ("/tmp/", "renders", "shot"),
    ):
        scene.render.filepath = path
        assert render_scene.place_of(scene) == (tmp_path / folder, name)
    preferences.settings().folder = str(tmp_path / "all")
    assert render_scene.place_of(scene) == (tmp_path / "all", "shot")
    preferences.settings().folder = ""


def test_pictures_beside_a_file_that_is_not_saved_go_where_all_do(addon, tmp_path):
    preferences.settings().folder = str(tmp_path)
    assert not bpy.data.filepath
    for path, folder, name in (("//out/", "out", "untitled"), ("//final", "", "final")):
        bpy.context.scene.render.filepath = path
        assert render_scene.place_of(bpy.context.scene) == (tmp_path / folder, name)
    preferences.settings().folder = ""


def test_the_panel_says_where_they_go_as_a_person_finds_it(scene, tmp_path, monkeypatch):
    def said(path):
        scene.render.filepath = path
        layout = Layout()
        bpy.types.NIM_PT_render.draw(SimpleNamespace(layout=layout), SimpleNamespace(scene=scene))
        return layout.text

    monkeypatch.setenv("HOME", str(tmp_path.parent))
    monkeypatch.setenv("USERPROFILE", str(tmp_path.parent))
    assert said("/tmp/") == "//renders/shot" and said("//final") == "//final"
    elsewhere = tmp_path.parent / "elsewhere" / "shot"
    assert said(str(elsewhere)) == "~/elsewhere/shot"
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    assert said(str(elsewhere)) == str(elsewhere)


def test_what_cannot_be_rendered_is_said_by_the_button(scene, press):
    scene.camera = None
    with pytest.raises(RuntimeError, match="no camera"):
        press("nim.render_scene")


def test_cycles_renders_a_scene_that_is_set_to_another_engine(scene, press, tmp_path):
    pictures = []
    for engine in ("CYCLES", "BLENDER_WORKBENCH"):
        scene.render.engine = engine
        assert press("nim.render_scene") == {"FINISHED"}
        job = followed()
        assert (job.problem, job.code, scene.render.engine) == ("", 0, engine)
        pictures.append(pixels(job.files[0]))
    assert np.array_equal(*pictures)


def test_escape_is_heard_and_the_rest_passes():
    going, stopped = [True], []
    event = SimpleNamespace(type="A", value="PRESS")
    some = escape.Listening(lambda: going[0], lambda: stopped.append(1), passing={"MOUSEMOVE"})
    everything = escape.Listening(lambda: going[0], lambda: stopped.append(1))
    assert (some.hears(event), everything.hears(event)) == ({"RUNNING_MODAL"}, {"PASS_THROUGH"})
    assert some.hears(SimpleNamespace(type="MOUSEMOVE", value="NOTHING")) == {"PASS_THROUGH"} and not stopped
    assert some.hears(SimpleNamespace(type="ESC", value="PRESS")) == {"FINISHED"} and stopped == [1]
    going[0] = False
    assert some.hears(event) == {"FINISHED", "PASS_THROUGH"}
