# SPDX-License-Identifier: GPL-3.0-or-later
"""What in a scene would spoil an interface's picture, in a sentence each, and the mending of it."""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ..cycles import settings, visibility
from ..cycles.closures import closure_of_node
from ..cycles.closures.backends import device_runs_osl, osl_available
from ..cycles.material import asked_closures, switch_backend
from ..cycles.problem import Problem
from . import ball_checks, mesh_checks, pane_checks, ray_checks, spectral_checks, value_checks
from .sight import Sight, look

ENGINES = {
    "CYCLES": "Cycles",
    "BLENDER_EEVEE_NEXT": "EEVEE",
    "BLENDER_EEVEE": "EEVEE",
    "BLENDER_WORKBENCH": "Workbench",
}
ROUNDS = 4  # of mending all


def engine_name(scene: bpy.types.Scene) -> str:
    """What people call the render engine of a scene."""
    return ENGINES.get(scene.render.engine, scene.render.engine)


def backends(materials: Iterable[bpy.types.Material]) -> dict[str, tuple[str, ...]]:
    """Names of the materials of our closures by the backend of their nodes: {"osl": names, "nodes": names}."""
    names = {}
    for material in materials:
        for backend in {closure_of_node(node).backend_of(node.node_tree) for node, _ in asked_closures(material)}:
            names.setdefault(backend, []).append(material.name)
    return {backend: tuple(sorted(names[backend])) for backend in names}


def problems(scene: bpy.types.Scene, limit: int | None = None) -> list[Problem]:
    """All that is wrong in a scene, to be asked before it is rendered; empty where no material of our closures is shown.

    limit: meshes of more faces are not measured; None for all
    """
    with visibility.as_rendered(scene) as depsgraph:
        sight = look(scene, depsgraph, limit)
        return (setting_problems(scene, backends(sight.ours)) if sight.ours else []) + found_in(sight)


def found_in(sight: Sight) -> list[Problem]:
    """The Problems that all of CHECKS find in a sight.Sight."""
    if getattr(sight.scene, "cycles", None) is None:
        return []
    beside = ray_checks.other_layers(sight.scene)
    beside += ball_checks.find(sight) + pane_checks.find(sight)
    if not sight.worn:
        return (ray_checks.layers(sight) if ray_checks.overridden(sight) else []) + beside
    return [problem for check in CHECKS for problem in check(sight)] + beside


def setting_problems(scene: bpy.types.Scene, backends: dict[str, tuple[str, ...]]) -> list[Problem]:
    """The Problems of render settings; quick. `backends`: as the function of that name gives them."""
    cycles = getattr(scene, "cycles", None)
    if cycles is None:
        text = "Cycles is switched off in the preferences: only Cycles bends light backwards."
        return [Problem("engine", (text,), {}, None)]
    found = []

    def add(code, text, remedy, materials=None, **values):
        found.append(Problem(code, (text,), values, remedy, materials=materials))

    if scene.render.engine != "CYCLES":
        add(
            "engine",
            "{engine} cannot bend light backwards: only Cycles does.",
            "Use Cycles",
            engine=engine_name(scene),
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
    return found + settings.losses(scene)


def mend(scene: bpy.types.Scene, code: str | None = None) -> list[Problem]:
    """Mend what is wrong with a scene: the problems of that code, or all. Returns those that were mended."""
    mended = []
    # what is mended may show what is wrong behind it: a body that has holes has no outer side yet
    for _ in range(ROUNDS):
        mendable = [problem for problem in problems(scene) if problem.remedy and code in (None, problem.code)]
        for problem in mendable:
            MENDS[problem.code](scene, problem)
        mended += [problem for problem in mendable if problem not in mended]
        if not mendable:
            break
    return mended


def _use_nodes(scene, problem):
    for name in problem.materials:
        switch_backend(bpy.data.materials[name], "nodes")
        for node, _ in asked_closures(bpy.data.materials[name]):  # those in a person's own groups too
            node.node_tree = closure_of_node(node).group("nodes")


def _use_cycles(scene, problem):
    scene.render.engine = "CYCLES"


def _use_osl(scene, problem):
    scene.cycles.shading_system = True


# Each finds the Problems of its kind in a sight.Sight; slow ones are quick where Sight.measured() has kept what they know.
CHECKS = [*ray_checks.CHECKS, value_checks.find, value_checks.bumps, mesh_checks.find, spectral_checks.find]
# {code of a Problem that has a remedy: function(scene, problem) that does it}
MENDS = {
    "engine": _use_cycles,
    "osl_missing": _use_nodes,
    "osl_device": _use_nodes,
    "osl_off": _use_osl,
    **{loss.code: settings.mend for loss in settings.LOSSES},
    **ray_checks.MENDS,
    **value_checks.MENDS,
    **mesh_checks.MENDS,
    **spectral_checks.MENDS,
    **ball_checks.MENDS,
    **pane_checks.MENDS,
}
