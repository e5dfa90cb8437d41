# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh made a NIM in one click, and given back exactly as it was."""

import bpy
import pytest

from nim_addon.cycles.material import interface_material, interface_nodes, interface_of
from nim_addon.cycles.nodes import empty_tree
from nim_addon.physics import Medium


def state(object_):
    """All that Restore Former Materials must restore of an object's materials."""
    object_ = bpy.data.objects[object_]
    slots = []
    for slot in object_.material_slots:
        link = slot.link
        slot.link = "OBJECT"
        slots.append((link, slot.material))
        slot.link = link
    return slots, list(object_.data.materials), [face.material_index for face in object_.data.polygons]


def is_nim(object_):
    return all(interface_nodes(slot.material) for slot in object_.material_slots) and len(object_.material_slots) > 0


def select(*objects):
    for object_ in bpy.context.view_layer.objects:
        object_.select_set(object_ in objects)
    bpy.context.view_layer.objects.active = objects[0] if objects else None


@pytest.fixture
def cube(addon):
    """The default cube with a second material on one face and an own material in the object's first slot."""
    cube = bpy.data.objects["Cube"]
    cube.data.materials.append(bpy.data.materials.new("Second"))
    cube.data.polygons[2].material_index = 1
    cube.material_slots[0].link = "OBJECT"
    cube.material_slots[0].material = bpy.data.materials.new("Own")
    select(cube)
    return cube


def test_one_click_and_back(cube, press):
    before = state("Cube")
    assert press("nim.convert") == {"FINISHED"}
    assert is_nim(cube) and interface_of(interface_nodes(cube.active_material)[0]).inside == Medium(-1.5)
    assert list(cube.data.materials) == before[1], "the mesh keeps its own"
    assert press("nim.revert") == {"FINISHED"}
    assert state("Cube") == before
    assert not [material for material in bpy.data.materials if interface_nodes(material)], "nothing is left over"


def test_undo_and_redo(cube, press):
    bpy.ops.ed.undo_push(message="before")
    press("nim.convert")
    bpy.ops.ed.undo()
    cube = bpy.data.objects["Cube"]
    assert not is_nim(cube) and not len(cube.nim.former)
    bpy.ops.ed.redo()
    cube = bpy.data.objects["Cube"]
    assert is_nim(cube) and len(cube.nim.former) == 2
    press("nim.revert")
    bpy.ops.ed.undo()
    assert is_nim(bpy.data.objects["Cube"])


def test_several_that_share_a_mesh_without_slots(addon, press):
    mesh = bpy.data.objects["Cube"].data
    mesh.materials.clear()
    twin = bpy.data.objects.new("Twin", mesh)
    bpy.context.collection.objects.link(twin)
    other = bpy.data.objects.new("Bystander", mesh)
    bpy.context.collection.objects.link(other)
    cube = bpy.data.objects["Cube"]
    for first, second in ((cube, twin), (twin, cube)):
        select(cube, twin)
        press("nim.convert")
        assert is_nim(cube) and is_nim(twin) and cube.active_material == twin.active_material
        assert other.active_material is None
        select(first)
        press("nim.revert")
        assert is_nim(second) and not is_nim(first)
        select(second)
        press("nim.revert")
        assert not mesh.materials and not cube.material_slots and not other.material_slots


def test_again_with_another_medium_keeps_what_was_first(cube, press):
    before = state("Cube")
    press("nim.convert")
    press("nim.convert", inside="custom", n_inside=-2.0, mu_inside=3.0, outside="water", replace=True)
    interface = interface_of(interface_nodes(cube.active_material)[0])
    assert interface.inside == Medium(-2.0, -3.0) and interface.outside.n == pytest.approx(1.33)
    press("nim.revert")
    assert state("Cube") == before


@pytest.fixture
def said(monkeypatch, addon):
    """What nim.convert reports, as pairs (kind, text)."""
    from nim_addon.ui.convert import NIM_OT_convert

    texts = []
    whole = NIM_OT_convert.execute

    class Told:
        def __init__(self, operator):
            self.operator = operator

        def __getattr__(self, name):
            return getattr(self.operator, name)

        def report(self, kind, text):
            texts.append((*kind, text))

    monkeypatch.setattr(NIM_OT_convert, "execute", lambda self, context: whole(Told(self), context))
    return texts


def wear(object_, material, slot=0, link="DATA"):
    object_.material_slots[slot].link = link
    object_.material_slots[slot].material = material


