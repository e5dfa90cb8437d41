# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a view looks along light paths, and that the button turns it to where they are seen to bend."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from mathutils import Matrix, Vector

from nim_addon.scenes import shapes
from nim_addon.ui import light_view, live_lines, live_look
from tests.ui.drawn_paths import add_interface

SIZE, FREE, LENS = (800, 600), (0, 500), 50.0  # the sidebar lies over the rest


def lines(points):
    ends = np.array(points, "f").reshape(-1, 2, 3)
    count = len(ends)
    return live_lines.Lines(ends, np.ones((count, 2, 4), "f"), np.ones(count, "f"), np.zeros((count, 2), int))


class View:
    """What of a bpy.types.RegionView3D is read and set, with a matrix that follows at once."""

    def __init__(self, towards, perspective=True, middle=(0, 0, 0), distance=10.0):
        self.view_rotation = Vector(towards).to_track_quat("-Z", "Y")
        self.view_location, self.view_distance = Vector(middle), distance
        self.is_perspective, self.view_perspective = perspective, "PERSP" if perspective else "ORTHO"

    @property
    def view_matrix(self):
        turned = self.view_rotation.to_matrix().to_4x4()
        behind = Matrix.Translation((0, 0, self.view_distance))
        return (Matrix.Translation(self.view_location) @ turned @ behind).inverted()

    def shown(self, points):
        """(N, 2) where points are, from -1 to 1 over the region's width and height."""
        points = np.array(points) @ np.array(self.view_matrix)[:3, :3].T + np.array(self.view_matrix)[:3, 3]
        depth = -points[:, 2:] if self.is_perspective else self.view_distance
        half = np.array(SIZE) / max(SIZE) * light_view.SENSOR / LENS / 2
        return points[:, :2] / depth / half


BEAM = [(-3, 0, 0), (0, 0, 0), (0, 0, 0), (2, 0, -2), (-3, 0, 0.4), (0, 0, 0.4), (0, 0, 0.4), (2, 0, -1.6)]
RAY = [(-3, 0, 0), (3, 0, 0)]
TILTED = np.array(BEAM) @ np.array(Matrix.Rotation(0.5, 3, (1, 1, 0)))
BALL = np.random.default_rng(1).normal(size=(60, 3)) * (5, 1, 1)


@pytest.mark.parametrize("perspective", [True, False], ids=["perspective", "orthographic"])
@pytest.mark.parametrize(
    "points, towards, along",
    [
        (BEAM, (1, 0, 0), True),
        (BEAM, (0, 0, -1), True),
        (BEAM, (1, 0.1, -1), True),
        (BEAM, (0, 1, 0), False),
        (BEAM, (1, 1, -1), False),
        (RAY, (1, 0, 0), True),
        (RAY, (0, 1, 0), False),
        (RAY, (0, 0, -1), False),
        (BALL, (-1, 0, 0.1), True),
        (BALL, (0, 0, -1), False),
    ],
)
def test_a_view_along_the_rays_is_known(points, towards, along, perspective):
    lie = live_lines.lie_of(lines(points))
    assert light_view.looks_along(lie, View(towards, perspective)) is along


@pytest.mark.parametrize("perspective", [True, False], ids=["perspective", "orthographic"])
@pytest.mark.parametrize("points", [BEAM, RAY, TILTED, BALL, np.array(BEAM)[:, [0, 2, 1]]])
@pytest.mark.parametrize("towards", [(1, 0, 0), (0, 0, -1), (0.3, 1, -0.2), (0, 0, 1), (0, -1, 0.1)])
def test_turned_it_sees_all_of_them_from_the_side_upright(points, towards, perspective):
    lie, view = live_lines.lie_of(lines(points)), View(towards, perspective)
    before = view.view_rotation.copy()
    light_view.turn(lie, view, SIZE, FREE, LENS)
    assert not light_view.looks_along(lie, view)
    assert (view.view_rotation @ Vector((0, 0, 1))).dot(before @ Vector((0, 0, 1))) > -1e-5, "the nearer side"
    assert (view.view_rotation @ Vector((1, 0, 0))).z == pytest.approx(0, abs=1e-5), "the horizon is level"
    shown = view.shown(points)
    assert abs(shown).max() < 1 and shown[:, 0].max() < 0.25, "all of them are in the view, beside the sidebar"
    assert max(np.ptp(shown, axis=0) / (1.25, 2)) > 0.4, "and fill it"


def test_it_leaves_the_camera_and_no_rays_lie_in_no_way():
    view = View((1, 0, 0))
    view.view_perspective = "CAMERA"
    light_view.turn(live_lines.lie_of(lines(BEAM)), view, SIZE, FREE, LENS)
    assert view.view_perspective == "PERSP"
    assert live_lines.lie_of(live_lines.lines([], "PART")) is None


def pressed(press):
    area = next(area for area in bpy.context.screen.areas if area.type == "VIEW_3D")
    with bpy.context.temp_override(area=area, region=area.regions[-1]):
        return press("nim.light_paths_view"), area.spaces.active.region_3d


def test_the_button_turns_the_view_to_the_rays_of_the_settings(addon, press):
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    add_interface(-1.5, shapes.cube_sphere(8), smooth=True)
    bpy.context.view_layer.update()
    result, view = pressed(press)
    assert result == {"FINISHED"} and not live_look.known_meshes, "live paths are off: nothing is kept"
    lie = live_look.Look(bpy.context.scene).lie
    live_look.forget()
    assert abs((view.view_rotation @ Vector((0, 0, 1))).dot(Vector(lie.normal))) == pytest.approx(1, abs=1e-4)
    aside = view.view_location - Vector(lie.middle)
    assert aside.length < view.view_distance and abs(aside.dot(Vector(lie.normal))) < 1e-4


def test_where_there_is_nothing_to_trace_that_is_said(addon, press):
    with pytest.raises(RuntimeError, match="no visible mesh of this scene has"):
        pressed(press)


def test_the_view_says_so_itself_but_not_one_of_four(addon, monkeypatch):
    lie = live_lines.lie_of(lines(BEAM))
    monkeypatch.setattr(live_look, "LOOKS", SimpleNamespace(last=lambda scene: SimpleNamespace(lie=lie)))
    space = SimpleNamespace(region_quadviews=[])
    context = SimpleNamespace(scene=bpy.context.scene, space_data=space, region_data=View((1, 0, 0)))
    assert light_view.sentence(context).startswith("This view looks along the rays")
    context.region_data = View((0, 1, 0))
    assert light_view.sentence(context) is None
    context.region_data, space.region_quadviews = View((1, 0, 0)), [1, 2, 3, 4]
    assert light_view.sentence(context) is None
