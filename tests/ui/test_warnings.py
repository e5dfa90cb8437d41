# SPDX-License-Identifier: GPL-3.0-or-later
"""Each wrong setting is found, said in a sentence, mended by its button, and not found again."""

import bpy
import pytest

from nim_addon import checks
from nim_addon.cycles import settings
from nim_addon.cycles.laws import asked_law
from nim_addon.cycles.material import asked_interfaces, interface_material, interface_nodes, osl_available
from nim_addon.cycles.problem import MODIFIED
from nim_addon.physics import Medium
from nim_addon.scenes import SCENES


@pytest.fixture
def scene(addon):
    """A scene in which a cube is a NIM and nothing is wrong."""
    from nim_addon.ui import warnings

    warnings.forget()
    scene = bpy.context.scene
    settings.lossless(scene, "nodes")
    bpy.data.objects["Cube"].data.materials[0] = interface_material("NIM", Medium(-1.5), backend="nodes")
    assert codes(scene) == []
    return scene


def codes(scene):
    return [problem.code for problem in checks.problems(scene)]


def cube():
    return bpy.data.objects["Cube"]


def wrong_engine(scene):
    scene.render.engine = "BLENDER_WORKBENCH"


def few_bounces(scene):
    scene.cycles.transparent_max_bounces = settings.FEWEST_BOUNCES - 1


def clamped(scene):
    scene.cycles.sample_clamp_indirect = 10.0


def clamped_directly(scene):
    scene.cycles.sample_clamp_direct = 1.0


def filtered(scene):
    scene.cycles.blur_glossy = 1.0


def transparent_film(scene):
    scene.render.film_transparent = True


def point(scene):
    bpy.data.lights["Light"].shadow_soft_size = 0.0


def spot(scene):
    bpy.data.lights["Light"].type = "SPOT"
    bpy.data.objects["Light"].data.shadow_soft_size = 0.0


def sun(scene):
    bpy.data.lights["Light"].type = "SUN"
    bpy.data.objects["Light"].data.angle = 0.0


def area(scene):
    bpy.data.lights["Light"].type = "AREA"
    light = bpy.data.objects["Light"].data
    light.shape, light.size, light.size_y = "RECTANGLE", 1.0, 0.0


def inside_out(scene):
    cube().data.flip_normals()


def one_face_turned(scene):
    cube().data.polygons[0].flip()
    cube().data.update()


def open_volume(scene):
    import bmesh

    shape = bmesh.new()
    shape.from_mesh(cube().data)
    bmesh.ops.delete(shape, geom=[next(iter(shape.faces))], context="FACES_ONLY")
    shape.to_mesh(cube().data)
    shape.free()
    fill_with_volume()


def fill_with_volume():
    tree = cube().data.materials[0].node_tree
    volume = tree.nodes.new("ShaderNodeVolumeAbsorption")
    tree.links.new(volume.outputs[0], tree.get_output_node("CYCLES").inputs["Volume"])


@pytest.mark.parametrize(
    "code, spoil",
    [
        ("engine", wrong_engine),
        ("transparent_bounces", few_bounces),
        ("clamp", clamped),
        ("clamp", clamped_directly),
        ("filter_glossy", filtered),
        ("film_transparent", transparent_film),
        ("zero_light", point),
        ("zero_light", spot),
        ("zero_light", sun),
        ("zero_light", area),
        ("normals", inside_out),
        ("normals", one_face_turned),
        ("open_volume", open_volume),
    ],
    ids=lambda value: getattr(value, "__name__", value),
)
def test_each_problem_is_found_and_mended(scene, press, code, spoil):
    from nim_addon.ui import warnings

    spoil(scene)
    bpy.context.view_layer.update()
    (problem,) = checks.problems(scene)
    assert problem.code == code and problem.remedy and problem.sentence.endswith(".") and "{" not in problem.sentence
    assert [problem.code for problem in warnings.found(scene)] == [code], "the panel sees the same"
    assert press("nim.mend", code=code) == {"FINISHED"}
    assert codes(scene) == [] and warnings.found(scene) == []
    assert press("nim.mend", code="") == {"CANCELLED"}


def light_by_chance(scene):
    bpy.data.lights["Light"].cycles.use_multiple_importance_sampling = False


def light_without_shadow(scene):
    bpy.data.lights["Light"].use_shadow = False


