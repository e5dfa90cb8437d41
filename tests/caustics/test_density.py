"""Textures of caustics: how large they are together."""

import numpy as np
import pytest

from nim_addon.caustics.atlas import Chart
from nim_addon.caustics.density import ROOM, SMALLEST, layout
from nim_addon.caustics.photons import Landed


@pytest.mark.parametrize("tiles, edge", [(1, 512), (ROOM, 512), (32, 256)])
def test_many_surfaces_lit_alike_share_the_texels(tiles, edge):
    charts = [Chart(f"Tile {number}", 4, np.zeros(2), np.ones(2)) for number in range(tiles)]
    each = 4096
    side = np.repeat(2 * np.arange(tiles), each)
    place = np.random.default_rng(1).random((len(side), 2))
    sample = Landed(side, place, np.ones((len(side), 3)), np.ones(len(side)), np.full(len(side), 550.0))
    textures = layout(charts, sample, 512)
    assert len(textures) == tiles and {texture.shape[1] for texture in textures.values()} == {edge}
    assert sum(texture.size for texture in textures.values()) <= max(ROOM * 512**2, tiles * SMALLEST**2)
