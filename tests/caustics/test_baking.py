# SPDX-License-Identifier: GPL-3.0-or-later
"""Baked caustics: the surface shines with what landed on it, where it landed, and is itself again when they are cleared."""

import math
import os

import bpy
import numpy as np
import pytest

from nim_addon import caustics
from nim_addon.caustics import lights
from nim_addon.caustics.lights import Sun
from nim_addon.cycles.material import interface_material
from nim_addon.physics import Interface, Medium
from nim_addon.scenes import glass, pool, sphere, surfaces
from tests.caustics.rig import floor_eye, over_floor, sheet

THETA = math.radians(30)
SUN = Sun((math.sin(THETA), 0.0, -math.cos(THETA)), (2.0, 3.0, 4.0), math.radians(0.53))
ALBEDO = (0.5, 0.3, 0.1)


@pytest.fixture
def scene(empty_file):
    """A square metre of NIM at z = 0 over a wide floor at z = -1 in the dark, and an eye between them that sees 2 m of it."""
    material = interface_material("Surface", Medium(-1.33), backend="nodes")
    scene = floor_eye(over_floor(material, sheet(0.5), albedo=ALBEDO, size=128), 2.0)
    scene.cycles.samples = 4
    return scene


def test_the_floor_shines_with_what_the_surface_lets_through(scene, render):
    power = caustics.bake(scene, [SUN], texels=256, photons=1 << 18)
    for lamp in (thing for thing in scene.objects if thing.type == "LIGHT"):
        lamp.hide_render = True
    picture = render(scene)
    cosine = math.cos(THETA)
    # Cycles sees the same radiance on both sides of an interface, where really it grows by n^2
    through = cosine * (1 - float(Interface(Medium(-1.33)).fresnel(cosine).R)) / 1.33**2
    assert set(power) == {"Floor"}
    assert power["Floor"] == pytest.approx(through * sum(SUN.irradiance), rel=0.02)
    expected = through * np.array(SUN.irradiance) * ALBEDO / math.pi
    across = 64 * (1 + math.tan(float(Interface(Medium(-1.33)).theta_t(THETA))))  # column of the square's middle
    # well within the square, and well outside it
    assert picture[48:80, round(across) - 16 : round(across) + 16].mean((0, 1)) == pytest.approx(expected, rel=0.01)
    assert np.all(picture[:, round(across) + 38 :] == 0) and np.all(picture[:24] == 0)
    # all of the light, with its soft edge
    assert picture.sum((0, 1)) * (2 / 128) ** 2 == pytest.approx(expected, rel=0.02)
    # an edge as sharp as the photons are dense: from a tenth to nine tenths within three pixels
    profile = picture[48:80, :, 0].mean(0) / expected[0]
    assert np.count_nonzero((profile > 0.1) & (profile < 0.9)) <= 2 * 3


@pytest.mark.parametrize("n", [-1.33, 1.33])
def test_baked_and_path_traced_light_have_the_same_mean(n, scene, render):
    """A soft sun of 10 degrees, which a path tracer can find by chance: nothing is counted twice, nothing is lost."""
    node = scene.objects["Surface"].material_slots[0].material.node_tree.nodes["NIM Interface"]
    node.inputs["Index Inside"].default_value, node.inputs["Permeability Inside"].default_value = n, math.copysign(1, n)
    scene.cycles.max_bounces = 1024
    glow = tuple(-np.array(SUN.direction)), tuple(np.array(SUN.irradiance) / surfaces.gaussian(5.0)), 5.0
    scene.world = surfaces.sky("Sun", (0, 0, 0), (0, 0, 0), glow=glow)
    scene.world.cycles.sampling_method = "NONE"  # by chance, through the interface and past it alike
    small = 32
    scene.render.resolution_x = scene.render.resolution_y = small
    scene.cycles.samples = 4096
    traced = render(scene)[..., 1]
    caustics.bake(scene, texels=256, photons=48 << 16)
    scene.cycles.samples = 64
    baked = render(scene)[..., 1]
    blocks = [picture.reshape(4, 8, 4, 8).swapaxes(1, 2).reshape(16, 64) for picture in (traced, baked)]
    # the noise of the path tracer, from pixels of nearly the same light
    noise = np.sqrt(np.mean(np.diff(traced, axis=0) ** 2) / 2 / 64)
    off = blocks[0].mean(axis=1) - blocks[1].mean(axis=1)
    assert traced.mean() > 0.2 and np.ptp(blocks[0].mean(axis=1)) > 0.1
    assert noise < 0.02 * traced.mean()
    assert np.sqrt(np.mean(off**2)) < 1.5 * noise
    assert abs(off.mean()) < 3 * noise / 4


