# SPDX-License-Identifier: GPL-3.0-or-later
"""What in a scene would spoil an interface's picture, in a sentence each, and the mending of it."""

import bpy

from . import mesh_checks, settings, visibility
from .material import MARK, asked_interfaces, device_runs_osl, osl_available, switch_backend
from .problem import Problem, about, own_data
from .sight import look

# Below this a picture with a few NIMs in it has black spots; Blender starts with 8.
TRANSPARENT_BOUNCES = 64
# What a light of no size is given: a small bulb (metres), and the sun as it is seen from the earth (radians).
RADIUS, SUN = 0.1, 0.00918


def backends(materials):
    """Names of the interface materials by the backend of their nodes: {"osl": names, "nodes": names}."""
    names = {}
    for material in materials:
        for kind in {one.node.node_tree[MARK] for one in asked_interfaces(material)}:
            names.setdefault(kind, []).append(material.name)
    return {kind: tuple(sorted(those)) for kind, those in names.items()}


def interfaces(scene: bpy.types.Scene) -> list[bpy.types.Material]:
    """The interface materials that a render of a scene shows."""
    with visibility.as_rendered(scene) as depsgraph:
        return list(look(scene, depsgraph).worn)


def problems(scene: bpy.types.Scene) -> list[Problem]:
    """All that is wrong in a scene, to be asked before it is rendered; empty where no interface material is shown."""
    with visibility.as_rendered(scene) as depsgraph:
        sight = look(scene, depsgraph)
        return (setting_problems(scene, backends(sight.worn)) if sight.worn else []) + found_in(sight)


def found_in(sight):
    """The Problems that all of CHECKS find in a sight.Sight."""
    return [problem for check in CHECKS for problem in check(sight)] if sight.worn else []


def setting_problems(scene, backends):
    """The Problems of render settings; quick. `backends`: as the function of that name gives them."""
    cycles = getattr(scene, "cycles", None)
    if cycles is None:
        text = "Cycles is switched off in the preferences: only Cycles renders the interface."
        return [Problem("engine", (text,), {}, None)]
    found = []

    def add(code, text, remedy, materials=None, **values):
        found.append(Problem(code, (text,), values, remedy, materials=materials))

    if scene.render.engine != "CYCLES":
        names = {"BLENDER_EEVEE_NEXT": "EEVEE", "BLENDER_EEVEE": "EEVEE", "BLENDER_WORKBENCH": "Workbench"}
        engine = names.get(scene.render.engine, scene.render.engine)
        add(
            "engine",
            "{engine} cannot bend a ray at the interface: only Cycles renders it.",
            "Use Cycles",
            engine=engine,
        )
    if scripted := backends.get("osl"):
        if not osl_available():
            text = "This Blender was built without OSL, which the material's script needs."
            add("osl_missing", text, "Use nodes", scripted)
        elif not device_runs_osl(scene):
            text = "This GPU does not run OSL, which the material's script needs: only the CPU and OptiX do."
            add("osl_device", text, "Use nodes", scripted)
        elif not cycles.shading_system:
            add("osl_off", "Open Shading Language is off, which the material's script needs.", "Turn on OSL", scripted)
    if cycles.transparent_max_bounces < TRANSPARENT_BOUNCES:
        text = "Transparent bounces: {bounces}. Each bend backwards is one, and after the last the path is black."
        add("transparent_bounces", text, "Raise them", bounces=cycles.transparent_max_bounces)
    if cycles.sample_clamp_direct > 0 or cycles.sample_clamp_indirect > 0:
        text = "Clamping dims what is mirrored but not what is bent backwards: their balance is wrong."
        add("clamp", text, "Turn off clamping")
    if cycles.blur_glossy > 0:
        text = "Filter Glossy blurs what is mirrored but not what is bent backwards."
        add("filter_glossy", text, "Turn off the filter")
    if scene.render.film_transparent:
        text = "The film is transparent: a negative-index material shows as a hole in it."
        add("film_transparent", text, "Make the film opaque")
    return found


def light_problems(sight):
    """The Problems of lights: one of no size is never met by a ray that an interface has bent."""
    found = []
    for thing in visibility.rendered(sight.scene):
        if thing.type == "LIGHT" and _sizeless(thing.data):
            text = "The light {name} has no size: it is never seen through the interface and casts no light through it."
            found.append(about(thing, "zero_light", text, "Give it a size"))
    return found


def mend(scene, code=None):
    """Mend what is wrong with a bpy.types.Scene: the problems of that code, or all. Returns those that were mended."""
    mended = [problem for problem in problems(scene) if problem.remedy and code in (None, problem.code)]
    for problem in mended:
        MENDS[problem.code](scene, problem)
    return mended


def _sizeless(light):
    if light.type == "SUN":
        return light.angle == 0
    if light.type == "AREA":
        return light.size == 0 or (light.shape in ("RECTANGLE", "ELLIPSE") and light.size_y == 0)
    return light.shadow_soft_size == 0


def _use_nodes(scene, problem):
    for name in problem.materials:
        switch_backend(bpy.data.materials[name], "nodes")


def _give_size(scene, problem):
    for light in own_data(problem):
        if light.type == "SUN":
            light.angle = SUN
        elif light.type == "AREA":
            light.size, light.size_y = light.size or RADIUS, light.size_y or RADIUS
        else:
            light.shadow_soft_size = RADIUS


def _set(owner, **values):
    """A mend that sets attributes of the scene's `owner` ("render" or "cycles")."""

    def settle(scene, problem):
        for name, value in values.items():
            setattr(getattr(scene, owner), name, value)

    return settle


# Each finds the Problems of its kind in a sight.Sight; slow ones are quick where Sight.measured() has kept what they know.
CHECKS = [light_problems, mesh_checks.find]
# {code of a Problem that has a remedy: function(scene, problem) that does it}
MENDS = {
    **mesh_checks.MENDS,
    "engine": _set("render", engine="CYCLES"),
    "osl_missing": _use_nodes,
    "osl_device": _use_nodes,
    "osl_off": _set("cycles", shading_system=True),
    "transparent_bounces": _set("cycles", transparent_max_bounces=settings.BOUNCES),
    "clamp": _set("cycles", sample_clamp_direct=0.0, sample_clamp_indirect=0.0),
    "filter_glossy": _set("cycles", blur_glossy=0.0),
    "film_transparent": _set("render", film_transparent=False),
    "zero_light": _give_size,
}
