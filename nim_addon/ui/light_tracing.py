# SPDX-License-Identifier: GPL-3.0-or-later
"""Light paths traced: the interfaces of a scene, the rays of its settings through them, and what is to be said of those."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt

from ..cycles.casting import Kept, Meshes
from ..cycles.visibility import PATHS_MARK, shown
from ..physics.rays import MOST_SEGMENTS, Fate, Paths, trace
from .light_settings import Settings

# Where this share of the light is cut off by the settings, that is said.
CUT = 0.5


def surfaces_of(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, kept: Kept | None = None) -> Meshes:
    """What the rays of a scene meet; ValueError with a sentence where none of it is an interface.

    kept: as Meshes takes it
    """
    # ours stop no rays
    surfaces = Meshes((seen for seen in shown(scene, depsgraph) if not seen.original.get(PATHS_MARK)), depsgraph, kept)
    if not surfaces.bounds and surfaces.placeless:
        raise ValueError(_of_placeless(surfaces))
    if not surfaces.bounds:
        raise ValueError(
            pgettext_rpt("Light paths: {objects} have too many faces to be followed live; make curves instead").format(
                objects=", ".join(sorted(surfaces.left_out))
            )
            if surfaces.left_out
            else pgettext_rpt(
                "Light paths: no visible mesh of this scene has a NIM Interface material with media of its own; "
                "give one to an object first"
            )
        )
    return surfaces


def follow(
    surfaces: Meshes,
    start: tuple[np.ndarray, np.ndarray],
    settings: Settings,
    wavelengths_nm: Sequence[float] = (),
) -> Paths:
    """The Paths of rays, origins and directions (N, 3); ValueError with a sentence where they are too many.

    wavelengths_nm: of which all rays are followed, those of one after those of another
    """
    count = max(1, len(wavelengths_nm))
    origins, directions = (np.tile(given, (count, 1)) for given in start)
    options = {name: getattr(settings, name) for name in ("bounces", "least", "reach")}
    if wavelengths_nm:
        options["wavelength_nm"] = np.repeat(wavelengths_nm, len(start[0]))
    try:
        return trace(surfaces, origins, directions, gap=surfaces.gap, most=count * MOST_SEGMENTS, **options)
    except ValueError:
        raise ValueError(
            pgettext_rpt(
                "Light paths: the rays split into more than {most} pieces; "
                "take fewer rays or bounces, or a higher least energy"
            ).format(most=MOST_SEGMENTS)
        ) from None


def warning(surfaces: Meshes, drawn: list[Paths], bounces: int) -> str | None:
    """What there is to be said of those paths, a sentence or None."""
    if surfaces.unknown:
        return pgettext_rpt(
            "Rays end at {materials}: a link decides its media, so that they are not known here"
        ).format(materials=", ".join(sorted(surfaces.unknown)))
    if surfaces.left_out:
        return pgettext_rpt(
            "Rays pass through {objects}, with too many faces to be followed live; make curves instead"
        ).format(objects=", ".join(sorted(surfaces.left_out)))
    if surfaces.placeless:
        return _of_placeless(surfaces)
    # of the rays that met an interface
    total = stopped = lost = 0.0
    for paths in drawn:
        met = np.isin(paths.fate, (Fate.SPLIT, Fate.STOPPED)) & (paths.depth == 0)
        total += met.sum()
        stopped += paths.arriving[paths.fate == Fate.STOPPED].sum()
        lost += paths.lost.sum()
    if not total and all((paths.fate == Fate.LANDED).all() for paths in drawn):
        return pgettext_rpt(
            "All rays end at an opaque object before they meet one that bends light; move it, or the source"
        )
    if not total:
        return pgettext_rpt("No ray met an object that bends light; move the source, or aim it at one")
    if stopped >= CUT * total:
        return pgettext_rpt(
            "After {bounces} bounces {share:.0f} % of the light ends at a surface; raise Bounces to follow it on"
        ).format(bounces=bounces, share=100 * stopped / total)
    if lost >= CUT * total:
        return pgettext_rpt(
            "Branches with {share:.0f} % of the light have less than the Least Energy; lower it to follow them on"
        ).format(share=100 * lost / total)
    if surfaces.rough:
        return pgettext_rpt(
            "{materials} is rough: rays are drawn as if it were smooth, where most of the light goes"
        ).format(materials=", ".join(sorted(surfaces.rough)))
    return None


def _of_placeless(surfaces):
    text = pgettext_rpt(
        "Rays pass through {objects}, with vertices whose coordinates are no finite numbers: remove them"
    )
    return text.format(objects=", ".join(sorted(surfaces.placeless)))
