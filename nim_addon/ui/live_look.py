# SPDX-License-Identifier: GPL-3.0-or-later
"""What live light paths show of a scene: traced anew whenever a setting, a material or an object has changed."""

from __future__ import annotations

import time
from types import SimpleNamespace

import bpy
from bpy.app.handlers import persistent
from bpy.app.translations import pgettext_rpt

from ..cycles.casting import Kept
from ..physics import Interface
from . import deferred, light_sources, live_lines
from .light_settings import LEGENDS, Settings
from .light_tracing import follow, surfaces_of, warning
from .looks import Looks

LARGEST = 250_000  # a mesh of more faces takes Blender over a second to make ready for rays
BUDGET = 0.05  # seconds that a change may take while others follow it
FEWEST = 12  # rays that are left then
STILL = 0.3  # seconds after which nothing follows

on = False  # set by light_live
known_meshes = {}  # by the session_uid of a scene: what it was read from, and its Kept


class Look:
    """What is drawn of a scene: `lines`, of what is `traced`; a `sentence` of what is to be said, or None.

    seconds: that a ray took, 0 where meshes had to be made ready first
    coarse:  how many rays stand for all of them while things move, or None
    """

    def __init__(self, scene: bpy.types.Scene, most_rays: int | None = None):
        self.marks = marks(scene)
        self.traced, self.sentence, self.coarse, self.seconds, self.drawn = [], None, None, 0.0, None
        self._made = 0  # trees
        begun = time.perf_counter()
        settings = settings_of(scene)
        if most_rays is not None and most_rays < settings.rays:
            self.coarse = settings.rays = most_rays
        try:
            self._trace(scene, settings)
        except ValueError as error:
            self.traced, self.sentence = [], str(error)
        self.lines = live_lines.lines(self.traced, scene.nim_rays.color)
        self.lie = live_lines.lie_of(self.lines)
        if not self._made:
            self.seconds = (time.perf_counter() - begun) / settings.rays
        self.at = time.perf_counter()

    def said(self) -> tuple:
        """What panels say of it."""
        return self.sentence, self.coarse, bool(self.traced), any(one.wavelengths_nm for one in self.traced)

    def _trace(self, scene, settings):
        layer = _layer(scene)
        if layer.depsgraph is None:
            layer.update()
        depsgraph = layer.depsgraph
        source, kept = depsgraph.as_pointer(), known_meshes.get(scene.session_uid)
        if kept is None or kept[0] != source:
            kept = known_meshes[scene.session_uid] = source, Kept(LARGEST)
        surfaces, before = surfaces_of(scene, depsgraph, kept[1]), kept[1].trees
        there = SimpleNamespace(
            scene=scene,
            active_object=layer.objects.active,
            selected_objects=[obj for obj in layer.objects if obj.type == "LIGHT" and obj.select_get(view_layer=layer)],
        )
        starts = light_sources.starts(there, settings, surfaces, depsgraph)
        parts = scene.nim_rays.color == "WAVELENGTH" and _disperses(surfaces.interfaces)
        wavelengths = live_lines.WAVELENGTHS_NM if parts else ()
        for start in starts.values():
            paths = follow(surfaces, start, settings, wavelengths)
            self.traced.append(live_lines.Traced(paths, surfaces.interfaces, wavelengths))
        self._made = kept[1].trees - before
        self.sentence = warning(surfaces, [one.paths for one in self.traced], settings.bounces)


def settings_of(scene: bpy.types.Scene) -> SimpleNamespace:
    """A copy of the Settings of a scene, which what is drawn may change."""
    return SimpleNamespace(**{name: getattr(scene.nim_rays, name) for name in Settings.__annotations__})


def _layer(scene):
    """The view layer of a window that shows the scene; else its first."""
    windows = bpy.context.window_manager.windows
    return next((one.view_layer for one in windows if one.scene == scene), scene.view_layers[0])


def _disperses(interfaces):
    media = [medium for one in interfaces if isinstance(one, Interface) for medium in (one.inside, one.outside)]
    return any(medium.dispersion is not None and medium.dispersion.has_colours for medium in media)