@pytest.mark.parametrize("link", ["DATA", "OBJECT"])
def test_what_is_one_already_stays_as_it_is_and_that_is_said(cube, press, said, link):
    mine = interface_material("Mine", Medium(-2.2), backend="nodes")
    wear(cube, mine, 0, link)  # the second slot is that of one face
    before, materials = state("Cube"), len(bpy.data.materials)
    assert press("nim.convert") == {"CANCELLED"}
    assert state("Cube") == before and len(bpy.data.materials) == materials and not len(cube.nim.former)
    assert said == [
        ("WARNING", "Cube is negative-index already, n = -2.2: it stays as it is; change n in the panel"),
    ]
    interface_nodes(mine)[0].inputs["Index Inside"].default_value = 0  # no index at all: it may be worked at
    assert press("nim.convert") == {"CANCELLED"}
    assert said[1][1] == "Cube has a NIM Interface material already, Mine: it stays as it is"
    assert press("nim.convert", replace=True) == {"FINISHED"}
    assert is_nim(cube) and cube.active_material != mine
    press("nim.revert")
    assert state("Cube") == before, "and is not lost"


def test_others_are_made_one_beside_it(cube, press, said):
    ball = bpy.data.objects.new("Ball", bpy.data.meshes.new("Ball"))
    ball.data.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    mine = interface_material("Mine", Medium(1.33), Medium(-2.2), backend="nodes")  # water in a NIM
    ball.data.materials.append(mine)
    bpy.context.collection.objects.link(ball)
    select(cube, ball)
    assert press("nim.convert") == {"FINISHED"}
    assert is_nim(cube) and ball.active_material == mine and not len(ball.nim.former)
    assert said == [
        (
            "WARNING",
            "1 made negative-index. Ball is negative-index already, n = -2.2: it stays as it is; change n in the panel",
        )
    ]


@pytest.mark.parametrize("way", ["glass", "a slot without faces"])
def test_what_is_none_yet_becomes_one(cube, press, way):
    mine = interface_material("Mine", Medium(1.5 if way == "glass" else -2.2), backend="nodes")
    wear(cube, mine, 1)
    if way != "glass":
        cube.data.polygons[2].material_index = 0
    assert press("nim.convert") == {"FINISHED"}
    assert {interface_of(interface_nodes(slot.material)[0]).inside.n for slot in cube.material_slots} == {-1.5}


def test_the_redo_panel_makes_another_of_what_was_none(cube, press):
    """As Blender redoes an operator: what it did is undone, and it runs again with other values."""
    bpy.ops.ed.undo_push(message="before")
    press("nim.convert")
    bpy.ops.ed.undo()
    assert press("nim.convert", inside="nim-4.1") == {"FINISHED"}
    cube = bpy.data.objects["Cube"]
    assert interface_of(interface_nodes(cube.active_material)[0]).inside.n == pytest.approx(-4.1)


def test_names_tell_no_index(cube, press):
    press("nim.convert")
    assert cube.active_material.name == "Cube Interface"
    for name in ("Sphere Interface", "Sphere Interface.001"):
        press("nim.add_object")
        assert bpy.context.object.active_material.name == name


def test_an_index_of_zero_changes_nothing(cube, press):
    before, materials = state("Cube"), len(bpy.data.materials)
    with pytest.raises(RuntimeError, match="n = 0 refracts nothing"):
        press("nim.convert", inside="custom", n_inside=0.0)
    assert state("Cube") == before and len(bpy.data.materials) == materials and not len(cube.nim.former)


def test_linked_objects_are_named_and_the_others_done(cube, press, tmp_path):
    from nim_addon.base.streams import quiet

    library = str(tmp_path / "library.blend")
    mesh = bpy.data.meshes.new("Faceless")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    with quiet():
        bpy.data.libraries.write(library, {bpy.data.objects.new("Linked", mesh)})
        with bpy.data.libraries.load(library, link=True) as (_, into):
            into.objects = ["Linked"]
    linked = into.objects[0]
    bpy.context.collection.objects.link(linked)
    wearer = bpy.data.objects.new("Wearer", linked.data)  # a local object, its mesh linked and without a slot
    bpy.context.collection.objects.link(wearer)
    select(cube, linked, wearer)
    assert press("nim.convert") == {"FINISHED"}
    assert is_nim(cube) and not is_nim(linked) and not is_nim(wearer) and not len(wearer.nim.former)
    select(linked)
    with pytest.raises(RuntimeError, match="Linked is linked from a library: make it local first"):
        press("nim.convert")


