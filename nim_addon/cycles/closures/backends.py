# SPDX-License-Identifier: GPL-3.0-or-later
"""The two forms of a closure, "osl" and "nodes": which of them this Blender, and the device of a scene, can render."""

from __future__ import annotations

import bpy

from ...base.options import BACKENDS


def osl_available() -> bool:
    """Whether this build of Blender can compile and render OSL (shading_system alone does not tell)."""
    return bool(bpy.app.build_options.cycles and bpy.app.build_options.cycles_osl)


def device_runs_osl(scene: bpy.types.Scene) -> bool:
    """Whether the device that `scene` renders on can run OSL: of the GPUs only OptiX can."""
    if scene.cycles.device == "CPU":
        return True
    cycles = bpy.context.preferences.addons.get("cycles")
    return cycles is None or cycles.preferences.compute_device_type in ("NONE", "OPTIX")


def resolve(backend: str, scene: bpy.types.Scene | None = None) -> str:
    """The backend, "osl" or "nodes", that `backend` stands for.

    "auto" is "osl" where this build has it and the device of `scene` (None for the CPU) allows it, else "nodes".
    Raises ValueError for an unknown one, RuntimeError for "osl" in a Blender without OSL.
    """
    if backend not in BACKENDS:
        raise ValueError(f"there is no backend {backend!r}; the ones that exist are {', '.join(BACKENDS)}.")
    if backend == "osl" and not osl_available():
        raise RuntimeError(
            f"Blender {bpy.app.version_string} here was built without OSL, which the material needs; "
            "use a build from blender.org or the bpy package from PyPI."
        )
    if backend != "auto":
        return backend
    return "osl" if osl_available() and (scene is None or device_runs_osl(scene)) else "nodes"
