"""What a render shows: objects and instances with the materials they wear, and nodes through the groups they are in."""

import bpy
import pytest

from nim_addon.cycles import visibility
from nim_addon.cycles.material import asked_interfaces, interface_node, interface_of
from nim_addon.cycles.nodes import empty_tree
from nim_addon.cycles.visibility import as_rendered, asked, shown, value_of
from nim_addon.physics import Interface, Medium


def box(scene, material=None, slot="DATA"):
    mesh = bpy.data.meshes.new("Box")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    thing = bpy.data.objects.new("Box", mesh)
    scene.collection.objects.link(thing)
    mesh.materials.append(None)
    thing.material_slots[0].link = slot
    thing.material_slots[0].material = material
    return thing


def seen(scene):
    with as_rendered(scene) as depsgraph:
        return [
            (one.original.name, [m and m.name for m in one.materials], one.single) for one in shown(scene, depsgraph)
        ]


def test_what_was_shown_can_be_kept(scene, nim):
    """Blender hands out each instance in the place of the one before the last."""
    held = bpy.data.collections.new("Held")
    for size in (3, 4, 5):
        mesh = bpy.data.meshes.new("Fan")
        mesh.from_pydata([(k, k * k, 0) for k in range(size)], [], [range(size)])
        held.objects.link(bpy.data.objects.new(f"Fan {size}", mesh))
    maker = bpy.data.objects.new("Maker", None)
    maker.instance_type, maker.instance_collection = "COLLECTION", held
    scene.collection.objects.link(maker)
    with as_rendered(scene) as depsgraph:
        kept = list(shown(scene, depsgraph))
        assert [(one.object.name, len(one.mesh.vertices)) for one in kept] == [("Fan 3", 3), ("Fan 4", 4), ("Fan 5", 5)]


@pytest.mark.parametrize("slot", ["DATA", "OBJECT"])
def test_materials_of_either_slot(scene, nim, slot):
    box(scene, nim, slot)
    assert seen(scene) == [("Box", ["NIM"], True)]


def test_material_override_of_the_view_layer(scene, nim):
    box(scene)
    scene.view_layers[0].material_override = nim
    assert seen(scene) == [("Box", ["NIM"], True)]


def geometry(thing, make):
    """Give an object a modifier of geometry nodes; make(tree, geometry) returns what comes out. Returns the modifier."""
    tree = bpy.data.node_groups.new("Wear", "GeometryNodeTree")
    for in_out in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    enter, leave = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    tree.links.new(make(tree, enter.outputs[0]), leave.inputs[0])
    modifier = thing.modifiers.new("Wear", "NODES")
    modifier.node_group = tree
    return modifier


def set_material(material):
    """For geometry(): all of it is of that material."""

    def make(tree, came):
        wear = tree.nodes.new("GeometryNodeSetMaterial")
        wear.inputs["Material"].default_value = material
        tree.links.new(came, wear.inputs["Geometry"])
        return wear.outputs[0]

    return make


def instances_of(held):
    """For geometry(): an instance of a collection at each point."""

    def make(tree, came):
        info, scatter = tree.nodes.new("GeometryNodeCollectionInfo"), tree.nodes.new("GeometryNodeInstanceOnPoints")
        info.inputs["Collection"].default_value = held
        tree.links.new(came, scatter.inputs["Points"])
        tree.links.new(info.outputs[0], scatter.inputs["Instance"])
        return scatter.outputs[0]

    return make


def test_set_material_of_geometry_nodes(scene, nim):
    thing = box(scene)
    geometry(thing, set_material(nim))
    assert "NIM" in seen(scene)[0][1]


def in_a_group(nim):
    def make(tree, came):
        inner = bpy.data.node_groups.new("Inner", "GeometryNodeTree")
        for in_out in ("INPUT", "OUTPUT"):
            inner.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
        enter, leave = inner.nodes.new("NodeGroupInput"), inner.nodes.new("NodeGroupOutput")
        inner.links.new(set_material(nim)(inner, enter.outputs[0]), leave.inputs[0])
        held = tree.nodes.new("GeometryNodeGroup")
        held.node_tree = inner
        tree.links.new(came, held.inputs[0])
        return held.outputs[0]

    return make