def test_clearing_gives_the_scene_back(scene):
    names = {
        kind: sorted(one.name for one in getattr(bpy.data, kind))
        for kind in ("objects", "meshes", "materials", "lights")
    }
    caustics.bake(scene, [SUN], texels=64, photons=1 << 13)
    assert scene.objects["Floor"].hide_render
    caustics.bake(scene, [SUN], texels=64, photons=1 << 13)  # again, in place of the former
    assert (
        len([thing for thing in scene.objects if thing.get(caustics.CAUSTICS_MARK)]) == 2
    )  # the floor's copy and the lamp
    caustics.clear(scene)
    assert not scene.objects["Floor"].hide_render
    assert not [image for image in bpy.data.images if image.name.startswith(caustics.COLLECTION)]
    assert {kind: sorted(one.name for one in getattr(bpy.data, kind)) for kind in names} == names


def test_a_bake_lives_in_the_file(scene, render, tmp_path):
    caustics.bake(scene, [SUN], texels=128, photons=1 << 15)
    before = render(scene)
    path = str(tmp_path / "baked.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    after = render(bpy.data.scenes["NIM surface"])
    assert before.max() > 0.1
    assert np.abs(after - before).max() < 1e-5


def test_the_suns_own_scenes_give_their_sun_to_the_photons(empty_file):
    for build, parameters, irradiance in (
        (pool.build, pool.PoolParameters.read(["sky=sunny"]), pool.SUN_IRRADIANCE),
        (sphere.build, sphere.SphereParameters(), sphere.SUN_IRRADIANCE),
        (glass.build, glass.GlassParameters(), glass.SUN_IRRADIANCE),
    ):
        sun = lights.sun_of(build(parameters, "nodes"))
        assert sun.irradiance == pytest.approx(irradiance, rel=1e-6)
        assert math.degrees(sun.angle) == pytest.approx(parameters.sun_angle)
    assert lights.sun_of(pool.build(pool.PoolParameters(), "nodes")) is None


@pytest.mark.parametrize("setting", ["sun_angle=0.53", "sun_angle=16"])
def test_a_narrow_sun_is_traced_a_wide_one_found_by_chance(setting, empty_file):
    scene = sphere.build(sphere.SphereParameters.read([setting]), "nodes")
    assert caustics.best_way(scene) == ("traced" if setting == "sun_angle=0.53" else "path")
    bpy.data.objects.remove(scene.objects["Sphere"])
    assert caustics.best_way(scene) == "path"  # nothing bends the sun's light


def test_a_bake_that_was_stopped_goes_on(scene, tmp_path):
    """The sums that are kept are the sums that would have been, and the file of another bake is no help."""
    options = {"texels": 64, "photons": 1 << 14}
    sun = [SUN._replace(gaussian=True)]  # many passes
    file = tmp_path / "state"
    with caustics.Bake(scene, sun, **options) as whole:
        for _ in whole:
            pass
    with caustics.Bake(scene, sun, **options) as first:
        for done in first:
            if done == 10:
                first.save(file)
                break
    with caustics.Bake(scene, sun, **options) as second:
        assert second.load(file) and second.done == 10
        rounds = list(second)
    assert rounds == list(range(11, whole.total + 1))
    assert second.density.count.sum() == pytest.approx(whole.density.count.sum(), rel=1e-3)
    assert second.density.flux.sum() == pytest.approx(whole.density.flux.sum(), rel=1e-3)
    with caustics.Bake(scene, sun, seed=1, **options) as other:
        assert not other.load(file) and other.done == 0
    file.write_bytes(file.read_bytes()[:1000])
    with caustics.Bake(scene, sun, **options) as cut:
        assert not cut.load(file)


def test_a_state_that_is_damaged_is_none(scene, tmp_path):
    """Wherever it is: in what zip says of a part, in a part that is compressed, in the head of an array."""
    file, options = tmp_path / "state", {"texels": 16, "photons": 1 << 12}
    with caustics.Bake(scene, [SUN], **options) as one:
        next(iter(one))
        one.save(file)
    content = file.read_bytes()
    entry = content.index(b"PK\1\2")
    first = content.index(b".npy") + 20  # past what zip writes before the data
    with caustics.Bake(scene, [SUN], **options) as one:
        for place in (4, 6, 8, first, first + 10, entry + 6, entry + 8, entry + 10, *range(50, len(content), 97)):
            for value in (0, 9, 255):
                spoilt = bytearray(content)
                spoilt[place : place + 4] = [value] * 4
                file.write_bytes(spoilt)
                one.load(file)  # what zip does not look at changes nothing
        file.write_bytes(content[:entry] + bytes(len(content) - entry))
        assert not one.load(file)
        file.write_bytes(content)
        assert one.load(file)


def test_a_bake_is_kept_in_its_own_file_only(scene, tmp_path, one_sentence):
    """Another's link, of a name that can be guessed, was written through."""
    stranger = tmp_path / "stranger"
    stranger.write_text("theirs")
    for name in ("state", "state.part"):
        (tmp_path / name).symlink_to(stranger)
    options = {"texels": 64, "photons": 1 << 13}
    with caustics.Bake(scene, [SUN], **options) as one:
        next(iter(one))
        one.save(tmp_path / "state")
    assert stranger.read_text() == "theirs" and not (tmp_path / "state").is_symlink()
    with caustics.Bake(scene, [SUN], **options) as one:
        assert one.load(tmp_path / "state")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["state", "state.part", "stranger"]
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "fifo")  # which waits for ever for one who writes
    for name in ("folder", "fifo"):
        with pytest.raises(OSError) as raised:
            caustics.bake(scene, [SUN], file=tmp_path / name, **options)
        one_sentence(raised.value, f"{name} is no file", "name another")


