# SPDX-License-Identifier: GPL-3.0-or-later
"""The headless render: whole files or none, with what made them."""

import random
import resource
import shutil
import struct
import sys
import zlib

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest

from nim_addon.base.files import files_to
from nim_addon.cycles import images, render
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
    assert images.read_metadata(exr) == images.read_metadata(png) == made
    # linear: the sun's glow is far above what a screen shows
    pixels = linear.get_pixels(oiio.FLOAT)
    assert np.isfinite(pixels).all()
    assert pixels.max() > 1.5
    assert seen[-1][:2] == (4, 4)
    assert not bpy.app.handlers.render_stats


def test_pixels_that_lie_apart_in_memory_are_written_too(tmp_path):
    # such as channels out of the layers of an EXR; OpenImageIO says nothing, and writes black
    apart = np.random.default_rng(0).random((4, 5, 7))[..., [5, 1, 3]]
    apart = np.moveaxis(np.moveaxis(apart, -1, 0).copy(), 0, -1)
    assert not apart.flags.c_contiguous
    render.write_linear(tmp_path / "apart.exr", apart)
    np.testing.assert_allclose(oiio.ImageBuf(str(tmp_path / "apart.exr")).get_pixels(oiio.FLOAT), apart, rtol=1e-6)


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
        (1 << 30, "cannot write the .none file whole"),
    ):
        monkeypatch.setattr(shutil, "disk_usage", lambda folder, free=free: usage._replace(free=free))
        with pytest.raises(OSError) as raised, files_to(tmp_path, "one") as (part, _):
            images.write_with_metadata(picture, part / "x.none", {})
        assert words in str(raised.value) and not list(tmp_path.iterdir())
        if not free:
            one_sentence(raised.value, "name another folder")


def test_a_failed_render_leaves_nothing_and_says_so(scene, tmp_path, one_sentence, monkeypatch):
    scene.render.use_multiview = True
    with pytest.raises(RuntimeError) as raised:
        render.render(scene, tmp_path, "one")
    one_sentence(raised.value, f"{scene.name!r} renders two pictures", "Stereoscopy")
    scene.render.use_multiview = False
    bpy.data.objects.remove(scene.camera)
    with pytest.raises(RuntimeError) as raised:
        render.render(scene, tmp_path, "one")
    one_sentence(raised.value, f"{scene.name!r} has no camera", "add one")
    monkeypatch.setattr(render, "check_scene", lambda _: None)
    with pytest.raises(RuntimeError) as raised:
        render.render(scene, tmp_path, "one")
    one_sentence(raised.value, "Blender did not render", "no camera")
    assert not list(tmp_path.iterdir())


@pytest.fixture
def cramped():
    """cramped(size): no file takes more bytes from then on; OpenImageIO says True of a PNG all the same."""
    resource = pytest.importorskip("resource")
    former = resource.getrlimit(resource.RLIMIT_FSIZE)
    yield lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, former[1]))
    resource.setrlimit(resource.RLIMIT_FSIZE, former)


def picture(form=oiio.UINT8, size=64):
    image = oiio.ImageBuf(oiio.ImageSpec(size, size, 3, form))
    image.set_pixels(image.roi, np.random.default_rng(0).random((size, size, 3), np.float32))
    return image


@pytest.mark.parametrize("size", (0, 50, 5000))
@pytest.mark.parametrize("suffix, form", ((".png", oiio.UINT8), (".exr", oiio.FLOAT)))
def test_an_image_that_is_cut_off_replaces_none(suffix, form, size, tmp_path, cramped, one_sentence):
    kept = tmp_path / f"one{suffix}"
    images.write_with_metadata(picture(form), kept, {"made": 1})
    before = kept.read_bytes()
    with pytest.raises(OSError) as raised, files_to(tmp_path, "one") as (part, finish):
        cramped(size)
        images.write_with_metadata(picture(form), part / f"new{suffix}", {"made": 2})
        finish(part / f"new{suffix}")
    cramped(1 << 40)
    one_sentence(raised.value, "cannot write")
    assert kept.read_bytes() == before and list(tmp_path.iterdir()) == [kept]


