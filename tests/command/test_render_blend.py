# SPDX-License-Identifier: GPL-3.0-or-later
"""`nimray render FILE.blend`: frames of a person's own scene, what the checks say before, and what is refused."""

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest

from nim_addon import caustics, command
from nim_addon.base.streams import quiet
from nim_addon.cycles import settings
from nim_addon.cycles.images import read_metadata
from nim_addon.cycles.material import interface_material
from nim_addon.cycles.nodes import empty_tree
from nim_addon.physics import Medium
from nim_addon.renders import request, session


@pytest.fixture
def scene(empty_file):
    """A NIM ball that moves over a ground, in a lamp, of 16 x 12 pixels."""
    scene = bpy.context.scene
    scene.name, scene.render.engine = "Mine", "CYCLES"
    settings.lossless(scene, "nodes")
    scene.cycles.samples, scene.render.resolution_x, scene.render.resolution_y = 2, 16, 12
    bpy.ops.mesh.primitive_plane_add(size=6)
    bpy.context.object.data.materials.append(bpy.data.materials.new("Ground"))
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=0.5, location=(-1, 0, 0.8))
    ball = bpy.context.object
    ball.data.materials.append(interface_material("NIM", Medium(-1.5), backend="nodes"))
    ball.keyframe_insert("location", frame=1)
    ball.location.x = 1
    ball.keyframe_insert("location", frame=3)
    bpy.ops.object.light_add(type="SUN")
    bpy.ops.object.camera_add(location=(0, 0, 6))
    scene.camera = bpy.context.object
    scene.frame_set(1)
    return scene


@pytest.fixture
def saved(scene, tmp_path, capsys):
    """saved() -> a .blend of what the scene is by then; Blender is empty again."""

    def save():
        file = tmp_path / "mine.blend"
        with quiet():
            bpy.ops.wm.save_as_mainfile(filepath=str(file), copy=True, compress=False)
            bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        capsys.readouterr()  # which Blender says some of later
        return str(file)

    return save


def pixels(file):
    return oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT)[..., :3]


def test_frames_of_a_blend_are_rendered_and_known_again(saved, tmp_path, capsys):
    words = ["render", saved(), "--frames", "1-3", "--step", "2", "--out", str(tmp_path), "--samples", "4"]
    assert command.main(words) == 0
    printed = capsys.readouterr()
    files = [tmp_path / f"mine_000{frame}.{suffix}" for frame in (1, 3) for suffix in ("exr", "png")]
    assert (printed.out.split(), printed.err) == (list(map(str, files)), "")
    made = read_metadata(files[2])
    assert (made["frame"], made["samples"], made["size"], made["blend"]["scene"]) == (3, 4, [16, 12], "Mine")
    pictures = [pixels(file) for file in files[::2]]
    assert np.abs(pictures[0] - pictures[1]).max() > 0.1
    assert command.main(words) == 0
    assert "mine_0003.exr is there already" in capsys.readouterr().err
    assert command.main(["render", "--again", str(files[2]), "--out", str(tmp_path), "--name", "again"]) == 0
    assert np.median(np.abs(pixels(tmp_path / "again.exr") - pictures[1])) < 1e-6

    # no frame: the one that the file was left at
    small = ["--size", "50%", "--name", "one", "--set", "NIM:Index Inside=-1.2", "--out", str(tmp_path)]
    assert command.main(["render", *words[1:2], *small]) == 0
    made = read_metadata(tmp_path / "one.exr")
    assert "frame" not in made and (made["size"], made["inputs"]) == ([8, 6], [["NIM:Index Inside", -1.2]])


def test_what_the_checks_find_is_said_before_and_refused_where_that_is_strict(scene, saved, tmp_path, capsys):
    scene.cycles.caustics_refractive = False
    image = bpy.data.images.new("Lost", 4, 4)
    image.source, image.filepath = "FILE", "//lost.png"
    empty_tree(bpy.data.materials["Ground"]).nodes.new("ShaderNodeTexImage").image = image
    words = ["render", saved(), "--out", str(tmp_path / "out")]
    assert command.main([*words, "--strict"]) == 1
    said = capsys.readouterr().err
    assert "lost.png is missing" in said and "(1 more); mend it, or leave --strict out." in said
    assert not (tmp_path / "out").exists()
    assert command.main([*words, "--frames", "1-2"]) == 0
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2 and all(line.startswith("nimray: frame 1: ") for line in lines)  # each thing once
    assert "lost.png is missing" in lines[0] and "caustics" in lines[1].lower()


