# SPDX-License-Identifier: GPL-3.0-or-later
"""The pool: its surface, its lights, and what an eye sees through its interface, held against Interface.refract."""

import math

import bpy
import numpy as np
import pytest

from nim_addon import caustics
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.physics import Interface, Medium
from nim_addon.scenes import pool, scene_type, surfaces, waves

WATER, NIM = Medium(1.33), Medium(-1.33)

pytestmark = pytest.mark.usefixtures("empty_file")


def built(**values):
    return pool.build(pool.PoolParameters(**values))


@pytest.fixture
def picture(render):
    """picture(scene, samples, size) -> linear pixels (height, width, 3), each the mean over the pixel's own square."""

    def pixels(scene, samples=16, size=(96, 96)):
        scene.render.resolution_x, scene.render.resolution_y = size
        scene.render.resolution_percentage = 100
        scene.cycles.samples = samples
        scene.cycles.pixel_filter_type = "BOX"
        return render(scene).astype(float)

    return pixels


def looks(scene, size=(96, 96)):
    """Unit vectors (height, width, 3), along which the camera looks through the middle of each pixel."""
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.view_layers[0].update()
    right, left, up = (np.array(scene.camera.data.view_frame(scene=scene)[i]) for i in (0, 2, 3))
    u = (np.arange(size[0]) + 0.5) / size[0]
    v = (np.arange(size[1]) + 0.5) / size[1]
    corner, across, down = up, right - up, left - up
    points = corner + u[None, :, None] * across + v[:, None, None] * down
    directions = points @ np.array(scene.camera.matrix_world.to_3x3()).T
    return directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def glow(name, strength):
    """A material that only emits."""
    return surfaces.shining(name, lambda nodes: (1, 1, 1), strength)


def uniform_world(scene, strength):
    scene.world = bpy.data.worlds.new("Uniform")
    nodes = Nodes(empty_tree(scene.world))
    nodes.end(nodes.add("ShaderNodeBackground", inputs={"Color": (1, 1, 1), "Strength": strength}), "World")


def dark_basin_only(scene):
    """Leave the liquid and a black basin that ends at its level: nothing stands in the way above the surface."""
    black = glow("Black", 0.0)
    for object_ in list(scene.objects):
        if object_.type == "MESH" and object_.name not in ("Liquid", "Basin"):
            bpy.data.objects.remove(object_)
    basin = scene.objects["Basin"].data
    for slot in range(len(basin.materials)):
        basin.materials[slot] = black
    for vertex in basin.vertices:
        vertex.co.z = min(vertex.co.z, pool.LEVEL)


def ball(scene, center, radius):
    """A glowing ball, the marker."""
    data = bpy.data.meshes.new("Marker")
    vertices, faces = pool.shapes.cube_sphere(6)
    data.from_pydata((np.array(center) + radius * vertices).tolist(), [], faces)
    data.materials.append(glow("Marker", 1.0))
    scene.collection.objects.link(bpy.data.objects.new("Marker", data))


def seen_at(picture, scene, size=(96, 96)):
    """The mean direction (3,) in which the picture is bright."""
    weight = picture(scene, 16, size).mean(axis=-1, keepdims=True)
    assert weight.sum() > 1, "the marker is not in the picture"
    mean = (looks(scene, size) * weight).sum(axis=(0, 1))
    return mean / np.linalg.norm(mean)


def pixel_angle(scene, size=(96, 96)):
    """The widest angle between neighbouring pixels, in radians."""
    d = looks(scene, size)
    return np.arccos(np.clip((d[:, 1:] * d[:, :-1]).sum(-1), -1, 1)).max()


def angle_between(a, b):
    return math.acos(np.clip(np.dot(a, b), -1, 1))


# the surface


@pytest.mark.parametrize("height", [0.005, 0.02, 0.25])
def test_waves_have_the_height_asked_for_about_the_level(height):
    vertices, _, _ = pool.liquid_surface(height, 3)
    assert np.ptp(vertices[:, 2]) == pytest.approx(height, rel=1e-9)
    assert vertices[:, 2].mean() == pytest.approx(pool.LEVEL, abs=1e-12)


