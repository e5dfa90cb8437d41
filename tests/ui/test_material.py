# SPDX-License-Identifier: GPL-3.0-or-later
"""The Negative Index panel: values that live in the node's sockets only, and what they mean."""

import math
import sys
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from nim_addon.cycles.material import interface_material, interface_nodes, interface_of, osl_available
from nim_addon.physics import MEDIA, Interface, Medium


@pytest.fixture
def material(addon):
    """A material of index -1.5 in air, worn by the default cube."""
    material = interface_material("NIM", Medium(-1.5), backend="nodes")
    bpy.data.objects["Cube"].data.materials[0] = material
    return material


def sockets(material):
    (node,) = interface_nodes(material)
    return tuple(
        node.inputs[f"{kind} {side}"].default_value
        for side in ("Inside", "Outside")
        for kind in ("Index", "Permeability")
    )


def test_the_panel_reads_and_writes_the_sockets(material):
    nim = material.nim
    (node,) = interface_nodes(material)
    assert (nim.medium_inside, nim.n_inside, nim.mu_inside) == ("nim-1.5", -1.5, -1)
    assert (nim.medium_outside, nim.n_outside, nim.mu_outside) == ("air", 1, 1)
    nim.medium_inside = "nim-mu10"
    assert interface_of(node).inside.mu == -10 and nim.n_inside == pytest.approx(-1.33)
    nim.n_inside = -2.5
    assert nim.medium_inside == "custom" and sockets(material) == (-2.5, -10, 1, 1)
    node.inputs["Index Outside"].default_value = 1.33
    assert nim.medium_outside == "water"
    assert not material.nim.keys(), "nothing is stored but in the node"


@pytest.mark.parametrize("value", (0, 1e-9))
@pytest.mark.parametrize("name", ("Index Inside", "Permeability Outside"))
def test_the_panel_is_drawn_where_a_value_is_no_mediums(material, draw, name, value):
    (node,) = interface_nodes(material)
    node.inputs[name].default_value = value
    assert interface_of(node) is None
    draw(material)


@pytest.mark.parametrize("name", MEDIA)
def test_every_preset_is_recognised(material, name):
    from nim_addon.ui.media import MEDIUM_NUMBERS

    (node,) = interface_nodes(material)
    node.inputs["Index Inside"].default_value = MEDIA[name].n
    node.inputs["Permeability Inside"].default_value = MEDIA[name].mu
    shown = material.nim.medium_inside
    assert shown in MEDIUM_NUMBERS and MEDIA[shown] == MEDIA[name]


def test_mu_counts_with_the_sign_of_n_and_the_panel_says_so(material, draw):
    (node,) = interface_nodes(material)
    assert "counts as" not in draw(material, 900).text
    node.inputs["Index Inside"].default_value = 1.5
    assert sockets(material)[:2] == (1.5, -1), "no value changes another"
    assert interface_of(node).inside.mu == material.nim.mu_inside == 1
    assert "μ counts as 1 here: it takes the sign of n." in draw(material, 900).text
    node.inputs["Permeability Inside"].default_value = 3
    assert "counts as" not in draw(material, 900).text
    node.inputs["Index Outside"].default_value = -1
    assert "μ counts as -1 here" in draw(material, 900).text


@pytest.mark.parametrize(
    "n, k, mu, mu_imag", [(-1.33, 0.01, 1, 0), (-1.33, 0.01, -1, 0), (-0.1, 2, 1, 1), (0.2, 2, -1, 0), (-1, 0, 1, 0)]
)
def test_what_is_said_of_the_sign_is_what_the_surface_does(material, n, k, mu, mu_imag):
    from nim_addon.ui.material_values import sign_note

    (node,) = interface_nodes(material)
    values = {"Index": n, "Extinction": k, "Permeability": mu, "Permeability Loss": mu_imag}
    for name, value in values.items():
        node.inputs[f"{name} Inside"].default_value = value
    turned = interface_of(node).inside.mu == pytest.approx(-mu)
    assert bool(sign_note(node, "inside")) == turned