def shadow_caustics(scene):
    bpy.data.lights["Light"].cycles.is_caustics_light = True
    cube().cycles.is_caustics_caster = cube().cycles.is_caustics_receiver = True


def invisible(scene):
    cube().visible_diffuse = False


def sky_without_glossy(scene):
    scene.world.cycles_visibility.glossy = False


def overridden(scene):
    scene.view_layers[0].material_override = bpy.data.materials.new("Clay")


def few_samples_of_layer(scene):
    scene.view_layers[0].samples = 1


def zero_index(scene):
    cube().data.materials[0].node_tree.nodes["NIM Interface"].inputs["Index Inside"].default_value = 0.0


def bright_tint(scene):
    cube().data.materials[0].node_tree.nodes["NIM Interface"].inputs["Tint"].default_value = (2, 1, 1, 1)


def keyed_to_zero(scene):
    socket = cube().data.materials[0].node_tree.nodes["NIM Interface"].inputs["Index Inside"]
    socket.keyframe_insert("default_value", frame=1)
    socket.default_value = 0.0
    socket.keyframe_insert("default_value", frame=20)


@pytest.mark.parametrize(
    "spoil",
    [
        light_by_chance,
        light_without_shadow,
        shadow_caustics,
        invisible,
        sky_without_glossy,
        overridden,
        few_samples_of_layer,
        zero_index,
        bright_tint,
        keyed_to_zero,
    ],
    ids=lambda value: value.__name__,
)
def test_the_panel_knows_of_a_change_without_being_told(scene, spoil):
    from nim_addon.ui import warnings

    bpy.context.view_layer.update()
    assert warnings.found(scene) == []
    spoil(scene)
    bpy.context.view_layer.update()
    assert len(warnings.found(scene)) == 1 and warnings.found(scene) == checks.problems(scene)


def test_a_mesh_that_changes_is_measured_anew(scene):
    from nim_addon.ui import warnings

    bpy.context.view_layer.update()
    assert warnings.found(scene) == []
    cube().data.flip_normals()
    cube().data.update()
    bpy.context.view_layer.update()
    assert [problem.code for problem in warnings.found(scene)] == ["normals"]


def test_a_scene_that_was_never_evaluated_is_looked_at(scene):
    from nim_addon.ui import warnings

    other = bpy.data.scenes.new("Other")
    settings.lossless(other, "nodes")
    cube().data.flip_normals()
    other.collection.objects.link(cube())
    assert [problem.code for problem in warnings.found(other)] == ["normals"]


def test_looking_is_no_change(scene, monkeypatch):
    from nim_addon.ui import warnings

    looks = []
    monkeypatch.setattr(checks, "found_in", lambda sight, real=checks.found_in: looks.append(1) or real(sight))
    cube().hide_viewport = True
    for _ in range(3):
        bpy.context.view_layer.update()
        warnings.found(scene)
    assert len(looks) == 1


@pytest.mark.skipif(not osl_available(), reason="this Blender has no OSL")
def test_osl_that_is_off_is_turned_on(scene, press):
    cube().data.materials[0] = interface_material("Script", Medium(-1.5), backend="osl")
    assert codes(scene) == ["osl_off"]
    press("nim.mend", code="osl_off")
    assert scene.cycles.shading_system and codes(scene) == []


@pytest.mark.skipif(not osl_available(), reason="only a Blender with OSL can make the material")
@pytest.mark.parametrize("code, lacking", [("osl_missing", "osl_available"), ("osl_device", "device_runs_osl")])
def test_osl_that_cannot_run_gives_way_to_nodes(scene, press, monkeypatch, code, lacking):
    material = cube().data.materials[0] = interface_material("Script", Medium(-1.5), backend="osl")
    scene.cycles.shading_system = True
    monkeypatch.setattr(checks, lacking, lambda *_: False)
    assert codes(scene) == [code]
    press("nim.mend", code=code)
    assert codes(scene) == [] and interface_nodes(material)[0].node_tree["nim_interface"] == "nodes"


def test_mend_all_mends_all_and_can_be_undone(scene, press):
    few_bounces(scene), clamped(scene), transparent_film(scene), inside_out(scene)
    bpy.ops.ed.undo_push(message="spoilt")
    assert len(codes(scene)) == 4
    press("nim.mend")
    assert codes(bpy.context.scene) == []
    bpy.ops.ed.undo()
    assert len(codes(bpy.context.scene)) == 4


