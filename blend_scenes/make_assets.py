# SPDX-License-Identifier: GPL-3.0-or-later
"""Write the asset library, nim_addon/assets/nim_assets.blend (or into the folder given), with previews by the physics.

Materials, liquids, objects, scenes as collections, and the node group, all in Blender's own nodes, so that any build and
device can render them. The catalogs are those of blender_assets.cats.txt beside it. Each preview is a render of the sphere
scene's ground and sky with the asset on it, of graded balls in the ball scene's garden, or of the scene: some minutes in all.
"""

import os
import shutil
import sys
import tempfile
from pathlib import Path

# Blender notes the user's home folder in each file it saves
os.environ["HOME"] = "/"

import bpy
import numpy as np

from nim_addon.base.files import whole
from nim_addon.base.streams import quiet
from nim_addon.cycles.closures import INTERFACE
from nim_addon.cycles.graded import graded_ball_material
from nim_addon.cycles.lenslets import lenslet_material
from nim_addon.cycles.material import interface_material
from nim_addon.cycles.slabs import slab_material
from nim_addon.physics import MEDIA, Medium
from nim_addon.physics.graded import Profile
from nim_addon.physics.lenslet import LensletWindow
from nim_addon.physics.uniaxial import UniaxialSlab
from nim_addon.scenes import ball as ball_scene
from nim_addon.scenes import scene_type, shapes, sphere, surfaces
from nim_addon.scenes.stage import Stage

HOME = Path(__file__).resolve().parents[1] / "nim_addon" / "assets"
SIZE, ICON, SAMPLES = 128, 32, 128

# Names, the medium's name in MEDIA, and what a person reads.
MATERIALS = (
    ("Water", "water", "Water in air, n = 1.33"),
    ("Glass", "glass", "Glass in air, n = 1.5"),
    ("Diamond", "diamond", "Diamond in air, n = 2.418: reflects 17 % straight on"),
    ("NIM -1.025", "nim-1.025", "Negative-index material, n = -1.025: bends backwards and reflects almost nothing"),
    ("NIM -1.33", "nim-1.33", "Negative-index material, n = -1.33: the counterpart of water"),
    ("NIM -1.5", "nim-1.5", "Negative-index material, n = -1.5: the counterpart of glass"),
    ("NIM -2.418", "nim-2.418", "Negative-index material, n = -2.418: the counterpart of diamond"),
    ("NIM -4.1", "nim-4.1", "Negative-index material, n = -4.1: reflects 37 % straight on"),
    ("NIM -1.33, mu -10", "nim-mu10", "Negative-index material, n = -1.33, mu = -10: impedance 7.5, a strong mirror"),
    ("NIM -1.33, mu -25", "nim-mu25", "Negative-index material, n = -1.33, mu = -25: impedance 19, almost a mirror"),
)
# The same of what is poured: names of media that Medium.parse() knows.
LIQUIDS = (
    ("Water (measured)", "water-daimon", "Water at 20 °C: blue bends most, as in a rainbow"),
    (
        "NIM Liquid (causal)",
        "nim-causal",
        "A liquid of n = -1.33 at 550 nm: the least dispersion that causality allows",
    ),
    ("NIM Liquid (normal)", "nim-normal", "A liquid of n = -1.33 at 550 nm, of a small dispersion"),
)
# Names of collections, the scenes that they are, and what a person reads.
SCENES = (
    (
        "Glass of NIM with a Straw",
        "glass",
        "A glass that a NIM fills to the brim, with a straw in it that bends the other way",
    ),
    (
        "Flat Lens in its Frame",
        "lens",
        "A plate of n = -1 that shows what is behind it nearer, upright and of the same size",
    ),
)
# Names of graded balls, their profiles, and what a person reads.
BALLS = (
    ("Luneburg Lens", Profile("luneburg"), "A graded ball that shows the half space behind it, upside down"),
    ("Maxwell's Fish-Eye", Profile("fisheye"), "A graded ball: each point of its rim is seen at the opposite one"),
    ("Eaton Ball", Profile("eaton"), "A graded ball that sends all light back where it came from"),
    ("NIM Magnifier", Profile("magnifier"), "A mirror in a shell of a NIM, which makes it 1.25 times larger"),
)


def catalogs():
    """The catalogs' identifiers by the last word of their path."""
    lines = (HOME / "blender_assets.cats.txt").read_text().splitlines()
    rows = [line.split(":") for line in lines if line.count(":") == 2 and not line.startswith("#")]
    return {path.rpartition("/")[2]: identifier for identifier, path, _ in rows}