def test_zero_is_said_in_a_sentence(material, draw):
    material.nim.n_inside = 0
    assert "n = 0 refracts nothing" in draw(material, 900).text and "counts as" not in draw(material, 900).text
    material.nim.mu_inside = 0
    assert "μ = 0 has no impedance" in draw(material, 900).text


def test_n_and_mu_in_the_panel_are_the_nodes_own(material, draw):
    (node,) = interface_nodes(material)
    names = ("Index Inside", "Permeability Inside", "Index Outside", "Permeability Outside")
    shown = [thing for thing in draw(material).shown if isinstance(thing, bpy.types.NodeSocket)]
    assert shown[:4] == [node.inputs[name] for name in names]


def test_keyframes_on_what_the_panel_shows_move_the_index(material, draw):
    """As pressing I over the value inserts them: at the value's own path."""
    (node,) = interface_nodes(material)
    socket = draw(material).shown[1]
    assert socket == node.inputs["Index Inside"]
    scene = bpy.context.scene
    for frame, value in ((1, -1.5), (11, -2.5)):
        scene.frame_set(frame)
        socket.default_value = value
        assert socket.keyframe_insert("default_value")
    for frame, n in ((1, -1.5), (6, -2.0), (11, -2.5)):
        scene.frame_set(frame)
        assert interface_of(node).inside.n == pytest.approx(n) == material.nim.n_inside
        evaluated = material.evaluated_get(bpy.context.evaluated_depsgraph_get())
        assert interface_of(interface_nodes(evaluated)[0]).inside.n == pytest.approx(n)
    layout = draw(material, 900)
    assert ("greyed", "medium_inside") in layout.drawn, "which the keyframes would take back"
    assert socket in layout.shown and ("prop", "medium_outside") in layout.drawn


def test_a_driver_on_what_the_panel_shows_moves_the_index(material, draw):
    (node,) = interface_nodes(material)
    driver = draw(material).shown[1].driver_add("default_value").driver
    driver.type = "SCRIPTED"
    driver.expression = "-frame / 10"
    bpy.context.scene.frame_set(21)
    assert interface_of(node).inside.n == pytest.approx(-2.1)
    assert ("greyed", "medium_inside") in draw(material).drawn


def test_undo_takes_a_typed_number_back(material):
    bpy.ops.ed.undo_push(message="before")
    interface_nodes(material)[0].inputs["Index Inside"].default_value = -2.2
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert sockets(bpy.data.materials["NIM"])[0] == -1.5


SAID = {
    ("Index", 0.0): "n = 0 refracts nothing: give a positive index, or a negative one for a NIM.",
    ("Permeability", 0.0): "μ = 0 has no impedance: give a positive or a negative permeability.",
    ("Index", math.nan): "n is no number: give one, such as -1.",
    ("Permeability", math.nan): "μ is no number: give one, such as -1.",
    ("Index", 2e6): "n = 2e+06 is out of range: without its sign it lies between 1e-06 and 1e+06.",
    ("Permeability", 2e6): "μ = 2e+06 is out of range: without its sign it lies between 1e-06 and 1e+06.",
    ("Index", -1e-8): "n = -1e-08 is out of range: without its sign it lies between 1e-06 and 1e+06.",
}


@pytest.mark.parametrize("way", ["in the socket", "by a Value node"])
@pytest.mark.parametrize("side", ["Inside", "Outside"])
@pytest.mark.parametrize("kind, value", SAID)
def test_each_value_that_is_no_mediums_has_its_own_sentence(material, draw, kind, value, side, way):
    (node,) = interface_nodes(material)
    socket = node.inputs[f"{kind} {side}"]
    if way == "in the socket":
        socket.default_value = value
    else:
        source = material.node_tree.nodes.new("ShaderNodeValue").outputs[0]
        source.default_value = value
        material.node_tree.links.new(source, socket)
    # what checks find is drawn below
    said = [text for text in draw(material, 5000).text.splitlines() if text in SAID.values()]
    assert said == [SAID[kind, value]]
    assert "point by point" not in draw(material, 5000).text