@pytest.mark.parametrize("size", (3000, 9000))
def test_a_render_onto_a_full_disk_keeps_the_old_pair(size, scene, tmp_path, cramped, one_sentence):
    files = render.render(scene, tmp_path, "one", metadata={"made": 1}, blend=True)
    before = [file.read_bytes() for file in files]
    cramped(size)
    with pytest.raises((OSError, RuntimeError)) as raised:
        render.render(scene, tmp_path, "one", metadata={"made": 2}, blend=True)
    cramped(1 << 40)
    one_sentence(raised.value)
    assert [file.read_bytes() for file in files] == before
    assert sorted(file.name for file in tmp_path.iterdir()) == ["one.blend", "one.exr", "one.png"]


def test_where_one_file_cannot_have_its_name_none_is_replaced(scene, tmp_path, one_sentence):
    (tmp_path / "one.exr").write_text("old")
    for suffix, blend in ((".png", False), (".blend", True)):
        (tmp_path / f"one{suffix}").mkdir()
        seen = []
        with pytest.raises(OSError) as raised:
            render.render(scene, tmp_path, "one", blend=blend, progress=lambda *step, seen=seen: seen.append(step))
        one_sentence(raised.value, f"one{suffix} is a folder")
        assert not seen and (tmp_path / "one.exr").read_text() == "old"
        (tmp_path / f"one{suffix}").rmdir()


def nested(depth):
    made = {}
    for _ in range(depth):
        made = {"a": made}
    return made


@pytest.mark.parametrize(
    ("metadata", "words"),
    (
        ({"a": object()}, "JSON"),
        ({("a", 1): 1}, "JSON"),
        ({"a": b"bytes"}, "JSON"),
        (["a"], "dict"),
        ("text", "dict"),
        ({"a": "x" * 9_000_000}, ".png can carry"),
        (nested(100_000), "nested too deep"),
    ),
    ids=("object", "key", "bytes", "list", "text", "large", "deep"),
)
def test_metadata_that_cannot_be_written_is_refused_before_the_render(metadata, words, scene, tmp_path, one_sentence):
    seen = []
    with pytest.raises(ValueError) as raised:
        render.render(scene, tmp_path, "one", metadata=metadata, progress=lambda *step: seen.append(step))
    one_sentence(raised.value, "metadata", words)
    assert not seen and not list(tmp_path.iterdir())


def test_any_text_is_carried(scene, tmp_path):
    made = {
        "nimray": "\ud800\n" * 50,
        "text": "日本 é \0 \x1b[31m \udcff \u202e",
        "none": None,
        "list": [1, 2.5, float("inf")],
    }
    for file in render.render(scene, tmp_path, "one", metadata=made):
        assert images.read_metadata(file) == made


@pytest.mark.parametrize("name", ("", ".", "..", "a/b", "a\nb", "\x1b"))
def test_a_name_that_no_file_can_have_is_refused(name, scene, tmp_path, one_sentence):
    with pytest.raises(ValueError) as raised:
        render.render(scene, tmp_path, name)
    one_sentence(raised.value, "cannot name a file")
    assert not list(tmp_path.iterdir())


