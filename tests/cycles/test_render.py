# SPDX-License-Identifier: GPL-3.0-or-later
"""The headless render: whole files or none, with what made them."""

import shutil

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest

from nim_addon.cycles import render
from nim_addon.scenes import scene_type


@pytest.fixture
def scene():
    kind = scene_type("sphere")
    scene = kind.build(kind.parameters())
    scene.render.resolution_x, scene.render.resolution_y = 48, 32
    scene.cycles.samples = 4
    return scene


def test_writes_linear_exr_and_display_png_with_metadata(scene, tmp_path):
    seen = []
    made = {"scene": "sphere", "parameters": {"n": -1.5}}
    exr, png = render.render(scene, tmp_path / "new", "one", metadata=made, progress=lambda *step: seen.append(step))
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == ["one.exr", "one.png"]
    linear = oiio.ImageBuf(str(exr))
    assert (linear.spec().width, linear.spec().height, linear.nchannels) == (48, 32, 3)
    assert linear.spec().format == oiio.FLOAT
    assert oiio.ImageBuf(str(png)).spec().format == oiio.UINT8
    assert render.read_metadata(exr) == render.read_metadata(png) == made
    # linear: the sun's glow is far above what a screen shows
    pixels = linear.get_pixels(oiio.FLOAT)
    assert np.isfinite(pixels).all()
    assert pixels.max() > 1.5
    assert seen[-1][:2] == (4, 4)
    assert not bpy.app.handlers.render_stats


def test_blend_is_saved_on_request(scene, tmp_path):
    render.render(scene, tmp_path, "one", blend=True)
    assert (tmp_path / "one.blend").stat().st_size > 1000


def test_a_folder_that_cannot_be_written_is_refused(scene, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match=r"cannot write into .*file/below.*name another folder"):
        render.render(scene, tmp_path / "file" / "below", "one")


def test_a_full_disk_is_named(tmp_path, monkeypatch, one_sentence):
    picture = oiio.ImageBuf(oiio.ImageSpec(4, 4, 3, oiio.FLOAT))
    usage = shutil.disk_usage(tmp_path)
    for free, words in (
        (0, f"cannot write into {tmp_path}: No space left on device"),
        (1 << 30, "cannot write x.none"),
    ):
        monkeypatch.setattr(shutil, "disk_usage", lambda folder, free=free: usage._replace(free=free))
        with pytest.raises(OSError) as raised, render.files_to(tmp_path, "one") as (part, _):
            render.write_with_metadata(picture, part / "x.none", {})
        assert words in str(raised.value) and not list(tmp_path.iterdir())
        if not free:
            one_sentence(raised.value, "name another folder")


def test_a_failed_render_leaves_nothing_and_says_so(scene, tmp_path):
    bpy.data.objects.remove(scene.camera)
    with pytest.raises(RuntimeError, match=r"(?i)camera"):
        render.render(scene, tmp_path, "one")
    assert not list(tmp_path.iterdir())


def test_files_that_are_not_ours_are_refused(scene, tmp_path):
    exr, _ = render.render(scene, tmp_path, "one")
    whole = exr.read_bytes()
    exr.write_bytes(whole[: len(whole) * 2 // 3])
    with pytest.raises(ValueError, match="not a whole image"):
        render.read_metadata(exr)
    (tmp_path / "text.exr").write_text("not an image")
    with pytest.raises(ValueError, match="not a whole image"):
        render.read_metadata(tmp_path / "text.exr")
    alien = oiio.ImageBuf(oiio.ImageSpec(4, 4, 3, oiio.FLOAT))
    for record in (None, "{", "[]"):
        if record:
            alien.specmod().attribute(render.ATTRIBUTE, record)
        alien.write(str(tmp_path / "alien.exr"))
        with pytest.raises(ValueError, match="not made by nimray"):
            render.read_metadata(tmp_path / "alien.exr")
    with pytest.raises(FileNotFoundError):
        render.read_metadata(tmp_path / "none.exr")


def test_what_is_no_whole_image_is_refused_without_a_word_of_the_library(scene, tmp_path, capfd):
    files = render.render(scene, tmp_path, "one")
    for file in files:
        file.write_bytes(file.read_bytes()[:-200])
    files = [*files, tmp_path / "notes.png", tmp_path / "notes.exr"]
    for file in files[2:]:
        file.write_text("notes")
    capfd.readouterr()
    for file in files:
        with pytest.raises(ValueError, match="not a whole image"):
            render.read_metadata(file)
    assert render.record_of(files[0]) is None
    assert capfd.readouterr() == ("", "")