def test_a_value_node_is_read(material, draw):
    """The readings are of the values that are rendered, not of those that the links hide."""
    (node,) = interface_nodes(material)
    source = material.node_tree.nodes.new("ShaderNodeValue").outputs[0]
    source.default_value = 1.5
    material.node_tree.links.new(source, node.inputs["Index Inside"])
    text = draw(material, 5000).text
    assert "Light bends the usual way" in text and "41.8° from inside" in text


def test_a_colour_that_decides_a_number_is_left_to_the_node_tree(material, draw):
    (node,) = interface_nodes(material)
    color = material.node_tree.nodes.new("ShaderNodeRGB").outputs[0]
    material.node_tree.links.new(color, node.inputs["Index Inside"])
    assert interface_of(node) is None and "The node tree decides n or μ" in draw(material, 5000).text


def test_linked_sockets_are_drawn_as_such(material, draw):
    (node,) = interface_nodes(material)
    noise = material.node_tree.nodes.new("ShaderNodeTexNoise")
    material.node_tree.links.new(noise.outputs[0], node.inputs["Index Outside"])
    layout = draw(material, 900)
    assert node.inputs["Index Outside"] not in layout.shown and node.inputs["Permeability Outside"] in layout.shown
    assert "n: from the node tree" in layout.text and "The node tree decides n or μ" in layout.text


@pytest.mark.skipif(bpy.app.version < (4, 4), reason="there an action is of one thing only")
def test_keyframes_of_another_material_in_the_same_action_decide_nothing(material, draw):
    other = material.copy()
    (node,) = interface_nodes(other)
    node.inputs["Index Inside"].keyframe_insert("default_value")
    animation = material.node_tree.animation_data_create()
    animation.action = other.node_tree.animation_data.action
    animation.action_slot = animation.action.slots.new("NODETREE", "Mine")
    assert ("prop", "medium_inside") in draw(material).drawn


def test_without_an_interface_the_panel_offers_one(addon, draw):
    drawn = draw(bpy.data.materials["Material"]).drawn
    assert ("operator", "nim.convert") in drawn
    assert ("operator", "nim.convert") in draw(None).drawn


def test_readings():
    from nim_addon.ui.readings import readings, summary

    of = dict(readings(Interface(Medium(-1.5))))
    assert of["Bends backwards"] == "yes" and of["R at normal incidence"] == "4 %"
    assert of["Impedance ratio Z₂ / Z₁"] == "0.6667"
    assert of["Critical angle"] == "41.8° from inside"
    assert of["Brewster angle, p"] == "56.3° from outside, 33.7° from inside"
    assert "Brewster angle, s" not in of
    assert "bends backwards" in summary(Interface(Medium(-1.5)))[0]
    of = dict(readings(Interface(Medium(-1.33, -10.0))))
    assert "s" in "".join(label for label in of if label.startswith("Brewster")) and "Brewster angle, s" in of
    of = dict(readings(Interface(Medium(1.0), Medium(1.5))))
    assert of["Critical angle"] == "41.8° from outside" and of["Bends backwards"] == "no"
    assert summary(Interface(Medium(-1.0))) == (
        "Light bends backwards here: n has another sign on the other side.",
        "Nothing is reflected at any angle.",
    )


