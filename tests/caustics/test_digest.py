# SPDX-License-Identifier: GPL-3.0-or-later
"""What makes baked caustics out of date, and what does not: a bake that was saved, opened again, and one thing changed."""

import bpy
import numpy as np
import pytest

from nim_addon import caustics
from nim_addon.caustics import baking
from nim_addon.caustics.digest import digest, forget_changed
from nim_addon.cycles.material import interface_material
from nim_addon.cycles.nodes import Nodes, empty_tree
from nim_addon.physics import Medium
from nim_addon.scenes import shapes

AT = 20.0  # metres from the origin


def put(name, data, location=(0, 0, 0), collection=None):
    thing = bpy.data.objects.new(name, data)
    thing.location = location
    (collection or bpy.context.scene.collection).objects.link(thing)
    return thing


def solid(name, shape, *materials):
    data = bpy.data.meshes.new(name)
    data.from_pydata(np.asarray(shape[0]).tolist(), [], shape[1])
    for material in materials:
        data.materials.append(material)
    return data


def bumpy():
    """A NIM whose n is a Value node's, and whose normals are those of a group within a group."""
    material = interface_material("NIM", Medium(-1.5), backend="nodes")
    tree = material.node_tree
    nodes = Nodes(tree)
    value = nodes.add("ShaderNodeValue")
    value.name, value.outputs[0].default_value = "Own n", -1.5
    interface = tree.nodes["NIM Interface"]
    nodes.feed(interface.inputs["Index Inside"], value.outputs[0])
    groups = []
    for name in ("Inner", "Outer"):
        group = bpy.data.node_groups.new(name, "ShaderNodeTree")
        group.interface.new_socket("Normal", in_out="OUTPUT", socket_type="NodeSocketVector")
        inner = Nodes(group)
        if groups:
            source = inner.add("ShaderNodeGroup", node_tree=groups[0]).outputs[0]
        else:
            noise = inner.add("ShaderNodeTexNoise").outputs[0]
            source = inner.add("ShaderNodeBump", inputs={"Strength": 0.1, "Height": noise}).outputs[0]
        inner.add("NodeGroupOutput", inputs={0: source})
        groups.append(group)
    nodes.feed(interface.inputs["Normal"], nodes.add("ShaderNodeGroup", node_tree=groups[1]).outputs[0])
    return material


def glass():
    material = bpy.data.materials.new("Glass")
    nodes = Nodes(empty_tree(material))
    value = nodes.add("ShaderNodeValue")
    value.name, value.outputs[0].default_value = "Own IOR", 1.5
    nodes.end(nodes.add("ShaderNodeBsdfGlass", inputs={"Roughness": 0.0, "IOR": value.outputs[0]}))
    return material


def paint():
    material = bpy.data.materials.new("Paint")
    image = bpy.data.images.new("Tiles", 4, 4)
    image.pixels = [0.5] * 64
    image.pack()
    nodes = Nodes(empty_tree(material))
    ramp = nodes.add("ShaderNodeValToRGB", inputs={0: nodes.add("ShaderNodeTexImage", image=image).outputs[0]})
    mine = nodes.add("ShaderNodeAttribute", attribute_name="mine", attribute_type="OBJECT").outputs["Fac"]
    color = nodes.scale(ramp.outputs[0], mine)
    nodes.end(nodes.add("ShaderNodeBsdfPrincipled", inputs={"Base Color": color}))
    return material


