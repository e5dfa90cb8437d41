# SPDX-License-Identifier: GPL-3.0-or-later
"""`nimray render` and `compare`: what they write, record and repeat, and what they lack."""

import json

import numpy as np
import OpenImageIO as oiio
import pytest

from nim_addon import command
from nim_addon.command import blender
from nim_addon.cycles.closures import backends
from nim_addon.cycles.images import image_of, read_metadata
from nim_addon.renders import session
from nim_addon.renders.montage import montage

SMALL = ("--size", "32x24", "--samples", "4")


def pixels(path):
    return oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT)


def test_render_info_again(nimray, tmp_path):
    done = nimray("render", "sphere", "--set", "n=-1.33", "companions=yes", "--seed", 7, *SMALL, where=tmp_path)
    assert done.returncode == 0, done.stderr
    first = tmp_path / "renders" / "sphere_n--1.33_companions-yes.exr"
    assert done.stdout.split() == [
        str(first.relative_to(tmp_path)),
        str(first.with_suffix(".png").relative_to(tmp_path)),
    ]
    assert done.stderr == ""  # piped: no progress, and nothing of Blender's own

    info = json.loads(nimray("info", first, "--json").stdout)
    assert info["scene"] == "sphere"
    assert info["parameters"] == {"n": -1.33, "mu": -1.0, "roughness": 0.0, "companions": True, "sun_angle": 16.0}
    assert (info["size"], info["samples"], info["seed"], info["denoise"]) == ([32, 24], 4, 7, False)

    again = nimray("render", "--again", first, "--out", tmp_path / "b", "--quiet")
    assert (again.returncode, again.stdout, again.stderr) == (0, "", "")
    second = tmp_path / "b" / f"{first.stem}_again.exr"
    # the same paths, but for float rounding in the order of sums
    assert np.median(np.abs(pixels(first) - pixels(second))) < 1e-6
    assert json.loads(nimray("info", second, "--json").stdout) == info


def test_caustics_traced_from_the_sun(nimray, tmp_path):
    """Under water a sun of half a degree gives nothing by chance: traced, its light is on the walls, and recorded."""
    setting = ("--set", "sky=sunny", "sun_angle=0.53", "view=window", "waves=0.05", "--size", "48x36", "--samples", "4")
    walls = {}
    for way, *more in (("traced", "--photons", "400000"), ("path",)):
        done = nimray("render", "pool", *setting, "--caustics", way, *more, "--out", tmp_path, "--name", way)
        assert done.returncode == 0, done.stderr
        picture = pixels(tmp_path / f"{way}.exr")
        walls[way] = np.median(np.concatenate([picture[-6:], picture[:4]])[..., 1])
    info = json.loads(nimray("info", tmp_path / "traced.exr", "--json").stdout)
    assert (info["caustics"], info["photons"]) == ("traced", 400000)
    assert walls["traced"] > 1.3 * walls["path"]


def test_frames_make_a_sequence_and_what_is_there_stays(nimray, tmp_path, capsys):
    """The waves move, the noise differs, a run that stopped goes on where it was, and any frame can be made again."""
    words = ["render", "sea", "--set", "time=1", "--frames", "11-12", "--fps", "20", "--seed", "5"]
    words += [*SMALL, "--out", str(tmp_path), "--name", "w"]
    done = nimray(*words, "--progress")
    assert (done.returncode, done.stderr) == (0, "")
    *said, last = map(json.loads, done.stdout.splitlines())
    assert last["files"] == [
        str(tmp_path / f"w_{frame:04}.{suffix}") for frame in (11, 12) for suffix in ("exr", "png")
    ]
    assert {(line["frame"], line["frames"], line["total"]) for line in said} == {(11, 2, 8), (12, 2, 8)}
    assert said[0]["done"] == 0 and said[-1]["done"] == 8

    first, second = (tmp_path / f"w_{frame:04}.exr" for frame in (11, 12))
    records = [read_metadata(file) for file in (first, second)]
    assert [(record["parameters"]["time"], record["seed"]) for record in records] == [(1.5, 16), (1.55, 17)]
    kept, former = first.stat().st_mtime_ns, pixels(second)
    second.with_suffix(".png").write_bytes(second.with_suffix(".png").read_bytes()[:1000])  # cut off
    assert command.main(words) == 0
    printed = capsys.readouterr()
    assert printed.err == f"nimray: {first} is there already.\n"
    assert printed.out.split() == last["files"]
    assert first.stat().st_mtime_ns == kept
    assert np.median(np.abs(pixels(second) - former)) < 1e-6

    assert command.main(["render", "--again", str(second), "--out", str(tmp_path), "--name", "again", "--quiet"]) == 0
    assert np.median(np.abs(pixels(tmp_path / "again.exr") - former)) < 1e-6
    assert sorted(path.name for path in tmp_path.iterdir() if path.suffix == ".exr") == [
        "again.exr",
        "w_0011.exr",
        "w_0012.exr",
    ]


def test_a_folder_where_the_comparison_would_be_is_seen_before_the_work(capsys, tmp_path):
    (tmp_path / "c.png").mkdir()
    assert command.main(["compare", "sphere", "--name", "c", "--out", str(tmp_path), *SMALL]) == 1
    assert "c.png is a folder" in capsys.readouterr().err
    assert [file.name for file in tmp_path.iterdir()] == ["c.png"]


def test_an_unwritable_folder_fails_with_exit_code_1(capsys, tmp_path):
    (tmp_path / "file").write_text("")
    assert command.main(["render", "sphere", *SMALL, "--out", str(tmp_path / "file" / "below")]) == 1
    assert "cannot write into" in capsys.readouterr().err


@pytest.mark.parametrize("line", (["render", "sphere", "--backend", "osl"], ["verify", "--backend", "osl"]))
def test_a_blender_without_osl_is_told_so(line, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(backends, "osl_available", lambda: False)
    assert command.main(line) == 1
    assert "was built without OSL" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_blender_without_osl_renders_with_its_own_nodes(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(backends, "osl_available", lambda: False)
    assert command.main(["render", "sphere", *SMALL, "--out", str(tmp_path), "--name", "one", "--quiet"]) == 0
    assert command.main(["info", str(tmp_path / "one.exr"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["backend"] == "nodes"
    assert command.main(["doctor"]) == 0
    assert "Blender's own nodes" in capsys.readouterr().out


def test_pictures_side_by_side_have_captions(tmp_path):
    assert command.main(["compare", "sphere", "--vary", "n=1.5,-1.5", "--out", str(tmp_path), *SMALL]) == 0
    names = ["sphere_n-1.5", "sphere_n--1.5"]
    images = [(tmp_path / f"{name}.exr", tmp_path / f"{name}.png") for name in names]
    expected = montage(tmp_path, "expected", images, {}, ["n = 1.5", "n = -1.5"])
    for file, other in zip(expected, ("sphere_compare.exr", "sphere_compare.png"), strict=True):
        assert np.array_equal(image_of(file).get_pixels(), image_of(tmp_path / other).get_pixels())


def test_a_blender_without_a_denoiser_is_told_so(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(session, "can_denoise", lambda: False)
    assert command.main(["render", "sphere", *SMALL, "--denoise", "--out", str(tmp_path / "new")]) == 1
    assert "without OpenImageDenoise" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_blender_older_than_the_closure_is_told_so(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(blender, "OLDEST_BLENDER", (99, 0, 0))
    assert command.main(["render", "sphere", "--out", str(tmp_path)]) == 1
    assert "is too old" in capsys.readouterr().err