def marks(scene: bpy.types.Scene) -> tuple:
    """What of a scene decides its live paths and may change without Blender telling anybody; quick."""
    settings = scene.nim_rays
    values = [getattr(settings, name) for name in (*Settings.__annotations__, "color")]
    values = [tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value for value in values]
    handle = light_sources.handle_of(scene)
    return *values, handle and handle.session_uid, *map(tuple, scene.cursor.matrix)


def look(scene: bpy.types.Scene, finish: bool = False, drawing: bool = False) -> Look | None:
    """Look at a scene while live paths are on.

    While changes follow each other faster than that takes, with fewer rays; with all of them afterwards.
    finish:  with all of them, whatever it takes
    drawing: for a view that is being drawn, so that it need not be drawn again
    """
    if not on:  # it was asked for before that
        return None
    last, most = LOOKS.last(scene), None
    if last and last.seconds and not finish and time.perf_counter() - last.at < STILL:
        most = max(FEWEST, int(BUDGET / last.seconds))
    new = Look(scene, most)
    if new.coarse:
        deferred.do(LOOKS.renew, scene.session_uid, True, after=STILL)
    if not drawing:
        redraw()
    elif last is None or new.said() != last.said():
        redraw(bpy.context.region)
    return new


LOOKS = Looks(look, lambda: True)


def known(scene: bpy.types.Scene) -> Look | None:
    """The Look at a scene for a view that is being drawn, or None; taken now where something has changed since the last.

    A redraw takes longer than a look: one that was taken afterwards would be a redraw late. Nothing of Blender's is changed
    here, nor is a view, other than a panel, read-only while it is drawn.
    """
    last = LOOKS.last(scene)
    if last and last.marks != marks(scene):
        LOOKS.outdate(scene)
    if not LOOKS.is_fresh(scene):
        if _layer(scene).depsgraph is None:  # evaluated only where nothing is being drawn
            return LOOKS.known(scene)
        LOOKS.renew(scene.session_uid, False, True)
    return LOOKS.last(scene)


def sentence(scene: bpy.types.Scene) -> str | None:
    """What is to be said of the live paths of a scene, translated; None where that is nothing, or they are off."""
    last = LOOKS.last(scene)
    if last and last.coarse:
        return pgettext_rpt("Coarser while it moves: {some} of {rays} rays").format(
            some=last.coarse, rays=scene.nim_rays.rays
        )
    return last.sentence if last else None


def legend(scene: bpy.types.Scene) -> str:
    """What the colours of the rays of a scene say, in English: of the live ones, or while they are off of curves."""
    color, last = scene.nim_rays.color, LOOKS.last(scene)
    if not on or (color == "WAVELENGTH" and not (last and any(one.wavelengths_nm for one in last.traced))):
        color = "PART"
    return LEGENDS[color]


def nothing_disperses(scene: bpy.types.Scene) -> bool:
    """Whether the live rays of a scene are coloured by part though they shall be by wavelength: all are alike."""
    last = LOOKS.last(scene)
    if not on or scene.nim_rays.color != "WAVELENGTH" or last is None or not last.traced:
        return False
    return not any(one.wavelengths_nm for one in last.traced)


def redraw(but: bpy.types.Region | None = None) -> None:
    """Let all 3D views, and the panels beside them, be drawn again; `but` one, which is being drawn."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type in ("WINDOW", "UI") and region != but:
                        region.tag_redraw()


@persistent
def note_change(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None) -> None:
    """Called by Blender after a change: the paths may no longer be so, which the views find as they are drawn."""
    LOOKS.outdate()
    for update in depsgraph.updates if depsgraph else ():
        for _, kept in known_meshes.values():
            kept.changed(update)
    windows = bpy.context.window_manager.windows
    views = [area for window in windows for area in window.screen.areas if area.type == "VIEW_3D"]
    if any(view.spaces.active.overlay.show_overlays for view in views):
        redraw()
        return
    for shown in {window.scene for window in windows}:  # panels tell of what no view draws
        deferred.do(LOOKS.renew, shown.session_uid)


@persistent
def forget(*_) -> None:
    """Called by Blender: it is another state of the file."""
    LOOKS.forget()
    known_meshes.clear()