@pytest.mark.parametrize("time", [0, 7.3])
def test_normals_are_the_slopes_of_the_heights(time):
    vertices, _, normals = pool.liquid_surface(0.1, 3, time)
    columns = len(np.unique(vertices[:, 1].round(9)))
    x, y, z = (vertices[:, i].reshape(-1, columns) for i in range(3))

    def slope(axis, step):
        # central difference of fourth order: within 0.5 % for the shortest wave
        near = np.roll(z, -1, axis) - np.roll(z, 1, axis)
        wide = np.roll(z, -2, axis) - np.roll(z, 2, axis)
        return ((8 * near - wide) / (12 * step))[2:-2, 2:-2]

    steep_x, steep_y = slope(0, x[1, 0] - x[0, 0]), slope(1, y[0, 1] - y[0, 0])
    given = (-normals[:, :2] / normals[:, 2:]).reshape(*z.shape, 2)[2:-2, 2:-2]
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1)
    assert np.abs(given[..., 0] - steep_x).max() < 0.01 * np.abs(steep_x).max()
    assert np.abs(given[..., 1] - steep_y).max() < 0.01 * np.abs(steep_y).max()


def test_the_mesh_carries_the_exact_normals():
    mesh = built(waves=0.1, seed=3, time=2).objects["Liquid"].data
    vertices, faces, normals = pool.liquid_surface(0.1, 3, 2)
    places = np.empty(vertices.size, np.float32)
    mesh.vertices.foreach_get("co", places)
    assert np.abs(places.reshape(-1, 3) - vertices).max() < 1e-6
    kept = np.empty(len(mesh.loops) * 3, np.float32)
    mesh.corner_normals.foreach_get("vector", kept)
    # Blender keeps them in 16 bits an angle
    assert np.abs(kept.reshape(-1, 3) - normals[np.array(faces).ravel()]).max() < 1e-3


def test_a_seed_gives_one_surface_and_another_seed_another():
    first, again, other = (pool.liquid_surface(0.05, seed)[0] for seed in (4, 4, 5))
    assert np.array_equal(first, again)
    assert np.abs(first - other).max() > 0.01


def test_at_time_0_the_surface_is_the_one_that_earlier_versions_had():
    vertices, _, normals = pool.liquid_surface(0.02, 1)
    heights = [-0.14427202246201387, -0.1496820152474266, -0.14785035781594952]
    assert vertices[[0, 5000, 9999], 2] == pytest.approx(heights, abs=1e-12)
    assert normals[5000] == pytest.approx([0.0031444838464241, -0.0210121593874125, 0.9997742752137694], abs=1e-12)


# on deep water a wave of 1 m takes 0.8003 s from crest to crest; the speed goes with the root of the length
@pytest.mark.parametrize("length, speed", [(0.25, 0.6248), (1.0, 1.2495), (4.0, 2.4990)])
def test_a_wave_travels_at_the_speed_of_its_length(length, speed, monkeypatch):
    monkeypatch.setattr(waves, "COUNT", 1)
    monkeypatch.setattr(pool, "WAVELENGTHS", (length, length))
    along = waves.random_waves(3, pool.WAVELENGTHS)[0][:, 0] * length / (2 * np.pi)
    assert np.linalg.norm(along) == pytest.approx(1)

    def crest(time):
        """Amplitude, and how far along its way a crest is."""
        vertices, _, _ = pool.liquid_surface(0.02, 3, time)
        argument = 2 * np.pi / length * (vertices[:, :2] @ along)
        parts = np.column_stack([np.cos(argument), np.sin(argument), np.ones_like(argument)])
        (cosine, sine, _), misfit, *_ = np.linalg.lstsq(parts, vertices[:, 2], rcond=None)
        assert misfit[0] < 1e-20
        return math.hypot(cosine, sine), math.atan2(sine, cosine) * length / (2 * np.pi)

    (high, start), (still_high, later) = crest(0), crest(0.1)
    assert still_high == pytest.approx(high, rel=1e-9)
    assert (later - start) % length == pytest.approx(0.1 * speed, rel=1e-3)
    surface = pool.liquid_surface(0.02, 3)[0]
    assert pool.liquid_surface(0.02, 3, length / speed)[0] == pytest.approx(surface, abs=2e-5)
    assert np.abs(pool.liquid_surface(0.02, 3, length / speed / 2)[0] - surface).max() > 0.015