def stand():
    """The stage that previews are taken on, without an asset: the sphere scene's ground and sky, seen closer."""
    stage = Stage("assets", (SIZE, SIZE), "nodes")
    ground = surfaces.checker("Ground", (0.78, 0.70, 0.56), (0.11, 0.09, 0.075), 0.8)
    stage.mesh("Ground", *shapes.rectangle((-200, -200), (200, 200)), ground, location=(0.3, 0.2, 0))
    sky = surfaces.sky(
        "Sky", (0.62, 0.80, 1.0), (0.03, 0.14, 0.55), glow=((-0.56, -0.36, 0.75), (62.0, 54.0, 42.0), 8.0)
    )
    stage.world(sky, aim=256)
    stage.camera((0, -7.0, 1.9), (0, 0, 0.98), 20)
    stage.scene.cycles.samples = SAMPLES
    stage.scene.cycles.use_denoising = True
    return stage


def picture(scene):
    """Render a scene; (SIZE, SIZE, 4) floats as displayed, the first row at the bottom."""
    with tempfile.TemporaryDirectory() as work, quiet():
        scene.render.image_settings.file_format = "PNG"
        scene.render.filepath = str(Path(work, "preview.png"))
        bpy.ops.render.render(write_still=True, scene=scene.name)
        image = bpy.data.images.load(scene.render.filepath)
        pixels = np.array(image.pixels[:], np.float32).reshape(SIZE, SIZE, 4)
        bpy.data.images.remove(image)
    return pixels


def mark(data, catalog, description, tags, pixels):
    """Make a data-block an asset, with a preview and its icon."""
    data.use_fake_user = True
    data.asset_mark()
    about = data.asset_data
    about.catalog_id, about.description, about.license = catalog, description, "CC0-1.0"
    for tag in ("negative index", *tags):
        about.tags.new(tag, skip_if_exists=True)
    preview = data.preview_ensure()
    preview.image_size = (SIZE, SIZE)
    preview.image_pixels_float.foreach_set(pixels.ravel())
    small = pixels.reshape(ICON, SIZE // ICON, ICON, SIZE // ICON, 4).mean((1, 3))
    preview.icon_size = (ICON, ICON)
    preview.icon_pixels_float.foreach_set(small.astype(np.float32).ravel())


def things(stage, material):
    """The small objects, one standing at the middle of the stage: names, object, what a person reads."""
    ball = sphere.ball(stage, "NIM Sphere", (0, 0, 1.001), 1.0, material)
    slab = stage.mesh("NIM Slab", *shapes.box((-1.2, -0.25, 0), (1.2, 0.25, 1.6)), material, location=(0, 0, 0.001))
    slab.rotation_euler.z = 0.5
    corners = np.array([(-1.0, 0.0), (1.0, 0.0), (0.0, 1.732)])
    ends = [np.insert(corners, 1, y, axis=1) for y in (-0.75, 0.75)]
    faces = [(0, 1, 2), (5, 4, 3), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)]
    prism = stage.mesh("NIM Prism", np.concatenate(ends), faces, material, location=(0, 0, 0.001))
    prism.rotation_euler.z = 0.6
    return (
        (ball, "A sphere of 2 m, round at every distance: a lens that turns the picture and focuses within itself"),
        (slab, "A slab 0.5 m thick: shifts a beam to the other side, and refocuses what stands close to it"),
        (prism, "A prism of three equal sides of 2 m: sends light to the side that glass does not"),
    )


def garden():
    """The stage that graded balls are shown on: the ball scene's garden, with something to see behind the camera too."""
    stage = Stage("assets garden", (SIZE, SIZE), "nodes")
    ball_scene.garden(stage)
    parameters = ball_scene.BallParameters()
    stage.world(
        surfaces.sky("Garden Sky", ball_scene.HORIZON, ball_scene.ZENITH, glow=ball_scene.sun(parameters)), aim=256
    )
    stage.camera((0, -7.0, 1.9), (0, 0, 1.02), 19)
    stage.scene.cycles.samples = 2 * SAMPLES
    stage.scene.cycles.use_denoising = True
    return stage


def balls(stage):
    """Graded balls, as things() has its objects."""
    return tuple(
        (sphere.ball(stage, name, (0, 0, 1.001), 1.0, graded_ball_material(name, profile, backend="nodes")), what)
        for name, profile, what in BALLS
    )


