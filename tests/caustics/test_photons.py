# SPDX-License-Identifier: GPL-3.0-or-later
"""Photons from the light: how many land, where, and from how wide a sun, against closed forms."""

import math

import bpy
import numpy as np
import pytest

from nim_addon.caustics import photons
from nim_addon.caustics.atlas import charts_of
from nim_addon.caustics.bending import Bending
from nim_addon.caustics.lights import Sun
from nim_addon.caustics.photons import Tracer
from nim_addon.cycles.material import interface_material
from nim_addon.cycles.visibility import PATHS_MARK
from nim_addon.physics import Interface, Medium
from nim_addon.scenes import shapes, surfaces
from tests.caustics.rig import landed_of, over_floor, sheet

THETA = math.radians(30)
DOWN = (math.sin(THETA), 0.0, -math.cos(THETA))
SIDE = 256


def stage_of(medium, backend, *, shade=None):
    """A square metre of a medium's surface at z = 0 over a wide floor at z = -1, perhaps with a shade above it."""
    stage = over_floor(interface_material("Surface", medium, backend=backend), sheet(0.5), backend=backend)
    if shade:
        stage.mesh("Shade", *shapes.rectangle(*shade, 30.0), surfaces.plain("Shade", (0.5, 0.5, 0.5)))
    return stage.scene


def landed(scene, sun, passes=4, side=SIDE):
    names, landed = landed_of(scene, sun, side**2, passes)
    return names, landed.place, landed.power / passes


@pytest.mark.parametrize("backend", ["osl", "nodes"])
@pytest.mark.parametrize("medium", [Medium(-1.33), Medium(1.33), Medium(-1.33, -10.0)], ids=str)
def test_what_passes_the_surface_lands_where_snell_says(medium, backend, empty_file):
    sun = Sun(DOWN, (2.0, 3.0, 4.0), math.radians(0.53))
    names, place, power = landed(stage_of(medium, backend), sun)
    interface = Interface(medium)
    passed = math.cos(THETA) * (1 - float(interface.fresnel(math.cos(THETA)).R))  # of one square metre
    assert set(names) == {"Floor"}
    # what is sampled at random is whether a photon passes, and whether a pixel meets the surface's edge
    error = passed * math.sqrt(max(float(interface.fresnel(math.cos(THETA)).R), 1 / SIDE) / len(power))
    assert np.sum(power, axis=0) == pytest.approx(passed * np.array(sun.irradiance), abs=5 * 4 * error)
    middle = np.median(place, axis=0)
    assert middle == pytest.approx([math.tan(float(interface.theta_t(THETA))), 0.0], abs=0.01)
    assert np.ptp(place, axis=0) == pytest.approx([1.0, 1.0], abs=0.03)


def test_what_is_shaded_gets_nothing(empty_file):
    """A shade far above the half of the surface with x > 0, as the sun sees it."""
    away = math.tan(THETA)
    scene = stage_of(Medium(-1.33), "nodes", shade=((-30 * away, -2), (20, 2)))
    names, place, power = landed(scene, Sun(DOWN, (1, 1, 1), 0.0))
    interface = Interface(Medium(-1.33))
    shift = math.tan(float(interface.theta_t(THETA)))
    below = place[names == "Floor"]
    assert (below[:, 0].min(), below[:, 0].max()) == pytest.approx((shift - 0.5, shift), abs=0.01)
    # what the other half mirrors lands on the shade, from below
    mirrored = math.cos(THETA) / 2 * float(interface.fresnel(math.cos(THETA)).R)
    assert power[names == "Shade", 0].sum() == pytest.approx(mirrored, rel=0.1)


def test_drawn_light_paths_shade_nothing(empty_file):
    scene = stage_of(Medium(-1.33), "nodes", shade=((-30 * math.tan(THETA), -2), (20, 2)))
    scene.objects["Shade"][PATHS_MARK] = "sun"
    names, place, _ = landed(scene, Sun(DOWN, (1, 1, 1), 0.0))
    shift = math.tan(float(Interface(Medium(-1.33)).theta_t(THETA)))
    assert set(names) == {"Floor"}
    assert (place[:, 0].min(), place[:, 0].max()) == pytest.approx((shift - 0.5, shift + 0.5), abs=0.01)


@pytest.mark.parametrize("gaussian", [False, True])
def test_the_sun_is_as_wide_as_it_is_said_to_be(gaussian, empty_file):
    """Through an interface that changes nothing, a point of the plane spreads over the floor as the sun's disk does."""
    sun = Sun((0, 0, -1), (1, 1, 1), math.radians(4), gaussian)
    _, place, _ = landed(stage_of(Medium(1.0), "nodes"), sun, passes=32, side=64)
    # the square's image is the square, blurred: the variance of a blur adds
    blur = place.var(axis=0) - 1 / 12
    half = math.tan(math.radians(2))
    assert blur == pytest.approx([half**2 * (1 / 2 if gaussian else 1 / 4)] * 2, rel=0.1)