def test_files_that_are_not_ours_are_refused(scene, tmp_path):
    exr, _ = render.render(scene, tmp_path, "one")
    whole = exr.read_bytes()
    exr.write_bytes(whole[: len(whole) * 2 // 3])
    with pytest.raises(ValueError, match="not a whole image"):
        images.read_metadata(exr)
    (tmp_path / "text.exr").write_text("not an image")
    with pytest.raises(ValueError, match="not a whole image"):
        images.read_metadata(tmp_path / "text.exr")
    alien = oiio.ImageBuf(oiio.ImageSpec(4, 4, 3, oiio.FLOAT))
    for record in (None, "{", "[]"):
        if record:
            alien.specmod().attribute(images.RECORD_ATTRIBUTE, record)
        alien.write(str(tmp_path / "alien.exr"))
        with pytest.raises(ValueError, match="not made by nimray"):
            images.read_metadata(tmp_path / "alien.exr")
    with pytest.raises(FileNotFoundError):
        images.read_metadata(tmp_path / "none.exr")


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
            images.read_metadata(file)
    assert images.record_of(files[0]) is None
    assert capfd.readouterr() == ("", "")


def test_an_image_that_claims_to_be_huge_takes_no_memory(scene, tmp_path):
    """Of 60,000 pixels a side in 40 kB, as a bomb of zeros is: it was unpacked at once, into 10 GB."""

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    side = 60000
    packer = zlib.compressobj(9)
    rows = b"".join(packer.compress(bytes(1 + 3 * side)) for _ in range(200)) + packer.flush()
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0))
    text = chunk(b"tEXt", f"{images.RECORD_ATTRIBUTE}\0{{}}".encode())
    file = tmp_path / "bomb.png"
    file.write_bytes(b"\x89PNG\r\n\x1a\n" + head + text + chunk(b"IDAT", rows) + chunk(b"IEND", b""))
    assert file.stat().st_size < 100_000
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(ValueError, match="not a whole image"):
        images.read_metadata(file)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 1 << 20  # kB


@pytest.mark.skipif(sys.platform != "linux", reason="where names of files are bytes")
def test_a_folder_whose_name_is_no_text_is_refused(scene, tmp_path, one_sentence):
    with pytest.raises(OSError) as caught:
        render.render(scene, tmp_path / "\udcff", "one")
    one_sentence(caught.value, "not Unicode")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", (".exr", ".png"))
def test_whatever_an_image_holds_a_record_comes_out_or_a_sentence(suffix, scene, tmp_path, one_sentence):
    """Among them a record that is no UTF-8."""
    files = render.render(scene, tmp_path, "one", metadata={"a": "x" * 100})
    whole = next(file for file in files if file.suffix == suffix).read_bytes()
    chance, file, outcomes = random.Random(suffix), tmp_path / f"changed{suffix}", set()
    at = whole.index(b"x" * 100)
    for change in [b"\xff\xc3\x81", *(chance.randbytes(chance.randint(1, 5)) for _ in range(200))]:
        content = bytearray(whole)
        content[at : at + len(change)] = change
        if chance.random() < 0.3:
            del content[at + 100 :]
        file.write_bytes(content)
        try:
            assert isinstance(images.read_metadata(file), dict)
            outcomes.add("read")
        except ValueError as error:
            one_sentence(error, file.name)
            outcomes.add("refused")
        at = chance.randrange(len(whole) if chance.random() < 0.5 else 1500)
    assert outcomes == {"read", "refused"}


@pytest.mark.parametrize(
    "form", [("PNG", "RGBA", "16"), ("JPEG", "BW", "8"), ("OPEN_EXR_MULTILAYER", "RGBA", "16"), ("FFMPEG", "RGB", "8")]
)
def test_a_render_leaves_how_the_scene_is_saved_as_it_was(form, scene, tmp_path):
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        kinds = {"FFMPEG": "VIDEO", "OPEN_EXR_MULTILAYER": "MULTI_LAYER_IMAGE"}
        settings.media_type = kinds.get(form[0], "IMAGE")
    settings.file_format, settings.color_mode, settings.color_depth = form
    scene.render.filepath = "//mine"
    former = [getattr(settings, name) for name in ("file_format", "color_mode", "color_depth")]
    assert former == list(form)
    scene.cycles.use_denoising = scene.view_layers[0].cycles.denoising_store_passes = True
    render.render(scene, tmp_path, "one")
    assert render.pixels_of(scene).shape == (32, 48, 3)
    assert [getattr(settings, name) for name in ("file_format", "color_mode", "color_depth")] == former
    assert scene.render.filepath == "//mine"