def test_it_survives_saving(cube, press, tmp_path):
    from nim_addon.base.streams import quiet

    press("nim.convert")
    file = str(tmp_path / "saved.blend")
    with quiet():
        bpy.ops.wm.save_as_mainfile(filepath=file)
        bpy.ops.wm.open_mainfile(filepath=file)
    select(bpy.data.objects["Cube"])
    assert is_nim(bpy.data.objects["Cube"])
    press("nim.revert")
    slots, meshs, faces = state("Cube")
    assert [(link, own and own.name) for link, own in slots] == [("OBJECT", "Own"), ("DATA", None)]
    assert [material.name for material in meshs] == ["Material", "Second"] and faces[2] == 1


def test_poll_says_why_not(addon, press):
    select()
    with pytest.raises(RuntimeError, match="Select an object with a surface first"):
        press("nim.convert")
    select(bpy.data.objects["Cube"])
    with pytest.raises(RuntimeError, match="None of the selected objects"):
        press("nim.revert")


# ------------------------------------------------------------------------------------------------ other objects than meshes


def add_tube():
    bpy.ops.curve.primitive_bezier_curve_add(location=(0, 0, 5))
    bpy.context.object.data.bevel_depth = 0.1


def add_flat_line(fill):
    bpy.ops.curve.primitive_bezier_circle_add(location=(0, 0, 5))
    curve = bpy.context.object.data
    curve.dimensions, curve.fill_mode = "2D", fill


OTHERS = {
    "filled": lambda: add_flat_line("BOTH"),
    "unfilled": lambda: add_flat_line("NONE"),
    "text": lambda: bpy.ops.object.text_add(location=(0, 0, 5)),
    "line": lambda: bpy.ops.curve.primitive_bezier_curve_add(location=(0, 0, 5)),
    "tube": add_tube,
    "surface": lambda: bpy.ops.surface.primitive_nurbs_surface_sphere_add(location=(0, 0, 5)),
    "metaball": lambda: bpy.ops.object.metaball_add(location=(0, 0, 5)),
}


def open_ones():
    from nim_addon import checks

    return [problem.objects for problem in checks.problems(bpy.context.scene) if problem.code == "open"]


@pytest.mark.parametrize("kind", OTHERS)
def test_what_is_no_mesh_becomes_one_that_is_closed_and_is_as_before_again(addon, press, kind):
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    OTHERS[kind]()
    thing = bpy.context.object

    def shape():
        names = ("extrude", "bevel_depth", "fill_mode", "use_fill_caps")
        return [getattr(thing.data, name, None) for name in names] + list(thing.data.materials)

    before, counts = shape(), census()
    assert press("nim.convert") == {"FINISHED"}
    assert is_nim(thing) and not open_ones()
    assert (shape()[:4] != before[:4]) == (kind in ("text", "line", "tube", "filled", "unfilled"))
    assert press("nim.revert") == {"FINISHED"}
    assert shape() == before and census() == counts


def test_a_text_stays_flat_where_that_is_wanted_or_others_share_it(addon, press):
    bpy.ops.object.text_add(location=(0, 0, 5))
    text = bpy.context.object
    press("nim.convert", close=False)
    assert is_nim(text) and text.data.extrude == 0 and ("Text",) in open_ones()
    press("nim.revert")
    bpy.context.collection.objects.link(bpy.data.objects.new("Twin", text.data))
    press("nim.convert")
    assert is_nim(text) and text.data.extrude == 0


def test_what_a_person_changed_of_a_text_since_stays(addon, press):
    bpy.ops.object.text_add()
    text = bpy.context.object
    press("nim.convert")
    text.data.extrude = 0.3
    press("nim.revert")
    assert text.data.extrude == pytest.approx(0.3)


def test_metaballs_that_melt_together_are_one(addon, press):
    bpy.ops.object.metaball_add(location=(0, 0, 5))
    head = bpy.context.object
    bpy.ops.object.metaball_add(location=(0, 1, 5))
    assert bpy.context.object is not head
    press("nim.convert")
    assert is_nim(head) and not bpy.context.object.material_slots
    press("nim.revert")
    assert not is_nim(head)


# ------------------------------------------------------------------------------------------------ what it was before


def shaded(name, node, **values):
    """A material of one node, with these values of its inputs."""
    material = bpy.data.materials.new(name)
    tree = empty_tree(material)
    shader, output = tree.nodes.new(node), tree.nodes.new("ShaderNodeOutputMaterial")
    for socket, value in values.items():
        shader.inputs[socket.replace("_", " ")].default_value = value
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material


