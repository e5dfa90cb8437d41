# SPDX-License-Identifier: GPL-3.0-or-later
"""A small sweep, and whoever carries it out."""

import functools

import pytest

from nim_addon.renders.request import Request
from nim_addon.sweeps import local, run, state
from nim_addon.sweeps.plan import Task


@pytest.fixture
def spheres():
    """spheres(*indices, **options): a task for each index."""

    def make(*indices, **options):
        usual = {"size": (24, 18), "samples": 4, "caustics": "path", "backend": "nodes"}
        return [Task(Request.of("sphere", {"n": str(n)}, **{**usual, **options}), {"n": str(n)}) for n in indices]

    return make


@pytest.fixture
def sweep(tmp_path):
    """sweep(tasks, engine=None, **options): carry them out in tmp_path; returns what could not be, and the State."""

    def carry_out(tasks, engine=None, ended=None, **options):
        here = functools.partial(local.carry_out, binary="", **options)
        with state.alone(tmp_path) as folder:
            at = state.State(folder, 0)
            return run.carry_out(tasks, folder, engine or here, at, here, ended), at

    return carry_out