def test_calm_liquid_is_one_level_rectangle():
    vertices, faces, normals = pool.liquid_surface(0, 1)
    assert len(faces) == 1
    assert np.all(vertices[:, 2] == pool.LEVEL) and np.all(normals == (0, 0, 1))


@pytest.mark.parametrize("height", [0, 0.25])
def test_the_surface_closes_the_basin_and_stays_below_the_deck(height):
    scene = built(waves=height, seed=2)
    graph = scene.view_layers[0].depsgraph
    scene.view_layers[0].update()
    rng = np.random.default_rng(0)
    inside = np.array(pool.HALF) - 1e-4
    for along in rng.uniform(-1, 1, 60):
        for x, y in [(along, -1), (along, 1), (-1, along), (1, along)]:
            # from just below the deck: the ladder and the parasol are above
            start = (x * inside[0], y * inside[1], -1e-4)
            hit, place, normal, _, object_, _ = scene.ray_cast(graph, start, (0, 0, -1))
            assert hit and object_.name in ("Liquid", "Ladder"), start
            assert normal.z > 0 and place.z < 0


def test_the_highest_waves_stay_below_the_deck():
    assert max(pool.liquid_surface(0.25, seed)[0][:, 2].max() for seed in range(4)) < 0


# the file


@pytest.mark.parametrize("sky", ["overcast", "sunny"])
def test_building_again_leaves_nothing_behind(sky, held):
    bpy.data.objects.new("Mine", bpy.data.meshes.new("Mine")).use_fake_user = True
    built(sky=sky)
    once = held()
    built(sky=sky, liquid="none", view="window")
    built(sky=sky)
    assert held() == once
    assert "Mine" in bpy.data.objects


def test_the_file_is_small(tmp_path):
    scene = built()
    for other in [s for s in bpy.data.scenes if s != scene]:
        bpy.data.scenes.remove(other)
    path = tmp_path / "pool.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)
    assert path.stat().st_size < 1e6


# the parameters


def test_liquid_and_permeability():
    assert pool.PoolParameters().liquid == NIM
    assert pool.PoolParameters(liquid="none").liquid is None
    assert pool.PoolParameters(liquid="water").liquid == WATER
    assert pool.PoolParameters(liquid="nim", mu=-10).liquid == Medium(-1.33, -10)
    assert pool.PoolParameters.read(["liquid=n=-1.33,mu=-10", "mu=-25"]).liquid == Medium(-1.33, -25)
    parameters = pool.PoolParameters(liquid="nim", mu="-10", view="window")
    assert pool.PoolParameters(**parameters.plain()) == parameters
    assert "Liquid" not in built(liquid="none").objects
    earlier = {key: value for key, value in parameters.plain().items() if key != "time"}
    assert pool.PoolParameters(**earlier) == parameters
    node = built(liquid="nim", mu=-10).objects["Liquid"].material_slots[0].material.node_tree.nodes["NIM Interface"]
    assert node.inputs["Permeability Inside"].default_value == -10


@pytest.mark.parametrize(
    "values, words",
    [
        ({"mu": 10}, "a negative index needs mu below 0"),
        ({"liquid": "water", "mu": -1}, "a positive index needs mu above 0"),
        ({"liquid": "none", "mu": -10}, "needs a liquid"),
        ({"liquid": "watr"}, "did you mean water"),
        ({"liquid": "0"}, "refracts nothing"),
        ({"view": "below"}, "side, top, window"),
        ({"sky": "rain"}, "overcast, sunny"),
        ({"sun_angle": 0}, "between 0.25 and 20 degrees"),
        ({"waves": -0.1}, "between 0 and 0.25 m"),
        ({"waves": "nan"}, "out of range"),
        ({"seed": "1.5"}, "seed"),
        ({"seed": -1}, "out of range"),
        ({"time": -1}, "between 0 and 3600 s"),
        ({"waves": 0.25, "time": 0.5}, "wash over the deck"),
    ],
)
def test_a_wrong_parameter_is_refused_in_a_sentence(values, words, one_sentence):
    with pytest.raises(ValueError) as refusal:
        pool.PoolParameters(**values)
    one_sentence(refusal.value, words)


