# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of the figures share: measured recipes rendered small, and the claims that fail."""

import numpy as np
import pytest

from nim_addon import caustics
from nim_addon.cycles import spectral
from nim_addon.figures.measure import Camera
from nim_addon.figures.recipes import Image
from nim_addon.scenes import scene_type
from nim_addon.scenes.stage import aim


@pytest.fixture
def images(empty_file, render):
    """images(figure, size, samples, *words, ...) -> the measured Images of a Figure by the names of their recipes.

    words:  where any are given, only the recipes whose names hold one of them
    seeds, photons: in place of the recipes' own; texels: of what photons bring; backend: of the materials
    """

    def pictures(figure, size, samples, *words, seeds=None, photons=None, texels=1024, backend="auto"):
        found = {}
        for recipe in figure.recipes:
            if recipe.shown or (words and not any(word in recipe.name for word in words)):
                continue
            scene_of = scene_type(recipe.scene, of_figures=True)
            parameters = scene_of.parameters.read(recipe.settings)
            pose = recipe.pose or scene_of.pose(parameters)
            scene = scene_of.build(parameters, backend)
            scene.render.resolution_x, scene.render.resolution_y = size
            scene.render.use_persistent_data = (seeds or recipe.seeds) > 1
            scene.cycles.samples = samples
            aim(scene.camera, *pose)
            recipe.change(scene)
            if recipe.wavelength:
                spectral.set_neutral(recipe.wavelength)
            each = []
            for seed in range(seeds or recipe.seeds):
                scene.cycles.seed = seed
                if recipe.photons:
                    caustics.bake(scene, photons=photons or recipe.photons[0], texels=texels, seed=1000 * seed)
                each.append(render(scene))
            found[recipe.name] = Image(np.stack(each), Camera(*pose, size), parameters)
        return found

    return pictures


@pytest.fixture
def failing():
    """failing(claims) -> those that do not hold, a line of text each."""
    return lambda claims: [claim.row() for claim in claims if not claim.holds]
