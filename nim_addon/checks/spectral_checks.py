# SPDX-License-Identifier: GPL-3.0-or-later
"""What is wrong with a render of all wavelengths: with the shutter that gives them, and with what is to have them."""

from __future__ import annotations

import bpy

from ..cycles import dispersive, drift, spectral, wavelength
from ..cycles.animation import curves_of
from ..cycles.closures import SHUTTER
from ..cycles.closures.backends import osl_available
from ..cycles.nodes import Owner
from ..cycles.problem import LINKED, Problem
from ..cycles.visibility import asked, has_nodes
from .sight import Sight

MOVES = ("location", "rotation", "scale", "delta_location", "delta_rotation", "delta_scale")
STILL = 1e-5  # of a value, while the shutter is open: what it shows of colours is below what is seen


def find(sight: Sight) -> list[Problem]:
    """The Problems of a scene's wavelengths; in one that is not spectral, that what disperses shows but one of them."""
    scene = sight.scene
    if not spectral.is_spectral(scene):
        names = tuple(sorted(material.name for material in sight.ours if _disperses(material)))
        if not names:
            return []
        text = (
            "{names}: what disperses is shown at {nm:g} nm alone, since the scene is not rendered in all wavelengths."
        )
        values = {"names": ", ".join(names), "nm": wavelength.neutral()}
        return [Problem("one_wavelength", (text,), values, "Render all wavelengths", materials=names)]
    return [
        *_shutter(scene),
        *_moving(sight),
        *_volumes(sight),
        *_light(sight),
        *_facets(),
        *_lamps(sight),
        *_sky(scene),
    ]


def _disperses(material):
    return any(dispersive.is_medium_node(node) for node in material.node_tree.nodes)


def _shutter(scene):
    """Whether the time within the shutter still gives each path its wavelength."""
    if not scene.render.use_motion_blur:
        text = "Motion Blur is off: the picture shows what disperses at {nm:g} nm alone, in no colors."
        return [Problem("shutter", (text,), {"nm": wavelength.neutral()}, "Turn it on")]
    wrong = []
    if scene.render.motion_blur_shutter > 2 * spectral.SHUTTER_TIME:
        wrong.append("The shutter is open too long (frames: {open:g}): what moves meanwhile has edges in all colors.")
    if scene.render.motion_blur_position != spectral.SETTINGS["render.motion_blur_position"]:
        wrong.append("The shutter does not start on the frame, by which nodes tell the wavelength.")
    if scene.cycles.rolling_shutter_type != "NONE":
        wrong.append("The shutter rolls, so that each row of the picture has wavelengths of its own.")
    if not spectral.is_flat(scene):
        wrong.append("The shutter's curve is not flat, so that some wavelengths come too often.")
    if not wrong:
        return []
    exclusive = "Real motion blur and all wavelengths exclude each other."
    values = {"open": scene.render.motion_blur_shutter}
    return [Problem("shutter", (*wrong, exclusive), values, "Set the shutter")]


def _moving(sight):
    """What moves while the shutter is open, by keyframes of its own: no button knows what is meant by it."""
    scene = sight.scene
    start, end = scene.frame_current, scene.frame_current + scene.render.motion_blur_shutter
    names = []
    for obj in dict.fromkeys([*(shown.original for shown in sight.shown), *sight.lamps, scene.camera]):
        # cameras move whether motion blur is theirs or not; drift.hold() takes it from what need not tell the time
        if (
            obj is not None
            and (obj.type == "CAMERA" or obj.cycles.use_motion_blur)
            and any(
                curve.data_path.startswith(MOVES) and abs(curve.evaluate(end) - curve.evaluate(start)) > STILL
                for curve, strip in curves_of(obj)
                if strip is None
            )
        ):
            names.append(obj.name)
    if not names:
        return []
    text = "{names}: it moves while the shutter is open, and each wavelength sees it elsewhere: its edges are colored."
    return [Problem("moves_in_colours", (text,), {"names": ", ".join(names)}, None, objects=tuple(names))]


def _volumes(sight):
    """From Blender 5.0 on what a volume may be at most is asked at one wavelength, and what is denser at others is missed."""
    if bpy.app.version < (5, 0) or sight.scene.cycles.volume_biased:
        return []
    worn = {material for shown in sight.shown for material in shown.materials if has_nodes(material)}
    names = tuple(
        sorted(
            material.name
            for material in worn
            if any(SHUTTER.is_node(found.node) for found in asked(material, "Volume"))
        )
    )
    if not names:
        return []
    text = "{names}: a volume that depends on the wavelength comes out too thin; Blender is right with biased volumes only."
    return [Problem("volume_in_colours", (text,), {"names": ", ".join(names)}, "Use biased volumes", materials=names)]