def test_a_mesh_that_two_objects_share_is_turned_once(scene, press):
    twin = bpy.data.objects.new("Twin", cube().data)
    twin.location.x = 5
    scene.collection.objects.link(twin)
    inside_out(scene)
    assert codes(scene) == ["normals", "normals"]
    press("nim.mend", code="normals")
    assert codes(scene) == []


def test_modifiers_count(scene):
    """Half a cube, closed by its mirror, is closed."""
    open_volume(scene)
    cube().modifiers.new("Close", "SOLIDIFY")
    assert codes(scene) == []


def flipped_by_solidify(scene):
    mesh = cube().data
    corners = [tuple(mesh.vertices[index].co) for index in mesh.polygons[0].vertices]
    mesh.clear_geometry()
    mesh.from_pydata(corners, [], [range(4)])
    cube().modifiers.new("Thick", "SOLIDIFY").use_flip_normals = True


def opened_by_mask(scene):
    fill_with_volume()
    cube().vertex_groups.new(name="Shown").add([0, 1, 2, 3], 1.0, "REPLACE")
    cube().modifiers.new("Shown", "MASK").vertex_group = "Shown"


@pytest.mark.parametrize(
    "code, spoil",
    [("normals", flipped_by_solidify), ("open_volume", opened_by_mask)],
    ids=lambda value: getattr(value, "__name__", value),
)
def test_what_a_modifier_does_is_said_and_no_button_offered(scene, press, code, spoil):
    spoil(scene)
    (problem,) = checks.problems(scene)
    assert problem.code == code and problem.remedy is None and MODIFIED in problem.sentence
    assert press("nim.mend", code=code) == {"CANCELLED"}
    cube().modifiers.clear()
    assert code not in codes(scene)


def test_a_mesh_that_is_wrong_itself_is_mended_under_its_modifiers(scene, press):
    cube().modifiers.new("Round", "BEVEL")
    inside_out(scene)
    assert codes(scene) == ["normals"]
    press("nim.mend", code="normals")
    assert codes(scene) == []


def test_what_is_not_rendered_or_no_nim_is_no_problem(scene):
    few_bounces(scene), inside_out(scene)
    cube().hide_render = True
    assert codes(scene) == []
    cube().hide_render = False
    cube().data.materials[0] = None
    assert codes(scene) == []


@pytest.mark.parametrize("name", SCENES)
def test_the_scenes_have_no_problem(empty_file, name):
    scene_type = SCENES[name]
    scene = scene_type.build(scene_type.parameters(), "nodes")
    # the prism and the drop disperse, which a render of one wavelength does not show
    expected = ["one_wavelength"] if name in ("prism", "drop") else []
    assert any(asked_interfaces(material) or asked_law(material) for material in bpy.data.materials)
    assert codes(scene) == expected


def test_large_meshes_are_measured_when_asked(scene, press, monkeypatch):
    from nim_addon.ui import warnings

    monkeypatch.setattr(warnings, "LARGEST", 5)
    inside_out(scene)
    bpy.context.view_layer.update()
    warnings.forget()
    assert warnings.found(scene) == []
    press("nim.check_meshes")
    assert [problem.code for problem in warnings.found(scene)] == ["normals"]


def test_many_interfaces_are_looked_at_when_asked(scene, press, monkeypatch):
    from nim_addon.checks import surroundings
    from nim_addon.ui import warnings

    monkeypatch.setattr(surroundings, "PANEL", 1)
    inner = bpy.data.objects.new("Inner", cube().data.copy())
    inner.scale = (0.5, 0.5, 0.5)
    scene.collection.objects.link(inner)
    bpy.context.view_layer.update()
    warnings.forget()
    assert warnings.found(scene) == []
    press("nim.check_meshes")
    assert [problem.code for problem in warnings.found(scene)] == ["normals"]


def test_handlers_are_taken_away(addon):
    import addon_utils

    def ours():
        lists = [getattr(bpy.app.handlers, name) for name in ("depsgraph_update_post", "undo_post", "redo_post")]
        return [handler for handlers in lists for handler in handlers if handler.__module__.endswith("ui.warnings")]

    assert len(ours()) == 3
    addon_utils.disable(addon, default_set=True)
    assert ours() == []
    addon_utils.enable(addon, default_set=True)