def test_the_registry_knows_it():
    assert scene_type("pool").build is pool.build and scene_type("pool").parameters is pool.PoolParameters


# the light


def white_plane(world):
    """A scene with a white horizontal plane that fills the picture, under `world`."""
    stage = pool.Stage("pool", (64, 48))
    stage.mesh("Plane", *pool.shapes.rectangle((-1, -1), (1, 1)), surfaces.plain("White", (1, 1, 1)))
    stage.camera((0, -0.001, 1), (0, 0, 0), 30)
    stage.world(world)
    return stage.scene


def test_the_sun_lights_a_plane_the_same_whatever_its_width(picture, monkeypatch):
    def irradiance(width):
        scene = white_plane(pool.sunny(width))
        scene.world.cycles.sampling_method = "MANUAL"
        scene.world.cycles.sample_map_resolution = 1024
        return math.pi * picture(scene, 256, (16, 16)).mean(axis=(0, 1))

    both = [irradiance(width) for width in (1, 5, 20)]
    strength = pool.SUN_IRRADIANCE
    monkeypatch.setattr(pool, "SUN_IRRADIANCE", 0 * strength)
    sky = irradiance(5)
    for light in both:
        assert (light - sky) / (strength * pool.TOWARDS_SUN[2]) == pytest.approx(1, abs=0.01)


def test_the_overcast_sky_is_that_of_the_cie(picture):
    # L = L_z (1 + 2 sin e) / 3 gives the irradiance 7 pi L_z / 9 on a horizontal plane
    scene = white_plane(surfaces.overcast("Overcast", (1, 2, 3)))
    mean = picture(scene, 256, (16, 16)).mean(axis=(0, 1))
    assert mean / (1, 2, 3) == pytest.approx(7 / 9, abs=0.01)


# through the interface


@pytest.mark.parametrize("liquid", [WATER, NIM, Medium(-1.33, -10)], ids=str)
def test_snells_window_is_as_wide_as_the_critical_angle(picture, liquid):
    scene = built(liquid=liquid, view="window", waves=0)
    dark_basin_only(scene)
    uniform_world(scene, 1.0)
    bright = picture(scene, 64).mean(axis=-1)
    zenith = np.arccos(looks(scene)[..., 2])
    interface = Interface(liquid).reversed()
    edge, pixel = interface.critical_angle(), pixel_angle(scene)
    assert math.degrees(edge) == pytest.approx(48.75, abs=0.01)
    assert (bright > 0.05)[zenith < edge - pixel].all()
    assert not (bright > 0.05)[zenith > edge + pixel].any()
    # and as bright as the transmittance
    T = np.where(zenith < edge, interface.fresnel(np.cos(zenith)).T, 0)
    well_inside = zenith < edge - 2 * pixel
    assert bright[well_inside].mean() == pytest.approx(T[well_inside].mean(), abs=0.004)


@pytest.mark.parametrize("liquid", [WATER, NIM, Medium(-1.5)], ids=str)
def test_a_thing_in_the_air_is_seen_where_snell_puts_it(picture, liquid):
    scene = built(liquid=liquid, view="window", waves=0)
    dark_basin_only(scene)
    uniform_world(scene, 0.0)
    elevation, azimuth = math.radians(48), math.radians(25)
    flat = math.cos(elevation)
    towards = np.array([flat * math.cos(azimuth), flat * math.sin(azimuth), math.sin(elevation)])
    eye = np.array(scene.camera.location)
    ball(scene, eye + 400 * towards, 20)
    # backwards along the light: down from the marker, into the liquid
    expected = -Interface(liquid).refract(-towards, (0, 0, 1))
    seen = seen_at(picture, scene)
    assert angle_between(seen, expected) < pixel_angle(scene) / 2
    assert (seen[0] < 0) == liquid.is_nim and (seen[1] < 0) == liquid.is_nim