def _light(sight):
    """What shines without the weight of its wavelength, or has come, or moved, since the scene was set up."""
    owners = {*_shining(sight), *(lamp.data for lamp in sight.lamps), sight.scene.world} - {None}
    white = [owner for owner in owners if spectral.unweighted(owner)]
    found = []
    for linked in (False, True):
        names = sorted(owner.name for owner in white if bool(owner.library) == linked)
        if names:
            text = "{names}: its light has no wavelengths, and stays white where it is bent by what disperses."
            texts, remedy = ((text, LINKED), None) if linked else ((text,), "Set up anew")
            found.append(Problem("white_light", texts, {"names": ", ".join(names)}, remedy))
    telling = {lamp for lamp in sight.lamps if _tells_by_nodes(lamp.data)}
    for shown in sight.shown:
        if shown.single and any(material and _tells_by_nodes(material) for material in shown.materials):
            telling.add(shown.original)
    moved = sorted(obj.name for obj in telling if not drift.is_at_rest(obj))
    if moved:
        text = "{names}: it was moved, or made, since all wavelengths were set up, and cannot tell them."
        values = {"names": ", ".join(moved)}
        found.append(Problem("moved_since", (text,), values, "Set up anew", objects=tuple(moved)))
    return found


def _facets():
    """What has become rough, and disperses, since the scene was set up."""
    names = tuple(sorted(material.name for material in spectral.scattering()))
    if not names or not wavelength.clear_paths_are_white():
        return []
    text = "{names}: it is rough and disperses since all wavelengths were set up, and lamps light it without colors."
    return [Problem("white_facets", (text,), {"names": ", ".join(names)}, "Set up anew", materials=names)]


def _shining(sight):
    return {material for shown in sight.shown for material in shown.materials if material}


def _tells_by_nodes(owner: Owner) -> bool:
    """Whether the nodes of a material, lamp or sky ask the place of the object for the wavelength."""
    return _tells_by(owner, "nodes")


def _tells_by(owner, backend):
    return any(SHUTTER.is_node(node) and SHUTTER.backend_of(node.node_tree) == backend for node, _ in asked(owner))


def _lamps(sight):
    """Lamps whose nodes are to tell the wavelength in a Blender that shows them one place at all times."""
    names = sorted(lamp.name for lamp in sight.lamps if not drift.lamps_drift() and _tells_by_nodes(lamp.data))
    if not names:
        return []
    text = (
        "{names}: before Blender 4.5 nodes cannot tell a lamp the wavelength: its light stays white; use a Blender with OSL, "
        "or let a mesh shine in its place."
    )
    return [Problem("white_lamp", (text,), {"names": ", ".join(names)}, None, objects=tuple(names))]


def _sky(scene):
    if scene.world is None:
        return []
    if not scene.cycles.shading_system and osl_available() and _tells_by(scene.world, "osl"):
        text = "Open Shading Language is off, by which the sky {name} tells the wavelengths: it is black."
        return [Problem("black_sky", (text,), {"name": scene.world.name}, "Turn on OSL")]
    if not _tells_by_nodes(scene.world):
        return []
    text = (
        "The sky {name} has no place, by which Blender's nodes could tell it the wavelength: its light stays white; use a "
        "Blender with OSL, or let a dome shine in its place."
    )
    return [Problem("white_sky", (text,), {"name": scene.world.name}, None)]


def _set_up(scene, problem):
    spectral.set_up(scene)


def _open_shutter(scene, problem):
    spectral.open_shutter(scene)


def _bias_volumes(scene, problem):
    scene.cycles.volume_biased = True


def _use_osl(scene, problem):
    scene.cycles.shading_system = True


MENDS = {
    "one_wavelength": _set_up,
    "shutter": _open_shutter,
    "white_light": _set_up,
    "moved_since": _set_up,
    "white_facets": _set_up,
    "volume_in_colours": _bias_volumes,
    "black_sky": _use_osl,
}
# Of all Problems of a scene that is spectral.
CODES = {*MENDS, "moves_in_colours", "white_lamp", "white_sky"} - {"one_wavelength"}