def test_nothing_is_left_behind_and_nothing_is_changed(empty_file):
    scene = stage_of(Medium(-1.33), "nodes")
    before = {kind: sorted(one.name for one in getattr(bpy.data, kind)) for kind in ("objects", "materials", "scenes")}
    landed(scene, Sun(DOWN, (1, 1, 1), 0.0), passes=1)
    after = {kind: sorted(one.name for one in getattr(bpy.data, kind)) for kind in before}
    assert after == before
    assert not scene.objects["Floor"].data.attributes.get("nim_place")


def test_passes_that_are_sent_together_are_those_that_are_sent_one_by_one(empty_file, monkeypatch):
    """Through two media, of which one takes some of the light: each pass has three pictures."""
    stage = over_floor(interface_material("Surface", Medium(1.33), backend="nodes"), sheet(0.5))
    absorbing = interface_material("Other", Medium.parse("n=-1.5,length=0.5"), backend="nodes")
    stage.mesh("Other", *shapes.box((-0.4, -0.4, -0.6), (0.4, 0.4, -0.4)), absorbing)
    columns, settings, change = ("side", "place", "power", "share"), [], Bending.set

    def noted(self, **switches):
        settings.append(switches)
        change(self, **switches)

    monkeypatch.setattr(Bending, "set", noted)

    def sent(together, first=0):
        monkeypatch.setattr(photons, "TOGETHER", together)
        settings.clear()
        with Tracer(stage.scene) as tracer:
            batches = list(tracer.trace(Sun(DOWN, (1, 1, 1), 0.01), 1 << 10, 6, seed=3, first=first))
        return [[getattr(batch, column) for column in columns] for batch in batches]

    single = sent(1)
    assert len(single) == 6 and len(settings) == 18
    # some is absorbed, and what landed in either medium is counted for less
    assert np.ptp(single[0][2]) > 0.1 * single[0][2].max() and np.ptp(single[0][3]) > 0.1
    together = sent(1 << 12)
    assert len(settings) == 6
    for one, other in ((single, together), (single[2:], sent(1 << 12, first=2))):
        for these, those in zip(one, other, strict=True):
            for column, values, others in zip(columns, these, those, strict=True):
                np.testing.assert_array_equal(values, others, err_msg=column)


@pytest.mark.parametrize("missing", ["Surface", "Floor"])
def test_without_interface_or_receiver(missing, empty_file, one_sentence):
    scene = stage_of(Medium(-1.33), "nodes")
    bpy.data.objects.remove(scene.objects[missing])
    with pytest.raises(ValueError) as error, Tracer(scene):
        pass
    one_sentence(error.value, "interface" if missing == "Surface" else "diffuse")
    assert "NIM photons" not in bpy.data.scenes


@pytest.mark.parametrize("name", ["Surface", "Floor"])
def test_a_vertex_that_is_nowhere_is_said(name, empty_file, one_sentence):
    scene = stage_of(Medium(-1.33), "nodes")
    scene.objects[name].data.vertices[0].co.x = np.nan
    with pytest.raises(ValueError) as error, Tracer(scene):
        pass
    one_sentence(error.value, name, "no finite numbers")
    assert "NIM photons" not in bpy.data.scenes


def test_a_lamp_under_a_surface_of_one_face_stands_within_the_medium(empty_file, one_sentence):
    """Wherever it stands: its rays at the corners of the face miss it by a rounding now and then."""
    with Tracer(stage_of(Medium(1.33), "nodes")) as tracer:
        for x, y, z in np.random.default_rng(0).uniform((-0.4, -0.4, 0.1), (0.4, 0.4, 0.6), (200, 3)):
            with pytest.raises(ValueError) as error:
                tracer.check_outside("Lamp", (x, y, -z))
            one_sentence(error.value, "stands within a medium")
            tracer.check_outside("Lamp", (x, y, z))


def test_charts_of_a_box():
    vertices, faces = shapes.box((0, 0, 0), (1, 1, 1))
    corners = np.asarray(vertices)[np.asarray(faces)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    number, axes = charts_of(faces, normals)
    assert sorted(axes) == [0, 1, 2, 3, 4, 5]
    assert len(set(number)) == 6


def test_charts_join_what_looks_the_same_way_and_touches():
    vertices, faces, _ = shapes.joined(shapes.grid((0, 0), (1, 1), 0.25), shapes.grid((2, 0), (3, 1), 0.25))
    number, axes = charts_of(faces, np.tile((0, 0, 1), (len(faces), 1)))
    assert len(axes) == 2 and list(axes) == [4, 4]
    assert len(set(number[: len(faces) // 2])) == 1


def test_faces_keep_their_own_material(empty_file):
    """Light lands on one half of a floor; the other half only shines, and takes none."""
    scene = stage_of(Medium(1.0), "nodes")
    floor = scene.objects["Floor"].data
    floor.clear_geometry()
    floor.from_pydata([(x, y, -1) for y in (-9, 9) for x in (-9, 0, 9)], [], [(0, 1, 4, 3), (1, 2, 5, 4)])
    floor.materials.append(surfaces.shining("Shining", lambda nodes: (1, 1, 1)))
    floor.polygons[1].material_index = 1
    _, place, _ = landed(scene, Sun((0, 0, -1), (1, 1, 1), 0.0))
    assert len(place) == pytest.approx(4 * SIDE**2 / 2, rel=0.02)
    assert place[:, 0].max() < 0.001