def test_readings_of_media_with_loss_are_of_a_wavelength():
    from nim_addon.ui.readings import length_text, readings, summary

    of = dict(readings(Interface(Medium.parse("n=-1.33+0.01j"))))
    assert of["Inside at 550 nm"] == "n = -1.33, k = 0.01" and of["Absorption length"] == "4.38 µm"
    assert of["Bends backwards"] == "yes" and of["Brewster angle, p"] == "none"
    # 48.8 degrees, of which the limits speak: nothing there is reflected as a whole
    assert of["Critical angle"] == "none"
    gold = Interface(Medium.parse("gold"))
    blue, red = (dict(readings(gold, nm)) for nm in (450, 700))
    assert blue["R at normal incidence"] != red["R at normal incidence"] == "97.1 %"
    (said,) = summary(gold, 700)
    assert said == gold.limits(700)[0] and "mirror" in said
    assert summary(Interface(Medium.parse("epsilon=-2,mu=1"))) == Interface(Medium.parse("epsilon=-2,mu=1")).limits()
    clear = Interface(Medium.parse("n=-1.33,length=0.05"))
    assert dict(readings(clear))["Absorption length"] == "5 cm"
    assert len(summary(clear)) == 2 and "from inside" in summary(clear)[1]
    assert "μ = 2 + 0.5 i" in dict(readings(Interface(Medium.parse("n=2+0.5j,mu=2+0.5j"))))["Inside at 550 nm"]
    lengths = {1234.0: "1.23 km", 1.0: "1 m", 0.9996: "1 m", 0.05: "5 cm", 2e-3: "2 mm", 1e-6: "1 µm", 2e-8: "20 nm"}
    assert {metres: length_text(metres) for metres in lengths} == lengths


def test_a_single_precision_value_reads_as_it_was_typed(material):
    from nim_addon.ui.material_values import active_node, interface_shown

    material.nim.n_inside = -1.33
    shown = interface_shown(active_node(material))
    assert shown.inside == Medium(-1.33) and shown is interface_shown(active_node(material))


def row_of(column, color):
    """Where a curve of that colour crosses a column of pixels (N, 3), in pixels: the middle of its ink upon the ground."""
    from nim_addon.ui.curve import GROUND

    ink, ground = np.subtract(color, GROUND), np.array(GROUND)
    share = (column - ground) @ ink / (ink @ ink)
    share[np.max(np.abs(column - ground - share[:, None] * ink), axis=1) > 0.02] = 0
    share[share < 0.55] = 0  # the grid, and the grey curve
    return np.average(np.arange(len(column)), weights=share)


@pytest.mark.parametrize("inside, nm", (("-1.5", 550), ("n=-1.33+0.3j", 550), ("gold", 450), ("gold", 700)))
def test_the_curves_are_the_reflectances(addon, inside, nm):
    """The lines, read back from the picture, lie where Fresnel says, at the wavelength."""
    from nim_addon.ui import curve

    interface, size = Interface(Medium.parse(inside)), 600
    image = curve.picture(curve.Shown(interface, nm), size)
    left, right, bottom, top = 24, size - 8, 27, size - 18
    for degrees in (50, 62, 75):  # nearer to 0 the curves lie upon each other
        column = round(left + degrees / 90 * (right - left))
        angle = math.radians((column - left) / (right - left) * 90)
        pixels = image[bottom : top + 1, column, :3]
        powers = interface.at(nm).fresnel(math.cos(angle))
        for power, color in ((powers.R, curve.R_COLOR), (powers.R_s, curve.S_COLOR), (powers.R_p, curve.P_COLOR)):
            assert row_of(pixels, color) / (top - bottom) == pytest.approx(float(power), abs=0.012)


def test_over_the_wavelength_are_n_and_k_and_r(addon):
    from nim_addon.ui import curve

    interface, size = Interface(Medium.parse("gold")), 400
    image = curve.picture(curve.Shown(interface, by_wavelength=True), size)
    nm, n, k, R = curve.spectrum(interface)
    # five is what holds both k and n; three letters of its middle make room on the right
    left, right, bottom, top = 24, size - 8 - 15, 27, size - 18
    for wavelength in (530, 600, 660):  # where no curve hides another
        column = round(left + (wavelength - 380) / 350 * (right - left))
        there = interface.at(380 + (column - left) / (right - left) * 350)
        pixels = image[bottom : top + 1, column, :3]
        for value, color in ((there.inside.n / 5, curve.N_COLOR), (there.inside.k / 5, curve.K_COLOR)):
            assert row_of(pixels, color) / (top - bottom) == pytest.approx(value, abs=0.012)
        assert row_of(pixels, curve.R_COLOR) / (top - bottom) == pytest.approx(float(there.fresnel(1).R), abs=0.012)


