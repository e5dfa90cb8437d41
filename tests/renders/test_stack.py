# SPDX-License-Identifier: GPL-3.0-or-later
"""Stacks of one render a wavelength: their files, their colours, the errors that they tell, and the spectral render beside."""

import dataclasses

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest

from nim_addon.base.streams import quiet
from nim_addon.cycles import spectral_images, wavelength
from nim_addon.cycles.images import read_metadata
from nim_addon.figures.measure import blocks
from nim_addon.physics import REPRESENTATIVE_NM, colour
from nim_addon.renders import stack
from nim_addon.renders.request import Request
from nim_addon.renders.stack import Region, Stack

SMALL = {"size": (24, 16), "samples": 4, "backend": "nodes", "caustics": "path"}
NM = (450.0, 550.0, 600.0, 650.0)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A stack of the sphere, and its folder, in a file in which nobody has set a wavelength before."""
    with quiet():
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    one = Stack(Request.of("sphere", ["n=n-bk7"], **SMALL), NM[::-1], Region(4, 5, 8, 6))
    return one, one.render(tmp_path_factory.mktemp("stack"), "s")


def test_a_stack_is_three_files_that_agree(made):
    one, files = made
    found = spectral_images.read(files.exr)
    np.testing.assert_allclose(found.wavelengths_nm, NM)
    assert found.radiance.shape == (16, 24, 4) and found.rgb.shape == (16, 24, 3)
    rows = np.loadtxt(files.csv, delimiter=",", skiprows=1)
    assert files.csv.read_text().startswith("wavelength_nm,radiance,standard_error,of_white\n")
    np.testing.assert_allclose(rows[:, 0], NM)
    np.testing.assert_allclose(rows[:, 1], found.radiance[5:11, 4:12].mean(axis=(0, 1)), rtol=1e-5)
    np.testing.assert_allclose(rows[:, 3], rows[:, 1] / colour.daylight(NM), rtol=1e-6)
    assert (rows[:, 2] > 0).all() and (rows[:, 2] < 0.3 * rows[:, 1]).all()
    assert read_metadata(files.exr) == read_metadata(files.png) == files.record


def test_its_record_makes_it_again(made):
    one, files = made
    request, record = Request.again(files.exr)
    assert request == dataclasses.replace(one.request, backend="nodes")
    assert Stack.again(request, record) == one
    assert (record["wavelengths"], record["region"]) == (list(NM), [4, 5, 8, 6])


def test_afterwards_media_show_what_they_showed(made):
    assert wavelength.neutral() == REPRESENTATIVE_NM


def test_white_is_white_in_a_stack():
    for some in (NM, tuple(np.arange(400, 701, 10.0)), (420.0, 430.0, 560.0, 610.0)):
        np.testing.assert_allclose(stack.preview_weights(np.array(some)).mean(axis=0), 1, atol=1e-12)


def test_lines_that_make_no_white_have_their_own_colour():
    w = stack.preview_weights(np.array([640.0, 660.0])).mean(axis=0)
    assert w[0] > 1 and w[0] > 10 * max(w[1], w[2])
    np.testing.assert_allclose(np.linalg.inv(colour.xyz_to_srgb(np.eye(3)).T)[1] @ w, 1)


def test_the_standard_error_is_that_of_the_mean(tmp_path, empty_file):
    """Of eight stacks, each of a noise of its own, the means differ as the errors say."""
    means, errors = [], []
    for seed in range(8):
        asked = Request.of("sphere", ["n=-1.33"], seed=seed, **{**SMALL, "samples": 16})
        made = Stack(asked, (500.0, 600.0), Region(8, 4, 8, 8)).render(tmp_path, f"s{seed}")
        rows = np.loadtxt(made.csv, delimiter=",", skiprows=1)
        means.append(rows[:, 1])
        errors.append(rows[:, 2])
    ratio = np.sqrt(np.var(means, axis=0, ddof=1) / np.mean(np.square(errors), axis=0))
    # samples are spread more evenly over all of a wavelength's than over a quarter of them: the error said is the larger
    assert (ratio < 1.5).all() and (ratio > 0.2).all()


def test_each_sheet_is_at_its_own_wavelength(tmp_path, empty_file):
    """Gold, which mirrors red and not blue: each line is that of a render at its wavelength alone."""
    nm, region = (500.0, 600.0), Region(9, 5, 6, 6)
    asked = Request.of("sphere", ["n=gold"], **{**SMALL, "samples": 64})
    rows = np.loadtxt(Stack(asked, nm, region).render(tmp_path, "s").csv, delimiter=",", skiprows=1)
    for row, shares in zip(rows, colour.shares_of(np.array(nm)), strict=True):
        alone = dataclasses.replace(asked, wavelength=row[0], seed=1).render(tmp_path, f"{row[0]:g}")
        sent = oiio.ImageBuf(str(alone.exr)).get_pixels(oiio.FLOAT)[5:11, 9:15, :3] @ shares
        error = row[2] * row[3] / row[1]  # of what is of white, as both are here
        assert abs(sent.mean() - row[3]) < 4 * np.sqrt(2) * error
    assert rows[1, 3] - rows[0, 3] > 10 * np.abs(rows[:, 2] * rows[:, 3] / rows[:, 1]).max()


def test_a_stack_and_a_spectral_render_are_one_picture(tmp_path, empty_file):
    """By blocks, within the noise of both; what all light of 430 nm shows is another picture.

    Of a NIM that disperses so much that sheets 20 nm apart are too few.
    """
    small = {"size": (24, 16), "caustics": "path", "backend": "nodes"}
    nm, seeds = tuple(np.arange(385.0, 731.0, 10.0)), range(3)

    def picture(name, *words, **options):
        made = Request.of("sphere", ["n=nim-causal", *words], **small, **options).render(tmp_path, name)
        return oiio.ImageBuf(str(made.exr)).get_pixels(oiio.FLOAT)[..., :3]

    def sheets(seed):
        one = Stack(Request.of("sphere", ["n=nim-causal"], **small, samples=8, seed=seed), nm)
        return spectral_images.read(one.render(tmp_path, f"stack{seed}").exr).rgb

    single = blocks(np.stack([picture(f"all{seed}", "spectral=yes", samples=128, seed=seed) for seed in seeds]), 8)
    stacked = blocks(np.stack([sheets(seed) for seed in seeds]), 8)
    error = np.sqrt(sum(some.var(axis=0, ddof=1) / len(some) for some in (single, stacked)))

    def scores(other):
        return np.sqrt(np.mean(np.square((single.mean(axis=0) - other) / error)))

    # an error known from three pictures each: chance makes 1.4 (Student's t)
    assert scores(stacked.mean(axis=0)) < 2
    assert scores(blocks(picture("one", samples=128, wavelength=430.0), 8)) > 5
