# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectral EXR files: what is written is read back, by name, and others' files are read."""

import numpy as np
import OpenImageIO as oiio
import pytest

from nim_addon.cycles import spectral_images
from nim_addon.cycles.images import read_metadata, write_with_metadata

NM = [400.0, 486.13, 550.0, 656.28, 1000.0]  # of which the last comes first by name


@pytest.fixture
def written(tmp_path):
    random = np.random.default_rng(1)
    radiance, rgb = random.normal(size=(4, 6, 5)).astype(np.float32), random.normal(size=(4, 6, 3)).astype(np.float32)
    spectral_images.write(tmp_path / "a.exr", NM, radiance, rgb)
    return tmp_path / "a.exr", radiance, rgb


def test_what_is_written_is_read_back(written):
    file, radiance, rgb = written
    found = spectral_images.read(file)
    np.testing.assert_allclose(found.wavelengths_nm, NM, rtol=1e-12)
    np.testing.assert_array_equal(found.radiance, radiance)
    np.testing.assert_array_equal(found.rgb, rgb)


def test_the_layout_is_that_of_the_paper(written):
    spec = oiio.ImageBuf(str(written[0])).spec()
    assert set(spec.channelnames) == {
        *"RGB", "S0.400,000000nm", "S0.486,130000nm", "S0.550,000000nm", "S0.656,280000nm", "S0.1000,000000nm",
    }  # fmt: skip
    assert spec.get_string_attribute("spectralLayoutVersion") == "1.0"
    assert spec.get_string_attribute("emissiveUnits") == "W.m^-2.sr^-1.nm^-1"


def test_it_carries_what_made_it_as_our_other_images_do(written, tmp_path):
    file, radiance, _ = written
    write_with_metadata(oiio.ImageBuf(str(file)), tmp_path / "b.exr", {"nimray": "0.1.0"})
    assert read_metadata(tmp_path / "b.exr") == {"nimray": "0.1.0"}
    again = spectral_images.read(tmp_path / "b.exr")
    np.testing.assert_array_equal(again.radiance, radiance)
    assert oiio.ImageBuf(str(tmp_path / "b.exr")).spec().get_string_attribute("spectralLayoutVersion") == "1.0"


def test_what_others_write_is_read(tmp_path):
    names = ["S0.5e2nm", "S0.,4um", "T.450,0nm", "S1.500nm", "S0.600nm", "S0.nm", "A"]
    spec = oiio.ImageSpec(2, 1, len(names), oiio.HALF)
    spec.channelnames = tuple(names)
    image = oiio.ImageBuf(spec)
    image.set_pixels(image.roi, np.broadcast_to(np.arange(7.0, dtype=np.float32), (1, 2, 7)).copy())
    assert image.write(str(tmp_path / "other.exr"))
    found = spectral_images.read(tmp_path / "other.exr")
    np.testing.assert_allclose(found.wavelengths_nm, [400, 500, 600], rtol=1e-12)
    np.testing.assert_array_equal(found.radiance, [[[1, 0, 4]] * 2])
    assert found.rgb is None


def test_what_is_none_is_refused(tmp_path, one_sentence):
    with pytest.raises(FileNotFoundError):
        spectral_images.read(tmp_path / "none.exr")
    (tmp_path / "text.exr").write_text("no image")
    with pytest.raises(ValueError) as caught:
        spectral_images.read(tmp_path / "text.exr")
    one_sentence(caught.value, "not a whole image")
    image = oiio.ImageBuf(oiio.ImageSpec(2, 2, 3, oiio.FLOAT))
    image.write(str(tmp_path / "plain.exr"))
    with pytest.raises(ValueError) as caught:
        spectral_images.read(tmp_path / "plain.exr")
    one_sentence(caught.value, "no spectral image", "S0.550,000000nm")
