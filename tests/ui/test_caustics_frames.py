# SPDX-License-Identifier: GPL-3.0-or-later
"""Caustics of an animation: each frame has its own, in renders too, and none where the scene is another."""

import shutil
import threading
import time
from types import SimpleNamespace

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest

from nim_addon import caustics as engine
from nim_addon import command
from nim_addon.base.streams import quiet
from nim_addon.caustics import baking, frames
from nim_addon.cycles.images import read_metadata
from nim_addon.cycles.material import interface_material
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.physics import Medium
from nim_addon.renders.request import Request, Session
from nim_addon.ui import caustics_bake, caustics_frames, caustics_looks, render_scene


@pytest.fixture
def scene(addon, monkeypatch, tmp_path):
    """A ball of NIM that moves over a floor in the sun, saved; a million photons are twenty thousand."""
    monkeypatch.setattr(caustics_frames, "MILLION", 20_000)
    monkeypatch.setattr(caustics_bake, "ROUND", 5_000)
    monkeypatch.setattr(baking, "TRIAL_PHOTONS", 1 << 14)
    scene = bpy.context.scene
    ball = bpy.data.objects["Cube"]
    ball.name = "Ball"
    ball.data.materials[0] = interface_material("NIM", Medium(-1.5), backend="nodes")
    bpy.ops.mesh.primitive_plane_add(size=12, location=(0, 0, -2))
    floor = bpy.data.materials.new("Floor")
    nodes = Nodes(empty_tree(floor))
    nodes.end(nodes.add("ShaderNodeBsdfDiffuse"))
    bpy.context.object.data.materials.append(floor)
    lamp = bpy.data.objects["Light"]
    lamp.data.type, lamp.data.energy, lamp.rotation_euler = "SUN", 3.0, (0.3, 0, 0)
    for frame, x in ((1, -2.0), (3, 2.0)):
        ball.location.x = x
        ball.keyframe_insert("location", frame=frame)
    scene.frame_start, scene.frame_end = 1, 3
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 32, False
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 16, 12, 100
    scene.nim_caustics.photons, scene.nim_caustics.texels = 1, "512"
    scene.frame_set(2)
    with quiet():
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "mine.blend"))
    return bpy.context.scene


def shown(scene):
    """The frame whose caustics a scene has, None where it has none."""
    collection = engine.baked(scene)
    return collection and collection[frames.FRAME]


def kept_in(tmp_path):
    return sorted((tmp_path / "mine_caustics" / "Scene").iterdir())


def blocks(file):
    """The means of a picture's blocks of 4 x 4 pixels."""
    picture = oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT)[..., :3]
    return picture.reshape(3, 4, 4, 4, 3).mean(axis=(1, 3))


def test_each_frame_has_its_own_and_is_traced_once(scene, tmp_path):
    assert bpy.ops.nim.bake_caustics_frames() == {"FINISHED"}
    files = kept_in(tmp_path)
    assert [file.name for file in files] == ["0001.npz", "0002.npz", "0003.npz"]
    assert (scene.frame_current, shown(scene)) == (2, 2) and not engine.out_of_date(scene)
    for frame in (1, 3, 4, 2):
        scene.frame_set(frame)
        assert shown(scene) == (frame if frame < 4 else None)
        assert bpy.data.objects["Plane"].hide_render == (frame < 4)
        assert not engine.out_of_date(scene)
    before = [file.stat().st_mtime_ns for file in files]
    files[1].unlink()
    bpy.ops.nim.bake_caustics_frames()
    after = [file.stat().st_mtime_ns for file in files]
    assert after[0] == before[0] and after[2] == before[2] and after[1] > before[1]

    # what is kept of another scene is not put in, and a bake finds that out
    bpy.data.objects["Light"].rotation_euler.x = 0.1
    scene.frame_set(1)
    assert shown(scene) is None and caustics_looks.LOOKS.last(scene) is None
    caustics_looks.LOOKS.renew(scene.session_uid)
    assert caustics_looks.LOOKS.last(scene).kept == (3, 3)
    bpy.ops.nim.bake_caustics_frames()
    assert shown(scene) == 1 and kept_in(tmp_path)[2].stat().st_mtime_ns > after[2]
    bpy.ops.nim.clear_caustics()
    scene.frame_set(3)
    assert shown(scene) is None and len(kept_in(tmp_path)) == 3


def test_an_animation_is_rendered_with_them(scene, tmp_path):
    """By Blender itself, from the saved file: as a render of the same frame with caustics traced for it alone."""
    bpy.ops.nim.bake_caustics_frames()
    with quiet():
        bpy.ops.wm.save_mainfile()
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "mine.blend"))
        scene = bpy.context.scene
        seen = []
        bpy.app.handlers.render_write.append(lambda scene, *_: seen.append(shown(scene)))
        scene.render.image_settings.file_format = "OPEN_EXR"
        scene.render.filepath = str(tmp_path / "a_")
        bpy.ops.render.render(animation=True)
    assert seen == [1, 2, 3]
    first, last = blocks(tmp_path / "a_0001.exr"), blocks(tmp_path / "a_0003.exr")
    assert np.abs(first - last).mean() > 0.05
    with quiet():
        scene.frame_set(3)
        frames.forget_frames(scene)
        engine.bake(scene, photons=20_000, texels=512, most=5_000)
        scene.render.filepath = str(tmp_path / "alone.exr")
        bpy.ops.render.render(write_still=True)
    assert np.abs(blocks(tmp_path / "alone.exr") - last).max() < 1e-3


