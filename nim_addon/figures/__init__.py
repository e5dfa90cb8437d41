# SPDX-License-Identifier: GPL-3.0-or-later
"""Each figure of the thesis, rendered and measured: a recipe fixes a scene, a claim is a number predicted and measured.

To add a figure, write a module here that ends in FIGURES, a tuple of recipes.Figure, and name it in registry.py.

    def bare(scene):                                   # a change to the scene that a recipe renders
        probes.find(scene, "Straw").hide_render = True

    RECIPES = (
        Recipe("water", "glass", ("liquid=water",), draft=((360, 360), 64), final=((1280, 1280), 1024)),
        Recipe("bare", "glass", ("liquid=water",), draft=((128, 128), 64), change=bare, seeds=8, shown=False),
    )

    def measure(images):                               # a dict of Image by the recipe's name
        image = images["bare"]
        image.parameters                               # of the scene
        image.pixels                                   # (H, W, 3) linear, the mean over its seeds
        image.each                                     # (seeds, H, W, 3)
        image.camera.pixels_of(points)                 # (N, 2) column and row, floats, of points (N, 3) in metres
        image.camera.rays(columns, rows)               # the eye and the unit directions of the rays through them
        return [Claim("the straw breaks by", predicted, measured, allowed, "px"), ...]

    FIGURES = (Figure("5.1", "title", "what it shows", ("what must hold, one sentence each",), RECIPES, measure),)

Predictions come from `physics` (Interface, rays.trace), never from the renderer. A figure without renders has no
recipes: recipes.drawn_figure() makes it of a function that returns its claims, and of `draw(folder)`, which writes files
and returns their paths, the one to show first. This module, `claims`, `measure`, `curves` and `diagrams` import no bpy.
"""