def given(thing, nim):
    """A modifier that is given the material as an input of its own."""
    modifier = geometry(thing, lambda tree, came: came)
    socket = modifier.node_group.interface.new_socket("Material", in_out="INPUT", socket_type="NodeSocketMaterial")
    if hasattr(modifier, "properties"):  # from 5.2
        getattr(modifier.properties.inputs, socket.identifier).value = nim
    else:
        modifier[socket.identifier] = nim


def held(scene, nim):
    collection = bpy.data.collections.new("Held")
    collection.objects.link(box(scene, nim))
    return collection


DECLARED = {
    "slot": lambda thing, nim: thing.data.materials.append(nim),
    "set": lambda thing, nim: geometry(thing, set_material(nim)),
    "within a group": lambda thing, nim: geometry(thing, in_a_group(nim)),
    "given to the modifier": given,
    "instances of a collection": lambda thing, nim: geometry(thing, instances_of(held(bpy.context.scene, nim))),
    "none": lambda thing, nim: thing.modifiers.new("Other", "SUBSURF"),
    "that of its parent": lambda thing, nim: (
        geometry(thing, lambda tree, came: came),
        setattr(thing, "parent", box(bpy.context.scene, nim)),
    ),
}


@pytest.mark.parametrize("way", DECLARED)
def test_what_an_object_may_wear_is_known_before_it_is_evaluated(scene, nim, way):
    thing = box(scene)
    thing.hide_viewport = True
    DECLARED[way](thing, nim)
    assert visibility.declared([thing]) == {thing: [] if way in ("none", "that of its parent") else [nim]}