def test_the_command_renders_those_that_are_kept_and_traces_the_others(scene, tmp_path, capsys):
    """From a copy of the file, as Blender takes nothing out of the open one, in which objects get other names."""
    scene.frame_start = 0
    bpy.ops.nim.bake_caustics_frames()
    (tmp_path / "elsewhere").mkdir()
    with quiet():
        bpy.ops.wm.save_mainfile()
    copy = tmp_path / "elsewhere" / "mine.blend"
    render_scene.save_copy(copy)
    assert frames.frames_of(scene).folder == "//mine_caustics/Scene"
    mark = [kept_in(tmp_path)[3].stat().st_mtime_ns, bpy.data.filepath]

    def rendered(*words, at=copy):
        command.main(["render", str(at), "--frames", "3", "--out", str(tmp_path), "--name", "mine", *words])
        made = read_metadata(tmp_path / "mine_0003.exr")
        return blocks(tmp_path / "mine_0003.exr"), made.get("caustics"), made.get("photons"), capsys.readouterr().err

    kept, *of_it, said = rendered()
    assert of_it == [None, None] and f"frame 3: its caustics are those that are kept in {tmp_path}" in said
    dark, *_ = rendered("--caustics", "path")
    bright = np.abs(kept - dark).max()
    assert bright > 0.05
    assert mark == [kept_in(tmp_path)[3].stat().st_mtime_ns, bpy.data.filepath]

    # nothing is kept beside a copy that a person made, and what is traced there stays until it is rendered
    traced, *of_it, said = rendered(at=shutil.copy(tmp_path / "mine.blend", tmp_path / "elsewhere" / "other.blend"))
    assert of_it == ["traced", 20_000] and "frame 3: in " in said and "they are traced anew" in said
    assert np.abs(traced - kept).max() < 0.3 * bright
    # nor is what is kept of the scene as it was
    with Session(Request.of_blend(copy, frame=3, inputs=(("NIM:Index Inside", -1.3),))) as session:
        assert session.request.caustics == "traced"
    for frame in (0, 1):
        with Session(Request.of_blend(copy, frame=frame)) as session:
            assert session.request.caustics is None


def test_stopped_it_goes_on_from_there(scene, tmp_path):
    said = []
    press = caustics_bake.Press(lambda _, text: said.append(text), caustics_frames.FramesRun)
    while not (tmp_path / "mine_caustics" / "Scene" / "0001.npz").exists() or press.run.bake is None:
        assert press.tick(scene) == set()
    for _ in range(2):
        press.tick(scene)
    run = press.run
    assert run.text().startswith("Frame 2, ") and 1 / 3 < run.part < 2 / 3
    rounds = run.bake.done
    assert rounds > 0
    press.ask_to_stop()
    assert press.asked_to_stop and press.stop() == {"FINISHED"}
    assert "Stopped in frame 2" in said[-1] and scene.frame_current == 2
    assert shown(scene) is None  # of half a frame
    again = caustics_frames.FramesRun(scene)
    while again.numbers[again.index] == 1:
        again.step()
    assert again.bake.done == rounds
    again.close()


def test_a_frame_without_light_has_none_and_an_unsaved_file_is_refused(scene, tmp_path, capsys):
    ball = bpy.data.objects["Ball"]
    ball.hide_render = True
    ball.keyframe_insert("hide_render", frame=2)
    ball.hide_render = False
    ball.keyframe_insert("hide_render", frame=3)
    scene.frame_start = 2
    bpy.ops.nim.bake_caustics_frames()
    assert [file.name for file in kept_in(tmp_path)] == ["0003.npz"]
    copy = tmp_path / "copy.blend"
    render_scene.save_copy(copy)
    command.main(["render", str(copy), "--frames", "2-3", "--out", str(tmp_path), "--name", "mine", "--samples", "1"])
    assert "frame 2: no light can be traced in it, and it has no caustics." in (said := capsys.readouterr().err)
    assert "frame 3: its caustics are those that are kept in" in said
    assert shown(scene) is None
    with quiet():
        bpy.ops.wm.read_homefile(use_factory_startup=True)
    with pytest.raises(RuntimeError, match="Save the file first"):
        bpy.ops.nim.bake_caustics_frames()


def test_a_render_beside_a_window_waits_for_the_main_thread(scene, monkeypatch):
    """Its handlers are called in a thread of its own, which must not touch data."""
    acted, timers = [], []
    monkeypatch.setattr(
        caustics_frames, "bpy", SimpleNamespace(app=SimpleNamespace(timers=SimpleNamespace(register=timers.append)))
    )
    act = caustics_frames.in_the_main_thread
    act(lambda: acted.append(threading.current_thread()))
    thread = threading.Thread(target=act, args=(lambda: acted.append(threading.current_thread()),))
    thread.start()
    while thread.is_alive() and not timers:
        time.sleep(0.001)
    assert thread.is_alive() and len(acted) == 1
    timers[0]()
    thread.join(5)
    assert not thread.is_alive() and acted == [threading.main_thread()] * 2


@pytest.mark.parametrize("kept", [5, {"folder": "//x"}, {"folder": "//x", "photons": 1, "texels": 64, "later": 1}])
def test_what_is_no_memory_of_frames_is_passed_over(scene, kept):
    scene[frames.KEPT] = kept
    assert frames.frames_of(scene) is None and frames.kept(scene, [1]) is None and frames.wanted(scene) is None
    scene[frames.KEPT] = {"folder": "//x", "photons": 1, "texels": 64}
    assert frames.frames_of(scene) == frames.Frames("//x", 1, 64)
