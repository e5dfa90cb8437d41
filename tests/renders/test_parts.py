# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of a picture that do not make it are refused; that others do is in tests/sweeps/test_local.py."""

import pytest

from nim_addon.renders.parts import Part, merge
from nim_addon.renders.request import Request
from nim_addon.renders.session import Session


@pytest.mark.parametrize(
    ("parts", "told"),
    [
        ([(0, 3), (3, 4)], "samples 7 to 7 are missing"),
        ([(0, 3), (5, 3)], "samples 3 to 4 are missing"),
        ([(2, 6)], "samples 0 to 1 are missing"),
        ([(0, 5), (4, 4)], "sample 4 is there twice"),
    ],
)
def test_parts_that_leave_a_gap_or_overlap(parts, told, tmp_path):
    request = Request.of("sphere", size=(16, 12), samples=8, caustics="path", backend="nodes")
    with Session(request) as session, pytest.raises(ValueError, match=f"do not make the picture: {told}"):
        merge(session, {Part(*part): tmp_path / "part.exr" for part in parts}, tmp_path, "picture")
    assert not list(tmp_path.iterdir())