@pytest.mark.parametrize("liquid", [WATER, NIM], ids=str)
def test_no_light_is_lost_in_the_waves(picture, liquid):
    scene = built(liquid=liquid, view="window", waves=0.05)
    for object_ in list(scene.objects):
        if object_.type == "MESH" and object_.name != "Liquid":
            bpy.data.objects.remove(object_)
    uniform_world(scene, 1.0)
    assert picture(scene, 8) == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize("liquid, shown", [(None, False), (WATER, False), (NIM, True)], ids=["empty", "water", "nim"])
def test_from_the_side_only_a_nim_shows_the_near_wall(picture, liquid, shown):
    scene = built(liquid=liquid, view="side")
    black = glow("Black", 0.0)
    for object_ in scene.objects:
        if object_.type == "MESH" and object_.name != "Liquid":
            for slot in object_.material_slots:
                slot.material = black
    wall = bpy.data.meshes.new("Wall")
    x, y = pool.HALF[0], -pool.HALF[1] + 1e-3
    corners = [(-x, y, pool.FLOOR), (-x, y, pool.LEVEL - 0.1), (x, y, pool.LEVEL - 0.1), (x, y, pool.FLOOR)]
    wall.from_pydata(corners, [], [(0, 1, 2, 3)])
    wall.materials.append(glow("Marker", 1.0))
    scene.collection.objects.link(bpy.data.objects.new("Wall", wall))
    uniform_world(scene, 0.0)
    share = (picture(scene, 8, (96, 64)).mean(axis=-1) > 0.3).mean()
    assert share > 0.05 if shown else share == 0


@pytest.mark.parametrize("liquid", [None, WATER, NIM], ids=["empty", "water", "nim"])
def test_from_the_top_the_floor_is_magnified_as_snell_says(picture, liquid):
    scene = built(liquid=liquid, view="top", waves=0)
    for object_ in list(scene.objects):
        if object_.type == "MESH" and object_.name != "Liquid":
            bpy.data.objects.remove(object_)
    uniform_world(scene, 0.0)
    x, radius = 1.6, 0.1
    ball(scene, (x, 0, pool.FLOOR), radius)
    size = (192, 128)
    seen = seen_at(picture, scene, size)
    # where a ray at each angle from the vertical lands on the floor
    angle = np.radians(np.linspace(0, 40, 4001))
    fall = scene.camera.location.z - pool.LEVEL
    ray = np.stack([np.sin(angle), np.zeros_like(angle), -np.cos(angle)], -1)
    below = ray if liquid is None else Interface(liquid).refract(ray, (0, 0, 1))
    land = fall * np.tan(angle) - (pool.LEVEL - pool.FLOOR) * below[:, 0] / below[:, 2]
    expected = np.interp(x, land, angle)
    assert math.atan2(seen[0], -seen[2]) == pytest.approx(expected, abs=pixel_angle(scene, size) / 2)


def test_a_pool_built_again_has_no_caustics_of_the_last_one(empty_file):
    parameters = pool.PoolParameters.read(["sky=sunny"])
    scene = pool.build(parameters, "nodes")
    caustics.bake(scene, photons=1 << 13, texels=64)
    assert [object_ for object_ in scene.objects if object_.get(caustics.CAUSTICS_MARK)]
    assert scene.objects["Basin"].hide_render
    again = pool.build(parameters, "nodes")
    assert again == scene
    assert not [object_ for object_ in scene.objects if object_.get(caustics.CAUSTICS_MARK)]
    assert not [image for image in bpy.data.images if image.name.startswith(caustics.COLLECTION)]
    assert not scene.objects["Basin"].hide_render