def panes(stage):
    """Upright panes of other laws than Snell's, as things() has its objects."""
    low, high = (-1.2, 0.0), (1.2, 1.7)
    front, face = shapes.rectangle(low, high)
    window = stage.mesh(
        "Lenslet Window", front, face, lenslet_material("Lenslets", LensletWindow(-1.0), backend="nodes")
    )
    sides = [shapes.rectangle(low, high, z)[0] for z in (0.25, -0.25)]
    vertices, faces, _ = shapes.joined((sides[0], face), (sides[1], [face[0][::-1]]))
    material = slab_material("Hyperbolic Slab", UniaxialSlab(2.0, -3.0, 0.5), backend="nodes")
    slab = stage.mesh("Hyperbolic Slab", vertices, faces, material)
    for pane, turn in ((window, 0.0), (slab, 0.6)):
        pane.location, pane.rotation_euler = (0, 0, 0.001), (np.pi / 2, 0, turn)
    return (
        (window, "A window of lenslets of eta -1: what is behind it floats before it, upright and larger"),
        (slab, "A slab of permittivity 2 across and -3 along its normal: all is seen twice, once bent backwards"),
    )


def pictured(stage, shown, catalog):
    """Make assets of objects on a stage, each with a picture of it alone there; returns the objects."""
    for thing, description in shown:
        for other, _ in shown:
            other.hide_render = other is not thing
        mark(thing, catalog, description, ("NIM", "shape"), picture(stage.scene))
    for thing, _ in shown:
        thing.hide_render = False
        thing.rotation_euler.z = 0
        without_marks(thing)
    return [thing for thing, _ in shown]


def collections():
    """The scenes, each as a collection without a camera: collections, what a person reads, and their pictures."""
    for name, word, description in SCENES:
        kind = scene_type(word)
        scene = kind.build(kind.parameters(), "nodes")
        scene.render.resolution_x = scene.render.resolution_y = SIZE
        scene.cycles.samples, scene.cycles.use_denoising = SAMPLES, True
        pixels = picture(scene)
        (collection,) = scene.collection.children
        collection.name = name
        for obj in [obj for obj in collection.objects if obj.type == "CAMERA"]:
            bpy.data.objects.remove(obj)
        without_marks(collection, *collection.objects)
        yield collection, description, pixels


def without_marks(*those):
    """Take the stage's marks off data-blocks: they are on none now."""
    for data in those:
        for key in list(data.keys()):
            del data[key]


def main(folder):
    """Make everything, and write it."""
    with quiet():
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    catalog = catalogs()
    stage = stand()
    made = []
    ball = sphere.ball(stage, "Ball", (0, 0, 1.001), 1.0, bpy.data.materials.new("Bare"))
    for name, medium, description in MATERIALS:
        material = interface_material(name, MEDIA[medium], backend="nodes")
        ball.data.materials.clear()
        ball.data.materials.append(material)
        kind = "NIM" if MEDIA[medium].is_nim else "dielectric"
        # the light that a strong mirror keeps inside for long is rare, and bright
        stage.scene.cycles.samples = SAMPLES * (1 if abs(MEDIA[medium].mu) == 1 else 4)
        mark(material, catalog["Materials"], description, (kind, "refraction"), picture(stage.scene))
        made.append(material)
    stage.scene.cycles.samples = SAMPLES
    for name, medium, description in LIQUIDS:
        material = interface_material(name, Medium.parse(medium), backend="nodes")
        ball.data.materials[0] = material
        mark(material, catalog["Liquids"], description, ("liquid", "dispersion"), picture(stage.scene))
        made.append(material)
    material = bpy.data.materials["NIM -1.5"]
    group = INTERFACE.group("nodes")
    what = "An interface between two media of any index and permeability, in Blender's own nodes"
    ball.data.materials[0] = material
    bpy.data.objects["Ground"].data.materials[0] = surfaces.checker("Paper", (0.9, 0.9, 0.9), (0.05, 0.2, 0.35), 0.4)
    mark(group, catalog["Node Groups"], what, ("NIM", "interface"), picture(stage.scene))
    made.append(group)
    bpy.data.objects["Ground"].data.materials[0] = bpy.data.materials["Ground"]
    bpy.data.objects.remove(ball)
    shown = (*things(stage, material), *panes(stage))
    # something to see through flat faces
    sphere.ball(stage, "Red", (0.5, 2.2, 0.6), 0.6, surfaces.plain("Red", (0.75, 0.03, 0.02)))
    stage.camera((0, -7.0, 2.6), (0, 0, 0.8), 26)
    made += pictured(stage, shown, catalog["Objects"])
    stage = garden()
    made += pictured(stage, balls(stage), catalog["Objects"])
    for collection, description, pixels in collections():
        mark(collection, catalog["Scenes"], description, ("scene", "refraction"), pixels)
        made.append(collection)
    with tempfile.TemporaryDirectory() as work, quiet():
        file = Path(work, "nim_assets.blend")
        bpy.data.libraries.write(str(file), set(made), fake_user=True, compress=True)
        whole(folder / "nim_assets.blend", lambda part: shutil.copy(file, part))
    print(f"nim_assets.blend, {len(made)} assets, {(folder / 'nim_assets.blend').stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else HOME)