def make():
    scene = bpy.context.scene
    nim = bumpy()
    ball = put("Ball", solid("Ball", shapes.cube_sphere(4), nim, glass()), (AT, 0, 2))
    ball.shape_key_add(name="Basis")
    ball.shape_key_add(name="Key").data[0].co.z += 0.5
    hook = put("Hook", None, (AT, 0, 3))
    bend = ball.modifiers.new("Hook", "HOOK")
    bend.object = hook
    bend.vertex_indices_set([0, 1, 2])
    displace = ball.modifiers.new("Displace", "DISPLACE")
    displace.strength, displace.texture = 0.1, bpy.data.textures.new("Clouds", "CLOUDS")
    cut = ball.modifiers.new("Cut", "BOOLEAN")
    cutter = put("Cutter", solid("Cutter", shapes.box((-0.3, -0.3, -0.3), (0.3, 0.3, 0.3))), (AT, 0, 3))
    cut.object, cutter.hide_render = cutter, True
    stored = bpy.data.collections.new("Stored")
    put("Lens", solid("Lens", shapes.cube_sphere(2), nim), collection=stored)
    instance = put("Instance", None, (AT + 2.5, 0, 2))
    instance.instance_type, instance.instance_collection = "COLLECTION", stored
    slide = put("Slide", solid("Slide", shapes.cube_sphere(2), nim), (AT - 2.5, 0, 2))
    for frame, x in ((1, AT - 2.5), (10, AT - 2.0)):
        slide.location.x = x
        slide.keyframe_insert("location", frame=frame)
    floor = put("Floor", solid("Floor", shapes.rectangle((-6, -6), (6, 6)), paint()), (AT, 0, 0))
    floor.data.uv_layers.new(name="UVMap")
    floor["mine"] = 0.5
    for name in ("Sun", "Second"):
        sun = put(name, bpy.data.lights.new(name, "SUN"), (AT, 0, 6))
        nodes = Nodes(empty_tree(sun.data))
        nodes.end(nodes.add("ShaderNodeEmission", inputs={"Strength": 1.0}), "Light")
    paths = put("Light paths", solid("Light paths", shapes.cube_sphere(2)), (0, 0, 40))
    paths["nim_light_paths"] = "sun"
    scene.camera = put("Camera", bpy.data.cameras.new("Camera"), (0, 0, 9))
    return scene


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A baked scene in a file."""
    path = tmp_path_factory.mktemp("digest") / "baked.blend"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(baking, "TRIAL_PHOTONS", 1 << 12)
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        scene = make()
        scene.frame_set(1)
        caustics.bake(scene, photons=1 << 12, texels=64)
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.fixture
def scene(file):
    bpy.ops.wm.open_mainfile(filepath=str(file))
    return bpy.context.scene


def node(material, name):
    return bpy.data.materials[material].node_tree.nodes[name]


def thing(name):
    return bpy.context.scene.objects[name]


def repaint():
    image = bpy.data.images["Tiles"]
    image.pixels = [0.25] * 64
    image.pack()


def sharpen():
    layer = thing("Slide").data.attributes.new("sharp_edge", "BOOLEAN", "EDGE")
    layer.data[0].value = True


def link_light():
    chosen = bpy.data.collections.new("Lit")
    chosen.objects.link(thing("Floor"))
    thing("Sun").light_linking.receiver_collection = chosen


CHANGES = {
    "bump strength": lambda: setattr(
        bpy.data.node_groups["Inner"].nodes["Bump"].inputs["Strength"], "default_value", 0.2
    ),
    "a Value node into n": lambda: setattr(node("NIM", "Own n").outputs[0], "default_value", -1.6),
    "a Value node into Glass's IOR": lambda: setattr(node("Glass", "Own IOR").outputs[0], "default_value", 1.6),
    "a Displace texture": lambda: setattr(bpy.data.textures["Clouds"], "noise_scale", 0.1),
    "a Boolean cutter": lambda: setattr(thing("Cutter").location, "x", AT + 0.1),
    "a hook": lambda: setattr(thing("Hook").location, "z", 3.5),
    "a moved instance": lambda: setattr(thing("Instance").location, "x", AT + 2.4),
    "what is instanced": lambda: setattr(bpy.data.meshes["Lens"].vertices[0].co, "z", -0.9),
    "a shape key's value": lambda: setattr(bpy.data.shape_keys[0].key_blocks["Key"], "value", 0.5),
    "a shape key's shape": lambda: setattr(bpy.data.shape_keys[0].key_blocks["Basis"].data[7].co, "z", 0.7),
    "lamp nodes": lambda: setattr(
        bpy.data.lights["Sun"].node_tree.nodes["Emission"].inputs["Strength"], "default_value", 2.0
    ),
    "another lamp's nodes": lambda: setattr(
        bpy.data.lights["Second"].node_tree.nodes["Emission"].inputs["Strength"], "default_value", 2.0
    ),
    "a lamp in what is instanced": lambda: bpy.data.collections["Stored"].objects.link(thing("Second")),
    "material index": lambda: setattr(thing("Ball").data.polygons[0], "material_index", 1),
    "shade smooth": lambda: thing("Slide").data.shade_smooth(),
    "a sharp edge": sharpen,
    "another frame": lambda: bpy.context.scene.frame_set(10),
    "a node's noise": lambda: setattr(bpy.data.node_groups["Inner"].nodes["Noise Texture"], "noise_dimensions", "2D"),
    "a link": lambda: node("NIM", "NIM Interface").id_data.links.remove(
        node("NIM", "NIM Interface").inputs["Normal"].links[0]
    ),
    "tint": lambda: setattr(node("NIM", "NIM Interface").inputs["Tint"], "default_value", (1, 0.5, 1, 1)),
    "a floor's image": repaint,
    "a floor's ramp": lambda: setattr(node("Paint", "Color Ramp").color_ramp.elements[0], "position", 0.2),
    "a floor's UV": lambda: setattr(thing("Floor").data.uv_layers[0].uv[0].vector, "x", 0.3),
    "a floor's own property": lambda: thing("Floor").__setitem__("mine", 0.75),
    "a hidden floor's place": lambda: setattr(thing("Floor").location, "z", -0.1),
    "a hidden floor's shape": lambda: setattr(thing("Floor").data.vertices[0].co, "z", -0.1),
    "a move of a thousandth of a thousandth": lambda: setattr(thing("Slide").delta_location, "z", 2e-5),
    "another size": lambda: setattr(thing("Slide"), "scale", (1.01, 1.01, 1.01)),
    "mirrored": lambda: setattr(thing("Floor"), "scale", (1, 1, -1)),
    "a modifier that renders skip": lambda: setattr(thing("Ball").modifiers["Displace"], "show_render", False),
    "a material in the object's slot": lambda: (
        setattr(thing("Slide").material_slots[0], "link", "OBJECT"),
        setattr(thing("Slide").material_slots[0], "material", bpy.data.materials["Glass"]),
    ),
    "an override of the view layer": lambda: setattr(
        bpy.context.view_layer, "material_override", bpy.data.materials["Glass"]
    ),
    "hidden from renders": lambda: setattr(thing("Slide"), "hide_render", True),
    "without shadow": lambda: setattr(thing("Slide"), "visible_shadow", False),
    "another thing": lambda: put("Roof", solid("Roof", shapes.rectangle((-1, -1), (1, 1))), (AT, 0, 4)),
    "a lamp's energy": lambda: setattr(bpy.data.lights["Sun"], "energy", 4.0),
    "a lamp's way": lambda: setattr(thing("Sun"), "rotation_euler", (0.1, 0, 0)),
    "a lamp's linking": link_light,
    "a sun in the sky": lambda: (
        setattr(bpy.context.scene, "world", bpy.data.worlds.new("Sky")),
        bpy.context.scene.world.__setitem__("nim_sun", [0.0, 0.0, -1.0, 1.0, 1.0, 1.0, 0.01]),
    ),
}


def reroute():
    tree = bpy.data.materials["Glass"].node_tree
    link = node("Glass", "Own IOR").outputs[0].links[0]
    dot, end = tree.nodes.new("NodeReroute"), link.to_socket
    tree.links.new(node("Glass", "Own IOR").outputs[0], dot.inputs[0])
    tree.links.new(dot.outputs[0], end)


def there_and_back():
    for step in (0.1, 0.2, -0.3):
        thing("Instance").location.x += step
        bpy.context.view_layer.update()


OTHERS = {
    "nothing": lambda: None,
    "names": lambda: [
        setattr(one, "name", f"Other {one.name}")
        for one in (
            thing("Ball"),
            thing("Floor"),
            thing("Instance"),
            thing("Sun"),
            bpy.data.meshes["Ball"],
            *bpy.data.materials,
        )
    ],
    "selection": lambda: thing("Ball").select_set(True),
    "the active object": lambda: setattr(bpy.context.view_layer.objects, "active", thing("Ball")),
    "selected vertices": lambda: setattr(thing("Ball").data.vertices[0], "select", False),
    "how it is drawn": lambda: (
        setattr(thing("Ball"), "display_type", "WIRE"),
        setattr(thing("Ball"), "show_name", True),
        setattr(bpy.data.materials["NIM"], "diffuse_color", (1, 0, 0, 1)),
    ),
    "hidden in viewports": lambda: setattr(thing("Slide"), "hide_viewport", True),
    "the eye": lambda: thing("Slide").hide_set(True),
    "a modifier in viewports": lambda: setattr(thing("Ball").modifiers["Displace"], "show_viewport", False),
    "a modifier's panel": lambda: setattr(thing("Ball").modifiers["Displace"], "show_expanded", False),
    "the camera": lambda: setattr(thing("Camera").location, "x", 3.0),
    "the size of the picture": lambda: setattr(bpy.context.scene.render, "resolution_x", 77),
    "samples": lambda: setattr(bpy.context.scene.cycles, "samples", 7),
    "light paths": lambda: setattr(thing("Light paths").location, "x", 7.0),
    "a node's place": lambda: (
        setattr(node("Glass", "Own IOR"), "location", (7, 7)),
        setattr(node("Glass", "Own IOR"), "label", "Mine"),
        setattr(node("Glass", "Own IOR"), "name", "Mine"),
    ),
    "a node that is linked to nothing": lambda: bpy.data.materials["NIM"].node_tree.nodes.new("ShaderNodeBsdfDiffuse"),
    "a reroute": reroute,
    "a lamp by chance": lambda: setattr(bpy.data.lights["Sun"].cycles, "use_multiple_importance_sampling", True),
    "what no render shows": lambda: setattr(
        put("Hidden", solid("Hidden", shapes.box((0, 0, 0), (1, 1, 1)))), "hide_render", True
    ),
    "there and back": there_and_back,
    "minus nothing": lambda: setattr(thing("Floor").location, "y", -0.0),
    "a frame at which all is the same": lambda: (
        thing("Slide").animation_data_clear(),
        setattr(thing("Slide"), "location", (AT - 2.5, 0, 2)),
        bpy.context.scene.frame_set(10),
    ),
}


@pytest.mark.parametrize("change", CHANGES)
def test_what_makes_it_out_of_date(change, scene):
    CHANGES[change]()
    assert caustics.out_of_date(scene)


@pytest.mark.parametrize("change", OTHERS)
def test_what_does_not(change, scene):
    OTHERS[change]()
    assert not caustics.out_of_date(scene)


def test_numbers_of_nodes_are_those_of_the_frame(scene):
    source = node("NIM", "Own n").outputs[0]
    for frame, value in ((1, -1.5), (10, -1.6)):
        source.default_value = value
        source.keyframe_insert("default_value", frame=frame)
    thing("Slide").animation_data_clear()
    scene.frame_set(1)
    assert not caustics.out_of_date(scene)
    scene.frame_set(10)
    assert caustics.out_of_date(scene)
    scene.frame_set(1)
    assert not caustics.out_of_date(scene)


def test_a_bake_of_a_lamp_that_lights_some_things_only_is_up_to_date(scene, monkeypatch):
    monkeypatch.setattr(baking, "TRIAL_PHOTONS", 1 << 10)
    chosen = bpy.data.collections.new("Lit")
    for name in ("Floor", "Ball", "Slide", "Lens", "Light paths"):
        chosen.objects.link(bpy.data.objects[name])
    thing("Sun").light_linking.receiver_collection = chosen
    caustics.bake(scene, photons=1 << 10, texels=32)
    assert not caustics.out_of_date(scene)
    chosen.objects.unlink(thing("Floor"))
    assert caustics.out_of_date(scene)


STOPPED = ("bump strength", "a moved instance", "a hook", "lamp nodes", "another frame")


@pytest.mark.parametrize("change", STOPPED)
def test_a_bake_that_was_stopped_does_not_go_on_with_what_was_of_something_else(change, scene, tmp_path, monkeypatch):
    monkeypatch.setattr(baking, "TRIAL_PHOTONS", 1 << 10)
    options, state = {"photons": 1 << 10, "texels": 32}, tmp_path / "state"
    with caustics.Bake(scene, **options) as first:
        next(iter(first))
        first.save(state)
    with caustics.Bake(scene, **options) as same:
        assert same.load(state)
    CHANGES[change]()
    with caustics.Bake(scene, **options) as other:
        assert not other.load(state)


def test_a_bake_that_was_stopped_goes_on_where_the_floor_has_another_name(scene, tmp_path, monkeypatch):
    # as it has in another file that it is appended to
    monkeypatch.setattr(baking, "TRIAL_PHOTONS", 1 << 10)
    options, state = {"photons": 1 << 14, "texels": 32}, tmp_path / "state"
    with caustics.Bake(scene, **options) as first:
        next(iter(first))
        first.save(state)
        power = first.density.power(1)
    assert power["Floor"] > 0
    thing("Floor").name = "Ground"
    with caustics.Bake(scene, **options) as other:
        assert other.load(state)
        assert other.density.power(1) == {"Ground": power.pop("Floor"), **power}


def test_meshes_are_read_again_only_where_they_have_changed(scene, monkeypatch):
    from nim_addon.caustics import digest as module

    read, marks = [], {}
    original = module.mesh_mark
    monkeypatch.setattr(module, "mesh_mark", lambda mesh: read.append(mesh.name) or original(mesh))

    def handler(scene, depsgraph):
        forget_changed(marks, depsgraph)

    bpy.app.handlers.depsgraph_update_post.append(handler)
    try:

        def mark():
            read.clear()
            bpy.context.view_layer.update()
            wanted, count = digest(scene), len(read)
            bpy.context.view_layer.update()
            read.clear()
            assert digest(scene, marks) == wanted
            return count

        whole = mark()
        assert len(read) == whole == 4
        mark()
        assert set(read) == {"Floor"}  # it is hidden while its copy shines, and evaluated anew
        thing("Slide").location.z += 0.5
        mark()
        assert set(read) == {"Floor"}
        thing("Slide").data.vertices[0].co.x += 0.1
        bpy.context.view_layer.update()
        assert thing("Slide").session_uid not in {key[0] for key in marks}
        mark()
        assert set(read) == {"Floor", "Slide"}
        thing("Hook").location.z += 0.1
        mark()
        assert set(read) == {"Floor", "Ball"}
        bpy.data.objects.remove(thing("Slide"))
        mark()
        put("Late", solid("Late", shapes.cube_sphere(2)), (AT, 0, 4))
        mark()
        assert set(read) == {"Floor", "Late"}
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(handler)
