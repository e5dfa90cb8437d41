# SPDX-License-Identifier: GPL-3.0-or-later
"""Images side by side: where each stands, and what lies between."""

import numpy as np
import OpenImageIO as oiio
import pytest

from nim_addon.renders.montage import grid, montage


@pytest.mark.parametrize(("form", "white"), ((np.uint8, 255), (np.float32, 1)))
def test_pictures_stand_in_rows_and_the_smaller_are_centred(form, white):
    pictures = [np.full((height, 6, 3), value, form) for height, value in ((4, 0), (2, 0), (4, 0))]
    sheet = grid(pictures, 2)
    assert sheet.shape == (4 + 2 + 4, 6 + 2 + 6, 3) and sheet.dtype == form
    dark = sheet[..., 0] == 0
    assert dark[:4, :6].all() and dark[6:, :6].all()
    assert dark[1:3, 8:].all() and not dark[[0, 3], 8:].any()
    assert not dark[4:6].any() and not dark[:, 6:8].any() and not dark[6:, 8:].any()
    assert sheet.max() == white


def test_without_columns_all_stand_in_one_row():
    assert grid([np.zeros((4, 6, 3))] * 3).shape == (4, 3 * 6 + 2 * 2, 3)


def test_pictures_stay_level_however_long_their_captions_are(tmp_path):
    files = []
    for name in "ab":
        for suffix in ("exr", "png"):
            image = oiio.ImageBuf(oiio.ImageSpec(320, 40, 3, oiio.FLOAT if suffix == "exr" else oiio.UINT8))
            oiio.ImageBufAlgo.fill(image, (0.5,) * 3)
            assert image.write(str(tmp_path / f"{name}.{suffix}"))
        files.append((tmp_path / f"{name}.exr", tmp_path / f"{name}.png"))
    for joined in montage(tmp_path, "joined", files, {}, ["n = 1.5", "n=-1.5," * 11]):
        pixels = oiio.ImageBuf(str(joined)).get_pixels()
        assert np.allclose(pixels[:40, :320], 0.5, atol=0.01) and np.allclose(pixels[:40, -320:], 0.5, atol=0.01)
        assert pixels[40:, -6:].min() > 0.99  # the longest is not cut off