def indices(object_):
    return [round(interface_of(interface_nodes(slot.material)[0]).inside.n, 4) for slot in object_.material_slots]


@pytest.mark.parametrize(
    "node, values, n",
    [
        ("ShaderNodeBsdfGlass", {"IOR": 1.77}, -1.77),
        ("ShaderNodeBsdfRefraction", {"IOR": 1.33}, -1.33),
        ("ShaderNodeBsdfPrincipled", {"IOR": 2.4, "Transmission_Weight": 1.0}, -2.4),
        ("ShaderNodeBsdfPrincipled", {"IOR": 2.4}, -1.5),  # opaque
        ("ShaderNodeBsdfDiffuse", {}, -1.5),
    ],
)
def test_the_index_of_a_glass_is_kept(cube, press, said, node, values, n):
    wear(cube, shaded("Was", node, **values), 1)
    press("nim.convert")
    assert indices(cube) == [-1.5, n]
    if n != -1.5:
        assert said[-1][1].startswith(f"1 made of index -1.5, {n:g}")


def test_its_sign_is_asked_for_and_a_medium_that_is_chosen_counts(cube, press):
    glass = shaded("Was", "ShaderNodeBsdfGlass", IOR=1.77)
    wear(cube, glass, 0)
    wear(cube, glass, 1)
    press("nim.convert", sign="POSITIVE")
    assert indices(cube) == [1.77, 1.77] and cube.material_slots[0].material == cube.material_slots[1].material
    press("nim.revert")
    press("nim.convert", keep=False)
    assert indices(cube) == [-1.5, -1.5]
    press("nim.revert")
    press("nim.convert", inside="nim-4.1")
    assert indices(cube) == [-4.1, -4.1]


def test_one_slot_and_then_the_other(cube, press):
    before, counts = state("Cube"), census()
    own = cube.material_slots[0].material
    cube.active_material_index = 1
    press("nim.convert", slots="ACTIVE")
    assert cube.material_slots[0].material == own and interface_nodes(cube.material_slots[1].material)
    press("nim.revert")
    assert state("Cube") == before and census() == counts
    press("nim.convert", slots="ACTIVE")
    cube.active_material_index = 0
    press("nim.convert", slots="ACTIVE", inside="nim-4.1")
    assert indices(cube) == [-4.1, -1.5]
    press("nim.revert")
    assert state("Cube") == before and census() == counts


def test_a_slot_that_was_left_alone_is_not_given_back(cube, press):
    press("nim.convert", slots="ACTIVE")
    other = bpy.data.materials.new("Since")
    cube.material_slots[1].material = other
    press("nim.revert")
    assert cube.material_slots[1].material == other


# ------------------------------------------------------------------------------------------------ nothing is left


def census():
    """The names of all data-blocks of the file, and the properties of ours that objects hold."""
    kinds = [name for name in dir(bpy.data) if isinstance(getattr(bpy.data, name), bpy.types.bpy_prop_collection)]
    names = {(kind, data.name) for kind in kinds for data in getattr(bpy.data, kind)}
    return names | {(object_.name, "nim") for object_ in bpy.data.objects if object_.is_property_set("nim")}


@pytest.mark.parametrize("backend", ["osl", "nodes"])
@pytest.mark.parametrize("inside", ["nim-1.5", "nim-causal", "n-bk7"])
def test_take_back_leaves_nothing_behind(cube, press, backend, inside):
    from nim_addon.ui import preferences

    preferences.settings().backend = backend
    before = census()
    press("nim.convert", inside="nim-4.1")
    press("nim.convert", inside=inside, replace=True)
    tree = cube.active_material.node_tree
    interface_nodes(cube.active_material)[0].inputs["Roughness"].keyframe_insert("default_value", frame=1)
    assert tree.animation_data.action and census() != before
    press("nim.revert")
    assert census() == before


def test_take_back_leaves_what_others_use(cube, press):
    other = interface_material("Other", Medium(-2.0), backend="nodes")
    before = census()
    press("nim.convert")
    press("nim.revert")
    assert census() == before and interface_nodes(other)


def test_take_back_takes_the_actions_of_strips_along(cube, press):
    before = census()
    press("nim.convert")
    tree = cube.active_material.node_tree
    interface_nodes(cube.active_material)[0].inputs["Roughness"].keyframe_insert("default_value", frame=1)
    animation = tree.animation_data
    animation.nla_tracks.new().strips.new("Strip", 1, animation.action)
    animation.action = None
    press("nim.revert")
    assert census() == before