def test_the_spectrum_is_of_the_wavelengths_that_are_known(addon):
    from nim_addon.ui import curve

    narrow = Interface(Medium.parse("n=table(450 1.5 650 1.6)"))
    nm, n, k, R = curve.spectrum(narrow)
    assert nm[0] == 450 and nm[-1] == 650 and n == pytest.approx(np.interp(nm, (450, 650), (1.5, 1.6)))
    assert curve.spectrum(narrow.reversed())[1] == pytest.approx(n), "of the medium that disperses"
    curve.picture(curve.Shown(narrow, by_wavelength=True), 100)
    with pytest.raises(ValueError, match="does not cover 400 nm"):
        curve.picture(curve.Shown(narrow, 400.0), 100)


def test_the_curve_is_made_once_for_each_interface(addon, monkeypatch):
    from nim_addon.ui import curve

    pictures = []
    original = curve.picture
    monkeypatch.setattr(curve, "picture", lambda *given: pictures.append(given) or original(*given))
    for n in (-1.5, -1.5, -1.6, -1.5):
        curve.icon(curve.Shown(Interface(Medium(n))), 100)
    assert len(pictures) == 2


def test_a_few_icons_are_used_over_and_over(addon, monkeypatch):
    """Without a window Blender gives icons no numbers: these stand for its own."""
    from nim_addon.ui import curve

    def new(name):
        icons.append(SimpleNamespace(icon_id=len(icons) + 1, image_pixels_float=SimpleNamespace(foreach_set=len)))
        return icons[-1]

    icons = []
    curve.unregister()
    with monkeypatch.context() as patch:
        patch.setattr(bpy.utils.previews, "new", lambda: SimpleNamespace(new=new))
        patch.setattr(bpy.utils.previews, "remove", lambda those: None)
        curve.register()
        media = [curve.Shown(Interface(Medium(n))) for n in range(2, 20)]
        shown = [curve.icon(one, 100) for one in media]
        assert set(shown) == set(range(1, curve.SLOTS + 1)) and len(icons) == curve.SLOTS
        assert curve.icon(media[-1], 100) == shown[-1] != curve.icon(media[0], 100)
        curve.unregister()
    curve.register()


def test_a_redraw_does_the_same_work_whatever_else_is_in_the_file(material, draw):
    def work():
        """Calls of functions, Python's and C's, in one redraw."""
        calls = 0

        def counted(_, event, __):
            nonlocal calls
            calls += event in ("call", "c_call")

        draw(material)
        sys.setprofile(counted)
        draw(material)
        sys.setprofile(None)
        return calls

    alone = work()
    for i in range(19):
        other = interface_material(f"Other {i}", Medium(-1.5 - i / 10), backend="nodes")
        object_ = bpy.data.objects.new(f"Object {i}", bpy.data.objects["Cube"].data.copy())
        object_.data.materials[0] = other
        object_.location.x = 5 * (i + 1)  # apart, so that there is no more to say
        bpy.context.collection.objects.link(object_)
    bpy.context.view_layer.update()
    assert work() < 1.05 * alone


def test_the_backend_can_be_switched(material, press):
    assert press("nim.switch_backend", material="NIM", backend="auto") == {"FINISHED"}
    assert interface_nodes(material)[0].node_tree["nim_interface"] == "nodes", "OSL is off in this scene"
    with pytest.raises(RuntimeError, match="no NIM Interface material"):
        press("nim.switch_backend", material="Nobody", backend="nodes")
    if osl_available():
        press("nim.switch_backend", material="NIM", backend="osl")
        assert interface_nodes(material)[0].node_tree["nim_interface"] == "osl"
        press("nim.switch_backend", material="NIM", backend="nodes")
        bpy.context.scene.cycles.shading_system = True
        press("nim.switch_backend", material="NIM", backend="auto")
        assert interface_nodes(material)[0].node_tree["nim_interface"] == "osl"
    else:
        with pytest.raises(RuntimeError, match="without OSL"):
            press("nim.switch_backend", material="NIM", backend="osl")
    assert sockets(material) == (-1.5, -1, 1, 1)