def test_that_cycles_renders_in_the_place_of_another_engine_is_said(scene, saved, tmp_path, capsys):
    scene.render.engine = "BLENDER_WORKBENCH"
    words = ["render", saved(), "--out", str(tmp_path / "out")]
    assert command.main([*words, "--strict"]) == 1
    assert "Workbench is its engine; Cycles renders it" in capsys.readouterr().err
    assert command.main(words) == 0
    assert capsys.readouterr().err == (
        "nimray: Workbench is its engine; Cycles renders it, which alone bends a ray backwards.\n"
    )


def test_a_blend_keeps_its_noise_where_this_blender_cannot_clean_it_and_that_is_said(
    scene, saved, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr(request, "can_denoise", lambda: False)
    monkeypatch.setattr(session, "can_denoise", lambda: False)
    scene.cycles.use_denoising = True
    words = ["render", saved(), "--out", str(tmp_path / "out")]
    says = "it is denoised, and this Blender was built without OpenImageDenoise"
    assert command.main([*words, "--strict"]) == 1
    assert says in capsys.readouterr().err
    assert command.main([*words, "--denoise"]) == 1
    assert "leave --denoise out" in capsys.readouterr().err and not (tmp_path / "out").exists()
    assert command.main(words) == 0
    assert capsys.readouterr().err == f"nimray: {says}; the picture keeps its noise.\n"
    assert read_metadata(tmp_path / "out" / "mine.exr")["denoise"] is False
    assert command.main([*words, "--no-denoise", "--strict"]) == 0
    with pytest.raises(RuntimeError, match="'Mine' is denoised, and this Blender was built without OpenImageDenoise"):
        request.Request.of_blend(words[1]).render(tmp_path / "new")


def test_caustics_of_another_frame_are_traced_anew(scene, saved, tmp_path, capsys):
    caustics.bake(scene, photons=20000, texels=64)
    caustics.baked(scene)[caustics.REPORT] = {"photons": 20000.0, "settings": []}
    words = ["render", saved(), "--frames", "1-2", "--out", str(tmp_path)]
    assert command.main(words) == 0
    assert "frame 2: the caustics in the file are of another state" in capsys.readouterr().err
    first, second = (read_metadata(tmp_path / f"mine_000{frame}.exr") for frame in (1, 2))
    assert "caustics" not in first and (second["caustics"], second["photons"]) == ("traced", 20000)
    assert command.main([*words, "--caustics", "path"]) == 0
    assert "traced anew" not in capsys.readouterr().err
    assert read_metadata(tmp_path / "mine_0002.exr")["caustics"] == "path"


BAD = [
    (("--frames", "3-1"), 2, "runs backwards"),
    (("--scene", "Mien"), 2, "did you mean 'Mine'?"),
    (("--set", "n=1"), 2, "set inputs, 'MATERIAL:INPUT=NUMBER'"),
    (("--set", "NIM:Index Inside=-1", "NIM:Index Inside=-2"), 2, "NIM:Index Inside is set twice; set it once"),
    (("--set", "NIM:Index=1"), 2, "there is no input of NIM 'Index'"),
    (("--fps", "24", "--frames", "1-2"), 2, "has its own frames"),
    (("--step", "2"), 2, "--step goes with --frames"),
    (("--backend", "osl"), 2, "its own parameters and backend"),
    (("--out", "mine.blend/below"), 1, "cannot write into"),
]


@pytest.mark.parametrize("more, code, says", BAD)
def test_what_makes_no_sense_is_refused(saved, tmp_path, capsys, monkeypatch, more, code, says):
    monkeypatch.chdir(tmp_path)
    saved()
    assert command.main(["render", "mine.blend", *more]) == code
    assert says in capsys.readouterr().err
    assert [file.name for file in tmp_path.iterdir()] == ["mine.blend"]


def test_what_no_scene_of_a_blend_can_give_is_refused(scene, saved, tmp_path, capsys):
    scene.camera = None
    file = saved()
    assert command.main(["render", file, "--caustics", "traced", "--out", str(tmp_path / "out")]) == 1
    assert "has no camera" in capsys.readouterr().err
    (tmp_path / "later.blend").write_bytes(b"BLENDER17-01v9901" + bytes(100))
    assert command.main(["render", str(tmp_path / "later.blend")]) == 2
    assert "was saved by Blender 99.1" in capsys.readouterr().err
    later = (tmp_path / "mine.blend").read_bytes()
    place = 15 if later.startswith(b"BLENDER17") else 10
    (tmp_path / "mine.blend").write_bytes(later[:place] + b"99" + later[place + 2 :])  # of the minor version
    assert command.main(["render", file, "--strict"]) == 1
    assert ".99, and this is older; what is new there is lost" in capsys.readouterr().err
    assert command.main(["render", "sphere", "--strict"]) == 2
    assert "--strict is of a .blend" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_material_is_set_by_its_own_name_wherever_it_is_worn_and_instead_of_its_keyframes(scene, saved, tmp_path):
    first = bpy.data.materials["NIM"]
    second = first.copy()
    assert second.name == "NIM.001"
    ball = bpy.data.objects["Icosphere"]
    (node,) = (node for node in second.node_tree.nodes if node.type == "GROUP")
    node.inputs["Index Inside"].default_value = -3
    node.inputs["Index Inside"].keyframe_insert("default_value", frame=1)
    ball.data.materials[0] = second
    # worn only by what a collection puts in
    within = bpy.data.collections.new("Within")
    within.objects.link(ball)
    scene.collection.objects.unlink(ball)
    holder = bpy.data.objects.new("Holder", None)
    holder.instance_type, holder.instance_collection = "COLLECTION", within
    scene.collection.objects.link(holder)
    bpy.ops.mesh.primitive_cube_add(size=0.1, location=(0, 0, -9))
    bpy.context.object.data.materials.append(first)
    words = ["render", saved(), "--out", str(tmp_path), "--frames", "1", "--samples", "8"]
    for number in ("-3", "-1"):
        assert command.main([*words, "--name", f"n{number}", "--set", f"NIM.001:Index Inside={number}"]) == 0
    assert command.main([*words, "--name", "other", "--set", "NIM:Index Inside=-1"]) == 0
    own, other, set_ = (pixels(tmp_path / f"{name}_0001.exr") for name in ("n-3", "other", "n-1"))
    assert np.array_equal(own, other)
    assert np.abs(own - set_).max() > 0.1


def test_a_camera_that_is_none_is_named(scene, saved, tmp_path, capsys):
    scene.camera = bpy.data.objects.new("Lost", None)
    scene.collection.objects.link(scene.camera)
    assert command.main(["render", saved(), "--out", str(tmp_path / "out")]) == 1
    assert "looks through 'Lost', which is no camera" in capsys.readouterr().err


def test_layers_that_are_all_off_are_named(scene, saved, tmp_path, capsys):
    for layer in scene.view_layers:
        layer.use = False
    assert command.main(["render", saved(), "--out", str(tmp_path / "out")]) == 1
    assert "has no view layer that is used" in capsys.readouterr().err


def test_a_backup_is_a_blend_too(saved, tmp_path):
    backup = f"{saved()}1"
    (tmp_path / "mine.blend").rename(backup)
    assert command.main(["render", backup, "--out", str(tmp_path)]) == 0
    assert (tmp_path / "mine.exr").is_file()


def test_checks_come_before_one_render_a_wavelength_too(scene, saved, tmp_path, capsys):
    scene.cycles.caustics_refractive = False
    words = ["render", saved(), "--wavelengths", "500:600:100", "--out", str(tmp_path / "out")]
    assert command.main([*words, "--strict"]) == 1
    assert "leave --strict out" in capsys.readouterr().err and not (tmp_path / "out").exists()
    assert command.main(words) == 0
    assert "caustics" in capsys.readouterr().err.lower()


def test_a_driver_that_does_not_run_here_is_named(scene, saved, tmp_path, capsys, one_sentence):
    """Blender runs no Python of a file's but what is simple; where it stands stays as it was saved."""
    ball = next(one for one in scene.objects if one.name.startswith("Ico"))
    for axis, expression in enumerate(("frame * 0.1", "mine(frame)")):
        ball.driver_add("location", axis + 1).driver.expression = expression
    file = saved()
    assert command.main(["render", file, "--frames", "3", "--out", str(tmp_path / "out")]) == 0
    said = [line for line in capsys.readouterr().err.splitlines() if "driver" in line.lower()]
    assert len(said) == 1
    one_sentence(ValueError(said[0].removeprefix("nimray: ")), "frame 3", "'mine(frame)' of 'Icosphere'", "keyframes")
    assert command.main(["render", file, "--frames", "2", "--strict", "--out", str(tmp_path / "out")]) == 1
    assert "mine(frame)" in capsys.readouterr().err
