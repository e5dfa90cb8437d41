# SPDX-License-Identifier: GPL-3.0-or-later
"""A sphere of index 1.5 and of -1.5 against two programs that share no code with Cycles or with this project.

The scene is tests/data/README.md's. Each picture is rendered SEEDS times; the scatter of its 8 x 8-pixel blocks over
the seeds is the picture's own standard error, and the distance to the reference is measured in it. What is not noise is
known, and dealt with where it arises:

- Cycles puts the first sample of every pixel at the pixel's centre (kernel/integrator/init_from_camera.h, "use center
  of pixel for first sample"). With 8 samples a level edge then sits up to 1/16 pixel wrong, the same for every seed:
  13 standard errors where the checks cross a block. The renders here begin at the second sample.
- The unlit reference has 16 x 16 rays in a pixel, on a lattice that edges alias with. Against 256 x 256 rays a pixel on
  the bare ground at the right edge its blocks are 1.9e-4 off (rms); a Cycles render of 1,024 samples is 0.9e-4 off, of
  which 0.8e-4 is noise.
- OSL computes asin by a polynomial (OpenImageIO fmath.h, fast_asin: at most 4.5e-5 rad off), and the sky has an asin.
- Pictures are float32.
"""

import math

import numpy as np
import pytest

SEEDS, SAMPLES = 12, 8
SKY_HORIZON, SKY_ZENITH = (1.0, 0.9, 0.75), (0.25, 0.45, 0.9)
FAST_ASIN = 4.5e-5 / (math.pi / 2) * np.abs(np.subtract(SKY_ZENITH, SKY_HORIZON))
FLOAT32 = 1e-6
# Standard errors of the reference's blocks: aliasing; noise of 0.003 a pixel.
REFERENCE_ERROR = {"emit": 1.9e-4, "lit": 0.003 / 8}


def blocks(picture):
    return picture.astype(float).reshape(32, 8, 32, 8, 3).mean((1, 3))


def reference_scene(n, lit):
    """The scene of tests/data/README.md, to the last number, lit by the sky or shining by itself."""

    from nim_addon.cycles.material import interface_material
    from nim_addon.physics import Medium
    from nim_addon.scenes import shapes, surfaces
    from nim_addon.scenes.sphere import ball
    from nim_addon.scenes.stage import Stage

    opaque = surfaces.diffuse if lit else surfaces.shining

    def checks(nodes):
        xyz = nodes.add("ShaderNodeSeparateXYZ", inputs={0: nodes.add("ShaderNodeTexCoord").outputs["Object"]})
        cells = nodes.math("ADD", *(nodes.math("FLOOR", xyz.outputs[axis]) for axis in (0, 1)))
        return nodes.mix(nodes.math("FLOORED_MODULO", cells, 2.0), (0.8,) * 3, (0.2,) * 3)

    stage = Stage("reference", (64, 48))
    stage.mesh("Ground", *shapes.rectangle((-40, -40), (40, 40)), opaque("Ground", checks))
    ball(stage, "Sphere", (0, 0, 1), 1.0, interface_material("Sphere", Medium(n)))
    ball(stage, "Red", (0.5, 2.5, 0.6), 0.6, opaque("Red", lambda nodes: (0.8, 0.05, 0.05)))
    ball(stage, "Blue", (-0.9, -2.2, 0.35), 0.35, opaque("Blue", lambda nodes: (0.05, 0.1, 0.8)))
    stage.world(surfaces.sky("Sky", SKY_HORIZON, SKY_ZENITH))
    stage.camera((0, -6, 1.6), (0, 0, 1), 40)
    scene = stage.scene
    scene.render.resolution_x = scene.render.resolution_y = 256
    scene.render.resolution_percentage = 100
    scene.render.use_persistent_data = True
    scene.cycles.pixel_filter_type = "BOX"
    scene.cycles.filter_width = 1.0
    # samples 1 to SAMPLES of a longer sequence: without sample 0, which is not drawn but put at the centre
    scene.cycles.sample_offset = 1
    if hasattr(scene.cycles, "use_sample_subset"):
        scene.cycles.samples = 4 * SAMPLES
        scene.cycles.use_sample_subset = True
        scene.cycles.sample_subset_length = SAMPLES
    else:  # before 4.5 the offset alone makes a subset
        scene.cycles.samples = SAMPLES
    return scene


@pytest.mark.parametrize("n", [1.5, -1.5])
@pytest.mark.parametrize("kind", ["emit", "lit"])
def test_reference_sphere(kind, n, empty_file, render, data):
    expected = np.load(data / "reference_sphere.npz")[f"{kind} {n:+.1f}"].astype(float)
    scene = reference_scene(n, lit=kind == "lit")
    seeds = []
    for seed in range(SEEDS):
        scene.cycles.seed = seed
        seeds.append(blocks(render(scene)))
    seeds = np.array(seeds)
    off = seeds.mean(0) - expected
    error = seeds.std(0, ddof=1) / math.sqrt(SEEDS)

    # Blocks of bare sky, of one check or one ball hold no noise: there the pictures must agree to what is known.
    quiet = error < 3e-5
    assert 0.3 < quiet.mean() < 0.7
    assert np.all(np.abs(off) <= FAST_ASIN + FLOAT32 + 6 * error, where=quiet)

    # The others scatter: off by chance alone, off / error is Student's t with SEEDS - 1 degrees of freedom.
    error = np.hypot(error, REFERENCE_ERROR[kind])
    z = (off / error)[~quiet]
    rms, beyond = math.sqrt(np.mean(z**2)), np.sum(np.abs(z) > 4)
    whole = off.sum((0, 1), where=~quiet) / np.sqrt(np.sum(error**2, (0, 1), where=~quiet))
    print(f"{kind} {n:+.1f}: {z.size} z, rms {rms:.3f}, {beyond} > 4, max {abs(z).max():.1f}, whole {whole.round(2)}")
    freedom = SEEDS - 1
    # four times the scatter of the rms of some 500 independent values of that distribution
    assert rms == pytest.approx(math.sqrt(freedom / (freedom - 2)), rel=0.15)
    expected_beyond = 0.0021 * z.size  # P(|t| > 4) for 11 degrees of freedom
    assert beyond <= expected_beyond + 4 * math.sqrt(3 * expected_beyond)
    assert np.abs(z).max() < 12  # P = 1e-7
    # and the picture as a whole is neither brighter nor darker, in any colour
    assert np.all(np.abs(whole) < 4)
