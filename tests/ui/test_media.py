# SPDX-License-Identifier: GPL-3.0-or-later
"""Media with loss and dispersion in the panel: put into a material as nodes, taken away without a trace, and read back."""

import math
from pathlib import Path

import bpy
import pytest

from nim_addon.cycles import dispersive
from nim_addon.cycles.material import interface_material, interface_nodes, interface_of
from nim_addon.physics import DISPERSIVE, Interface, Medium

HEAD = "REFERENCES: none\nDATA:\n"


@pytest.fixture
def material(addon):
    """A material of index -1.5 in air, worn by the default cube."""
    material = interface_material("NIM", Medium(-1.5), backend="nodes")
    bpy.data.objects["Cube"].data.materials[0] = material
    return material


def names():
    """What is in the file."""
    kinds = ("materials", "node_groups", "texts", "images", "objects", "meshes")
    return {kind: sorted(one.name for one in getattr(bpy.data, kind)) for kind in kinds}


def nodes_and_links(material):
    tree = material.node_tree
    return sorted(node.name for node in tree.nodes), sorted(
        (link.from_node.name, link.to_socket.name) for link in tree.links
    )


def test_every_medium_has_an_item_with_a_tooltip_and_a_number_of_its_own(addon):
    from nim_addon.ui import media

    assert set(media.DISPERSIVE_NUMBERS) == set(DISPERSIVE) == set(media.DISPERSIVE_TEXTS)
    items = [item for item in media.PANEL_ITEMS if item[0]]
    numbers = [item[4] for item in items]
    assert len(set(numbers)) == len(numbers) and len({item[1] for item in items}) == len(items)
    assert all(item[2] for item in items)
    # which files hold
    expected = {"custom": 0, "air": 1, "nim-mu25": 11, "water-daimon": 20, "gold": 26, "nim-causal": 30, "fishnet": 33}
    expected |= {"file": 90, "absorbing": 91}
    assert expected.items() <= {item[0]: item[4] for item in items}.items()


@pytest.mark.parametrize("side", ("inside", "outside"))
@pytest.mark.parametrize("name", DISPERSIVE)
def test_a_medium_by_wavelength_is_a_node_and_goes_without_a_trace(material, name, side):
    before, tree = names(), nodes_and_links(material)
    setattr(material.nim, f"medium_{side}", name)
    (node,) = interface_nodes(material)
    for output in dispersive.OUTPUTS:
        (link,) = node.inputs[f"{output} {side.title()}"].links
        assert link.from_socket.name == output
    assert dispersive.medium_of(link.from_node) == Medium.parse(name)
    assert getattr(material.nim, f"medium_{side}") == name
    setattr(material.nim, f"medium_{side}", "nim-4.1")
    assert getattr(material.nim, f"medium_{side}") == "nim-4.1"
    assert names() == before and nodes_and_links(material) == tree
    media = {"inside": Medium(-1.5), "outside": Medium(1.0), side: Medium(-4.1)}
    assert interface_of(node).inside.n == pytest.approx(media["inside"].n)
    assert interface_of(node).outside.n == pytest.approx(media["outside"].n)
    assert [node.inputs[f"{kind} {side.title()}"].default_value for kind in ("Extinction", "Absorption")] == [0, 0]


def test_one_takes_the_place_of_another(material):
    for name in ("gold", "n-bk7", "nim-causal"):
        material.nim.medium_inside = name
    media = [node for node in material.node_tree.nodes if dispersive.is_medium_node(node)]
    assert [str(dispersive.medium_of(node)) for node in media] == ["nim-causal"]
    assert sum(dispersive.MARK in group for group in bpy.data.node_groups) == 1


def test_the_other_side_and_other_materials_keep_theirs(material):
    other = interface_material("Other", Medium(1.5), backend="nodes")
    for owner, side in ((material, "inside"), (material, "outside"), (other, "inside")):
        setattr(owner.nim, f"medium_{side}", "n-bk7")
    material.nim.medium_inside = "air"
    assert (material.nim.medium_outside, other.nim.medium_inside) == ("n-bk7", "n-bk7")
    material.nim.medium_outside = "air"
    assert other.nim.medium_inside == "n-bk7"
    other.nim.medium_inside = "custom"
    assert not any(dispersive.MARK in group for group in bpy.data.node_groups)


def test_own_values_after_a_medium_by_wavelength_are_those_of_550_nm(material):
    material.nim.medium_inside = "n-bk7"
    material.nim.medium_inside = "custom"
    assert material.nim.n_inside == pytest.approx(Medium.parse("n-bk7").n)
    assert material.nim.medium_inside == "absorbing", "it absorbs, within metres"


def test_the_panel_says_what_stands_there(material, draw):
    material.nim.medium_inside = "n-sf11"
    layout = draw(material, 5000)
    (node,) = interface_nodes(material)
    assert ("prop", "medium_inside") in layout.drawn and node.inputs["Index Inside"] not in layout.shown
    assert "Inside at 550 nm" in layout.text and "n = 1.791, k = 3.762e-08" in layout.text
    assert ("prop", "over") in layout.drawn and ("prop", "wavelength") in layout.drawn
    bpy.context.scene.nim_curve.wavelength = 400
    assert "Inside at 400 nm" in draw(material, 5000).text
    material.nim.medium_inside = "gold"
    assert "it is a mirror for all that one can see" in draw(material, 5000).text
    material.nim.medium_inside = "nim-1.5"
    layout = draw(material, 5000)
    assert ("prop", "wavelength") not in layout.drawn and "Inside at" not in layout.text, "calm for real media"


