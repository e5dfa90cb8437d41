# SPDX-License-Identifier: GPL-3.0-or-later
"""Render settings under which no light is lost at an interface (what each one would cost is in the comments)."""

# The most Cycles takes. A ray bent backwards counts as a transparent bounce, any other as a bounce of its kind, and a
# path that has used them up is black; paths that lose light end early by Russian roulette, so a high limit costs little.
BOUNCES = 1024


def lossless(scene, backend):
    """Set `scene` (bpy.types.Scene) to render interfaces with Cycles, without bias; size and samples stay as they are.

    backend: "osl" or "nodes" (material.resolve)
    """
    if scene.render.engine != "CYCLES":  # setting it stops Cycles' previews, and waits for them, for nothing
        scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.shading_system = backend == "osl"
    cycles.transparent_max_bounces = BOUNCES
    cycles.max_bounces = BOUNCES
    for kind in ("diffuse", "glossy", "transmission"):
        setattr(cycles, f"{kind}_bounces", BOUNCES)
    # Filter Glossy and the clamps bite on the reflection but not on a ray that bends backwards.
    cycles.blur_glossy = 0.0
    cycles.sample_clamp_direct = 0.0
    cycles.sample_clamp_indirect = 0.0
    cycles.caustics_reflective = True
    cycles.caustics_refractive = True
    cycles.use_adaptive_sampling = False  # stops early where it has seen nothing yet: a rare caustic
    cycles.use_denoising = False
    # transparent film would show a NIM as a hole
    scene.render.film_transparent = False
    scene.render.use_compositing = False
    scene.render.use_sequencer = False


def one_sample(scene, index, total):
    """Let `scene` render sample `index` of `total` alone, counted from 0."""
    cycles = scene.cycles
    cycles.sample_offset = index
    if hasattr(cycles, "use_sample_subset"):  # from 4.5
        cycles.use_sample_subset, cycles.samples, cycles.sample_subset_length = True, total, 1
    else:
        cycles.samples = 1