def test_a_bake_knows_when_it_is_out_of_date(scene):
    caustics.bake(scene, [SUN], texels=64, photons=1 << 13)
    assert not caustics.out_of_date(scene)
    scene.camera.location.x += 1
    assert not caustics.out_of_date(scene)
    node = scene.objects["Surface"].material_slots[0].material.node_tree.nodes["NIM Interface"]
    node.inputs["Index Inside"].default_value = -1.5
    assert caustics.out_of_date(scene)
    node.inputs["Index Inside"].default_value = -1.33
    assert not caustics.out_of_date(scene)
    scene.objects["Surface"].location.z += 0.01
    assert caustics.out_of_date(scene)
    scene.objects["Surface"].location.z -= 0.01
    scene.objects["Floor"].data.vertices[0].co.z += 0.01
    assert caustics.out_of_date(scene)


def test_a_floor_without_area_is_refused(scene, one_sentence):
    scene.objects["Floor"].scale = (0, 0, 0)
    with pytest.raises(ValueError) as error:
        caustics.bake(scene, [SUN], photons=1 << 13)
    one_sentence(error.value, "Floor", "area")


@pytest.mark.parametrize("bare", ["none", "without nodes"])
def test_a_floor_without_a_material_of_nodes_takes_light_too(bare, scene, render):
    floor = scene.objects["Floor"].data
    if bare == "none":
        floor.materials.clear()
    else:
        floor.materials[0] = bpy.data.materials.new("Bare")
    caustics.bake(scene, [SUN], texels=64, photons=1 << 16)
    for lamp in (thing for thing in scene.objects if thing.type == "LIGHT"):
        lamp.hide_render = True
    cosine = math.cos(THETA)
    through = cosine * (1 - float(Interface(Medium(-1.33)).fresnel(cosine).R)) / 1.33**2
    # Blender's own white is 0.8
    assert render(scene)[..., 0].sum() * (2 / 128) ** 2 == pytest.approx(through * 2.0 * 0.8 / math.pi, rel=0.02)


def test_light_that_lands_nowhere_is_told(scene, one_sentence):
    with pytest.raises(ValueError) as error:
        caustics.bake(scene, [SUN._replace(direction=(0, 0.001, 1))], photons=1 << 13)
    one_sentence(error.value, "no light lands")
    assert not caustics.baked(scene)