def test_collection_instance(scene, nim):
    thing = box(scene, nim)
    held = bpy.data.collections.new("Held")
    scene.collection.objects.unlink(thing)
    held.objects.link(thing)
    empty = bpy.data.objects.new("Empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", held
    scene.collection.objects.link(empty)
    assert seen(scene) == [("Box", ["NIM"], False)] and visibility.declared([empty]) == {empty: [nim]}
    thing.hide_render = True
    assert visibility.declared([empty]) == {empty: []}
    assert seen(scene) == []
    thing.hide_render, empty.hide_render = False, True
    assert seen(scene) == []


def test_hidden_collection_is_not_shown_and_hidden_eye_is(scene, nim):
    thing = box(scene, nim)
    thing.hide_viewport = True
    assert len(seen(scene)) == 1
    layer = bpy.data.collections.new("Layer")
    scene.collection.children.link(layer)
    scene.collection.objects.unlink(thing)
    layer.objects.link(thing)
    layer.hide_render = True
    assert seen(scene) == []


def in_group(nim_values):
    """A material whose interface lies in a person's group, n and mu fed from the group's inputs."""
    inner = bpy.data.node_groups.new("Mine", "ShaderNodeTree")
    inner.interface.new_socket("n", in_out="INPUT", socket_type="NodeSocketFloat")
    inner.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    enter, leave = inner.nodes.new("NodeGroupInput"), inner.nodes.new("NodeGroupOutput")
    node = interface_node(inner, Medium(-1.2), backend="nodes")
    inner.links.new(enter.outputs["n"], node.inputs["Index Inside"])
    inner.links.new(node.outputs["BSDF"], leave.inputs["Shader"])
    material = bpy.data.materials.new("Holds")
    tree = empty_tree(material)
    outer = tree.nodes.new("ShaderNodeGroup")
    outer.node_tree = inner
    outer.inputs["n"].default_value = nim_values
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(outer.outputs["Shader"], output.inputs["Surface"])
    return material


def test_what_fails_while_it_is_made_ready_leaves_the_scene_as_it_was(scene, nim, monkeypatch):
    held = bpy.data.collections.new("Held")
    held.objects.link(box(scene, nim))
    scene.collection.children.link(held)
    layer = scene.view_layers[0].layer_collection.children["Held"]
    held.hide_viewport = layer.hide_viewport = True

    def fail(scene):
        raise KeyboardInterrupt

    monkeypatch.setattr(visibility, "rendered", fail)
    with pytest.raises(KeyboardInterrupt), as_rendered(scene):
        pass
    assert held.hide_viewport
    assert layer.hide_viewport


def test_interface_in_a_persons_group(scene):
    material = in_group(-2.0)
    ((node, path),) = asked_interfaces(material)
    assert [one.node_tree.name for one in path] == ["Mine"]
    assert interface_of(node, path) == Interface(Medium(-2.0))
    value = material.node_tree.nodes.new("ShaderNodeValue")
    value.outputs[0].default_value = -3.0
    material.node_tree.links.new(value.outputs[0], path[0].inputs["n"])
    assert interface_of(node, path) == Interface(Medium(-3.0))


def test_a_muted_group_and_an_unlinked_interface_are_not_asked(scene, nim):
    material = in_group(-2.0)
    next(node for node in material.node_tree.nodes if node.type == "GROUP").mute = True
    assert asked_interfaces(material) == []
    nim.node_tree.links.clear()
    assert asked(nim) == [] and asked_interfaces(nim) == []


def test_reroutes_and_value_nodes(scene, nim):
    tree = nim.node_tree
    node = asked_interfaces(nim)[0].node
    value, knee = tree.nodes.new("ShaderNodeValue"), tree.nodes.new("NodeReroute")
    value.outputs[0].default_value = -2.5
    tree.links.new(value.outputs[0], knee.inputs[0])
    tree.links.new(knee.outputs[0], node.inputs["Index Inside"])
    assert value_of(node.inputs["Index Inside"]) == -2.5
    assert interface_of(node) == Interface(Medium(-2.5))
    wave = tree.nodes.new("ShaderNodeTexWave")
    tree.links.new(wave.outputs[1], node.inputs["Index Inside"])
    assert value_of(node.inputs["Index Inside"]) is None and interface_of(node) is None


@pytest.mark.parametrize("modifier", [None, "DISPLACE", "SUBSURF"])
def test_an_object_that_is_edited_is_shown_as_a_render_has_it(scene, modifier):
    bpy.ops.mesh.primitive_cube_add()
    if modifier:
        bpy.context.object.modifiers.new("Modifier", modifier)

    def places():
        with as_rendered(scene) as depsgraph:
            return [[tuple(vertex.co) for vertex in one.mesh.vertices] for one in shown(scene, depsgraph)]

    outside = places()
    bpy.ops.object.mode_set(mode="EDIT")
    assert places() == outside and len(outside[0]) >= 8
    assert not modifier or bpy.context.object.modifiers[0].show_in_editmode == (modifier == "SUBSURF")
    bpy.ops.object.mode_set(mode="OBJECT")


@pytest.mark.parametrize("by", ["object", "collection"])
def test_what_only_the_viewport_hides_stands_where_its_keyframes_have_it(scene, nim, by):
    """Blender evaluates no keyframes of it as the frame changes, nor as it appears."""
    thing = box(scene, nim)
    if by == "collection":
        held = bpy.data.collections.new("Held")
        scene.collection.children.link(held)
        scene.collection.objects.unlink(thing)
        held.objects.link(thing)
    for frame, height in ((3, 7.0), (1, 0.0)):
        thing.location.z = height
        thing.keyframe_insert("location", frame=frame)
    scene.frame_set(1)
    (thing if by == "object" else held).hide_viewport = True
    for frame, height in ((3, 7.0), (1, 0.0)):
        scene.frame_set(frame)
        with as_rendered(scene) as depsgraph:
            (one,) = shown(scene, depsgraph)
            assert one.matrix.translation.z == height


def test_what_only_the_viewport_hides_is_as_its_keyframes_have_it(scene, nim):
    """Whether a render shows it, its data and its materials."""
    thing = box(scene, nim)
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    scene.collection.objects.link(lamp)
    value = nim.node_tree.nodes.new("ShaderNodeValue").outputs[0]
    for frame, number in ((3, 7.0), (1, 1.0)):
        lamp.data.energy = value.default_value = number
        thing.hide_render = number == 1.0
        for owner, path in ((lamp.data, "energy"), (value, "default_value"), (thing, "hide_render")):
            owner.keyframe_insert(path, frame=frame)
    scene.frame_set(1)
    thing.hide_viewport = lamp.hide_viewport = True
    for frame, number in ((3, 7.0), (1, 1.0)):
        scene.frame_set(frame)
        with as_rendered(scene) as depsgraph:
            assert bool(list(shown(scene, depsgraph))) == (number == 7.0)
            assert (lamp.data.energy, value.default_value) == (number, number)
