# SPDX-License-Identifier: GPL-3.0-or-later
"""What a medium absorbs as a volume: which material has one, what it is set to, and what is left to it."""

import math

import bpy
import numpy as np
import pytest

from nim_addon.cycles import absorption, spectral
from nim_addon.cycles.material import interface_material, interface_nodes, interface_of
from nim_addon.physics import MEDIA, Medium

pytestmark = pytest.mark.usefixtures("empty_file")
WINE = Medium.parse("n=1.34,k=table(380 2e-6 520 2e-6 600 2e-7 730 1e-7)")


def density(node):
    """What a node absorbs of red, green and blue, per metre."""
    colour, thickness = (np.array(node.inputs[name].default_value) for name in ("Color", "Density"))
    return (1 - colour[:3]) * thickness


def volume(material):
    (link,) = material.node_tree.get_output_node("CYCLES").inputs["Volume"].links
    return link.from_node


@pytest.mark.parametrize(
    ("text", "does"),
    [
        ("-1.33", False),
        ("nim-causal", False),
        ("fishnet", False),
        ("n-bk7", True),
        ("gold", True),
        ("n=-1,k=1e-9", True),
    ],
)
def test_what_absorbs(text, does):
    assert absorption.absorbs(Medium.parse(text)) == does
    material = interface_material("A", Medium.parse(text), backend="nodes", volume=True)
    assert material.node_tree.get_output_node("CYCLES").inputs["Volume"].is_linked == does


def test_a_volume_is_of_the_neutral_wavelength_or_of_three_channels():
    material, grey = absorption.volume_material("Wine", WINE), absorption.volume_material("Grey", Medium(1.5 + 1e-6j))
    np.testing.assert_allclose(density(volume(material)), 3 * [WINE.absorption()], rtol=1e-6)
    spectral.set_neutral(650.0)
    np.testing.assert_allclose(density(volume(material)), 3 * [WINE.absorption(650)], rtol=1e-6)
    # a k of one number is absorption of one number, as it is in the sockets of an interface
    np.testing.assert_allclose(density(volume(grey)), 3 * [4 * math.pi * 1e-6 / 550e-9], rtol=1e-6)
    absorption.show_colours(material)
    red, green, blue = density(volume(material))
    assert 0 < red < 0.1 * green and green < blue < 4 * math.pi * 2e-6 / 380e-9
    spectral.set_neutral(600.0)  # which is not of what has its colours
    np.testing.assert_array_equal(density(volume(material)), [red, green, blue])
    absorption.show_neutral(material)
    np.testing.assert_allclose(density(volume(material)), 3 * [WINE.absorption()], rtol=1e-6)


def test_a_length_is_the_same_in_all_channels():
    material = absorption.volume_material("A", Medium.parse("n=1.33,length=0.05"))
    for show in (absorption.show_colours, absorption.show_neutral):
        show(material)
        np.testing.assert_allclose(density(volume(material)), 3 * [20.0], rtol=1e-6)


@pytest.mark.parametrize("medium", [Medium(-1.33 + 1e-6j), WINE], ids=str)
@pytest.mark.parametrize("backend", ["osl", "nodes"])
def test_faces_leave_to_a_volume_what_light_loses_on_its_way(medium, backend):
    material = interface_material("A", MEDIA["glass"], medium, backend=backend)
    (node,) = interface_nodes(material)
    socket = node.inputs["Absorption Outside"]
    assert socket.is_linked == (medium is WINE) and (socket.is_linked or socket.default_value > 0)
    absorption.leave_to_volume(node, "Inside", "Outside")
    assert not socket.is_linked and socket.default_value == 0
    # the surface itself stays what it was
    outside = interface_of(node).outside
    assert outside.k == pytest.approx(medium.k, rel=1e-6) and outside.n == pytest.approx(medium.n, rel=1e-6)


def test_a_node_that_was_changed_by_hand_stays_as_it_is():
    material = absorption.volume_material("A", WINE)
    volume(material)[absorption.MARK] = "claret"
    volume(material).inputs["Density"].default_value = 3.0
    spectral.set_neutral(650.0)
    absorption.show_colours(material)
    assert volume(material).inputs["Density"].default_value == 3.0
    assert not [*absorption.nodes_of(bpy.data.materials.new("Plain"))]


@pytest.mark.parametrize("backend", ["osl", "nodes"])
def test_a_length_needs_no_wavelength(backend):
    material = interface_material("A", Medium.parse("n=-1.33,length=0.05,mu=-4"), backend=backend)
    (node,) = interface_nodes(material)
    assert not any(socket.is_linked for socket in node.inputs)
    assert node.inputs["Absorption Inside"].default_value == pytest.approx(20)
    inside = interface_of(node).inside
    assert (inside.n, inside.mu, inside.absorption_length()) == pytest.approx((-1.33, -4, 0.05), rel=1e-6)
    coloured = interface_material("B", WINE, backend=backend)
    assert interface_nodes(coloured)[0].inputs["Absorption Inside"].is_linked