def test_a_wavelength_that_a_medium_is_not_known_at_is_said(material, draw, monkeypatch):
    from nim_addon.ui import material as panel

    narrow = Interface(Medium.parse("n=table(450 1.5 650 1.6)"))
    monkeypatch.setattr(panel, "interface_shown", lambda node: narrow)
    bpy.context.scene.nim_curve.wavelength = 400
    assert "which does not cover 400 nm" in draw(material, 5000).text


def test_an_absorption_length_and_k_are_one_thing(material):
    nim = material.nim
    nim.medium_inside = "absorbing"
    assert nim.medium_inside == "absorbing" and nim.length_inside == pytest.approx(0.1)
    nim.length_inside = 0.05
    (node,) = interface_nodes(material)
    k, absorption = (node.inputs[f"{kind} Inside"].default_value for kind in ("Extinction", "Absorption"))
    assert absorption == pytest.approx(20) and k == pytest.approx(550e-9 / (4 * math.pi * 0.05))
    assert nim.k_inside == k
    assert interface_of(node).inside.absorption_length() == pytest.approx(0.05)
    nim.k_inside = 0.01
    assert nim.length_inside == pytest.approx(550e-9 / (4 * math.pi * 0.01)) and nim.medium_inside == "custom"
    assert interface_of(node).inside.k == pytest.approx(0.01)
    nim.k_inside = 0
    assert (nim.length_inside, nim.medium_inside) == (0, "nim-1.5")
    nim.medium_inside = "absorbing"
    nim.medium_inside = "custom"
    assert (nim.length_inside, nim.k_inside) == (0, 0)
    nim.medium_outside = "absorbing"
    nim.medium_outside = "water"
    assert (nim.length_outside, nim.medium_outside) == (0, "water")


def test_loss_and_surface_are_folded(material, draw):
    drawn = draw(material).drawn
    assert [text for kind, text in drawn if kind == "panel"] == ["NIM_loss", "NIM_surface"]
    assert {("prop", "k_inside"), ("prop", "length_outside")} <= set(drawn)
    material.nim.medium_inside = "gold"
    drawn = draw(material).drawn
    assert ("prop", "k_inside") not in drawn and ("prop", "k_outside") in drawn


FILES = {
    "glass.yml": HEAD + "  - type: formula 5\n    wavelength_range: 0.3 2.0\n    coefficients: 1.5 0.004 -2\n",
    "none.yml": "nothing\n",
    "infrared.yml": HEAD + "  - type: formula 5\n    wavelength_range: 0.5 2.0\n    coefficients: 1.5 0.004 -2\n",
}


@pytest.fixture
def file(tmp_path):
    def written(name):
        path = Path(tmp_path, name)
        path.write_text(FILES[name])
        return str(path)

    return written


def test_a_file_is_a_medium(material, press, file):
    before = names()
    assert press("nim.medium_file", material="NIM", side="inside", filepath=file("glass.yml")) == {"FINISHED"}
    assert material.nim.medium_inside == "file"
    inside = interface_of(interface_nodes(material)[0]).inside
    assert inside.at(400).n == pytest.approx(1.5 + 0.004 / 0.4**2) and str(inside) == "glass.yml"
    material.nim.medium_inside = "nim-1.5"
    assert names() == before


@pytest.mark.parametrize(
    "name, words", (("none.yml", "is no file of refractiveindex.info"), ("infrared.yml", "does not cover 380 nm"))
)
def test_a_file_that_is_no_medium_changes_nothing(material, press, file, name, words):
    before, tree = names(), nodes_and_links(material)
    with pytest.raises(RuntimeError, match=words):
        press("nim.medium_file", material="NIM", side="inside", filepath=file(name))
    assert (names(), nodes_and_links(material)) == (before, tree)
    with pytest.raises(RuntimeError, match="is no NIM Interface material"):
        press("nim.medium_file", material="Nobody", side="inside", filepath=file("glass.yml"))


def test_undo_brings_the_former_medium_back(material):
    tree = nodes_and_links(material)
    bpy.ops.ed.undo_push(message="before")
    material.nim.medium_inside = "gold"
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    material = bpy.data.materials["NIM"]
    assert material.nim.medium_inside == "nim-1.5" and nodes_and_links(material) == tree


def test_the_backend_of_the_media_is_that_of_the_material(material, press):
    material.nim.medium_inside = "gold"
    (group,) = (group for group in bpy.data.node_groups if dispersive.MARK in group)
    assert group[dispersive.BACKEND] == "nodes"


@pytest.mark.parametrize("operator", ("nim.convert", "nim.add_object"))
def test_new_objects_may_be_of_every_medium(addon, press, operator):
    side = "inside" if operator == "nim.convert" else "medium"
    assert press(operator, **{side: "nim-causal"}) == {"FINISHED"}
    material = bpy.context.object.active_material
    assert material.nim.medium_inside == "nim-causal"
