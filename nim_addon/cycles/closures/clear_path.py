# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a path has met no mirror and nothing transparent, and so no interface, as osl/nim_clear_path.osl has it."""

from __future__ import annotations

from .closure import Closure, Output
from .formulas import Sheet, maximum

# Of the node Light Path; portals are transparent to Cycles.
DEPTHS = ("Glossy Depth", "Transmission Depth", "Transparent Depth")


def _twin(sheet: Sheet) -> None:
    """What nim_clear_path.osl says, by the counts alone: nodes are told them at once."""
    sheet.frame("1 where no bounce was glossy, transmitted or transparent, else 0")
    path = sheet.node("ShaderNodeLightPath", "bounces")
    glossy, transmission, transparent = (path[name] for name in DEPTHS)
    clear = maximum(1 - glossy - transmission - transparent, 0.0)
    sheet.name(locals())
    sheet.end(clear)


CLEAR_PATH = Closure(
    shader="nim_clear_path",
    label="NIM Clear Path",
    sockets=(),
    version=1,
    twin=_twin,
    heart="LIGHT_PATH",
    outputs=(Output("clear", "Clear", "NodeSocketFloat"),),
)
