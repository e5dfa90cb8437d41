# SPDX-License-Identifier: GPL-3.0-or-later
"""What photons are bent, mirrored and absorbed by: copies of materials that do so exactly, and count it apart.

Photons tell where they landed by colour, which nothing on their way may change. So what takes colour from light, tints and
absorbing volumes, has a switch: off for where photons land, on for what is left of them.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import bpy
from numpy.typing import ArrayLike

from ..cycles.closures import GRADED_BALL, GRADED_CORE, INTERFACE, LENSLET_WINDOW, UNIAXIAL_SLAB, closure_of_node
from ..cycles.closures.closure import Closure, handles
from ..cycles.closures.interface import Optics
from ..cycles.lenslets import window_of
from ..cycles.material import interface_of, is_rough
from ..cycles.nodes import Nodes, empty_tree
from ..cycles.object_values import attributes_of, carry
from ..cycles.visibility import asked, has_nodes, is_interface, value_of
from ..physics import REPRESENTATIVE_NM, Interface
from .counting import POWER, WHITE, around_a_core, at_lenslets, count, fed, switch

SHINY = 0.003  # Cycles takes a rougher closure as not quite a mirror, and finds lamps in it
LOSSES = ("Extinction", "Permeability Loss", "Absorption")  # of an interface, by which it takes light
# closures that, but for their tint and losses and for what is counted, do the same to photons
CARRIERS = (GRADED_BALL, GRADED_CORE, LENSLET_WINDOW, UNIAXIAL_SLAB)
THROUGH = "Through"  # the socket of the photons' interface for a factor on what passes, not on what is reflected
DIFFUSE = {"BSDF_DIFFUSE", "EEVEE_SPECULAR", "SUBSURFACE_SCATTERING", "BSDF_TRANSLUCENT"}
MIRRORS = {"BSDF_GLOSSY", "BSDF_GLASS", "BSDF_REFRACTION"}
MIXERS = {"MIX_SHADER", "ADD_SHADER"}


class Effect(NamedTuple):
    """What a material does to photons.

    copy:  the material that does to photons what it does to light; None where it neither bends nor mirrors nor absorbs
    bends: whether it bends or mirrors
    lands: whether light lands on it
    reads: object_values.attributes_of() it
    """

    copy: bpy.types.Material | None
    bends: bool
    lands: bool
    reads: set[tuple[str, str]]


class Bending:
    """The materials that photons meet, made as they are asked for.

    group:  the interface for photons
    trees:  all node trees that have switches
    dark:   the material of what only stops light
    shares: of a crossing into each of the interfaces met so far, (n_outside / n_inside)^2, the Interface itself where that
            depends on the wavelength, None where a node decides it
    tinted: whether any of them takes colour from light
    """

    def __init__(self):
        self.trees: list[bpy.types.NodeTree] = []
        self.shares: set[float | Interface | None] = set()
        self.tinted = False
        self._effects: dict[str | None, Effect] = {}
        self._groups: dict[Closure, bpy.types.NodeTree] = {}
        self.group = self._optics()
        self.dark = bpy.data.materials.new("NIM dark")
        nodes = Nodes(empty_tree(self.dark))
        nodes.end(nodes.add("ShaderNodeHoldout"))

    def of(self, material: bpy.types.Material | None, name: str) -> Effect:
        """What a material does to photons; name: of the object that wears it.

        Raises ValueError, one sentence, where light goes through it in a way that is not traced.
        """
        key = material and material.name_full
        if key not in self._effects:
            check(material, name)
            sharp = bends(material)
            copy = self._copy(material) if sharp or is_volume(material) else None
            self._effects[key] = Effect(copy, sharp, lands(material), attributes_of(material))
        return self._effects[key]

    def set(self, **switches: float) -> None:
        """Give the switches of those names, in all trees, a value, 0 or 1."""
        for tree in self.trees:
            for name, value in switches.items():
                node = tree.nodes.get(f"NIM {name}")
                # what is set is compiled anew, be it to what it was
                if node and node.outputs[0].default_value != value:
                    node.outputs[0].default_value = value

    def _copy(self, material):
        copy = material.copy()
        own_groups(copy.node_tree)
        carry(copy)
        trees = {copy.node_tree}
        for node, path in asked(copy):
            if is_interface(node):
                self._note(node, path)
            trees.add(node.id_data)
            kind = kind_of(node, path)
            if carrier := carrier_of(node):
                self._carry(carrier, node, path)
            elif kind == "glass":
                self._vitrify(node, path)
            elif kind == "mirror":
                self._tame(node, path)
            elif node.type == "EMISSION":
                _unlinked(node.inputs["Strength"]).default_value = 0.0
        for tree in trees:
            for node in tree.nodes:
                if is_interface(node):
                    node.node_tree = self.group
        output = copy.node_tree.get_output_node("CYCLES")
        if output.inputs["Volume"].is_linked:
            self.tinted = True
            nodes = Nodes(copy.node_tree)
            # not quite 0, where Cycles would leave the volume away, and take what has no surface for an opaque one
            factor = nodes.math("MAXIMUM", switch(nodes, "tinted"), 1e-20)
            volume = nodes.add(
                "ShaderNodeMixShader", inputs={0: factor, 2: output.inputs["Volume"].links[0].from_socket}
            )
            nodes.feed(output.inputs["Volume"], volume.outputs[0])
        self.trees += trees
        return copy

    def _note(self, node, path):
        """Remember what an interface does to light: to its counting, and to its colour."""
        interface = interface_of(node, path)
        if interface is None or interface.inside.n:  # else no light crosses it
            disperses = interface and (interface.inside.dispersion or interface.outside.dispersion)
            self.shares.add(interface if disperses or interface is None else round(share_of(interface), 9))
        self.tinted |= not _is_white(node.inputs["Tint"], path)
        losses = (node.inputs[f"{loss} {side}"] for loss in LOSSES for side in ("Inside", "Outside"))
        self.tinted |= any(value_of(socket, path) != 0.0 for socket in losses)

    def _carry(self, carrier, node, path):
        """Let one of CARRIERS be of nodes, and its tint and losses count only while the photons' colours are asked for."""
        window = window_of(node, path) if carrier is LENSLET_WINDOW else None
        if carrier is GRADED_CORE:
            node.node_tree = self._counted(carrier, around_a_core)
        elif carrier is not LENSLET_WINDOW or (window and window.keeps_solid_angle):
            node.node_tree = carrier.group("nodes")
            self.shares.add(1.0)
        else:
            node.node_tree = self._counted(carrier, at_lenslets)
        nodes = Nodes(node.id_data)
        if "Tint" in node.inputs:
            tint = node.inputs["Tint"]
            self.tinted |= not _is_white(tint, path)
            nodes.feed(tint, nodes.mix(switch(nodes, "tinted"), WHITE, fed(tint)))
        if "Losses" in node.inputs:
            losses = node.inputs["Losses"]
            self.tinted |= value_of(losses, path) != 0.0
            nodes.feed(losses, nodes.math("MULTIPLY", fed(losses), switch(nodes, "tinted")))

    def _counted(self, carrier, make):
        """The group of a closure whose crossings count, made on first use."""
        self.shares.add(None)
        if carrier not in self._groups:
            self._groups[carrier] = make()
            self.trees.append(self._groups[carrier])
        return self._groups[carrier]

    def _vitrify(self, glass, path):
        """Put our interface, whose crossings are counted, in the place of a Glass or Principled BSDF: they are the same."""
        nodes = Nodes(glass.id_data)
        ior = glass.inputs["IOR"]
        inputs: dict[str | int, Any] = {"Index Inside": fed(ior)}
        inputs |= {"Index Outside": 1.0, "Permeability Inside": 1.0, "Permeability Outside": 1.0}
        if glass.type == "BSDF_GLASS":
            color = glass.inputs["Color"]
            inputs["Tint"] = fed(color)
        else:  # its colour is that of two crossings, and what it reflects has none
            color = glass.inputs["Base Color"]
            parts = nodes.add("ShaderNodeSeparateColor", inputs={0: fed(color)}).outputs
            roots: dict[str | int, Any] = {index: nodes.math("SQRT", part) for index, part in enumerate(parts)}
            inputs["Tint"], inputs[THROUGH] = WHITE, nodes.add("ShaderNodeCombineColor", inputs=roots).outputs[0]
        if glass.inputs["Normal"].is_linked:
            inputs["Normal"] = fed(glass.inputs["Normal"])
        node = nodes.add("ShaderNodeGroup", node_tree=self.group, inputs=inputs)
        for link in list(glass.outputs[0].links):
            glass.id_data.links.new(node.outputs[0], link.to_socket)
        number = value_of(ior, path)
        self.shares.add(round(number**-2, 9) if number else None)
        self.tinted |= not _is_white(color, path)

    def _tame(self, node, path):
        """Let a mirror's colour, or a refraction's, count only while the photons' colours are asked for."""
        nodes = Nodes(node.id_data)
        metal = node.type == "BSDF_PRINCIPLED"
        for name in ("Base Color", "Specular Tint") if metal else ("Color",):
            self.tinted |= not _is_white(node.inputs[name], path)
            color = nodes.mix(switch(nodes, "tinted"), WHITE, fed(node.inputs[name]))
            if node.type == "BSDF_REFRACTION":
                ior, number = fed(node.inputs["IOR"]), value_of(node.inputs["IOR"], path)
                self.shares.add(round(number**-2, 9) if number else None)
                back = nodes.add("ShaderNodeNewGeometry").outputs["Backfacing"]
                exponent = nodes.math("MULTIPLY_ADD", back, 4 * POWER, -2 * POWER)
                told = count(nodes, nodes.math("POWER", ior, exponent))
                color = nodes.mix(switch(nodes, "counted"), color, told)
            nodes.feed(node.inputs[name], color)
        if metal:
            _unlinked(node.inputs["Emission Strength"]).default_value = 0.0

    def _optics(self):
        """The group of the interface in Blender's nodes, with switches for its tint and for what crossings count."""
        group = INTERFACE.new_copy("NIM photons")
        optics = Optics(**handles(group))
        item = group.interface.new_socket(THROUGH, in_out="INPUT", socket_type="NodeSocketColor")
        item.default_value = (1.0, 1.0, 1.0, 1.0)
        nodes = Nodes(group)
        # Blender's Glass cannot tell what it reflects from what it lets through
        _unlinked(optics.glass_or_not.inputs[0]).default_value = 0.0
        # where no ray goes on all are mirrored, and what the surface absorbs of them is counted apart, as on the way to it
        clear = nodes.math("SUBTRACT", 1.0, switch(nodes, "tinted"))
        mirrored = nodes.math("MULTIPLY", optics.stops.outputs[0], clear)
        R, lost = (node.inputs[0] for node in (optics.reflected_or_not, optics.absorbed_or_not))
        nodes.feed(R, nodes.math("MAXIMUM", fed(R), mirrored))
        nodes.feed(lost, nodes.math("MULTIPLY", fed(lost), switch(nodes, "tinted")))
        tint = optics.reflected.inputs["Color"].links[0].from_socket
        through = nodes.vector("MULTIPLY", tint, nodes.add("NodeGroupInput").outputs[THROUGH])
        reflected, passed = (nodes.mix(switch(nodes, "tinted"), WHITE, color) for color in (tint, through))
        told = count(nodes, nodes.math("POWER", optics.q_squared.outputs[0], POWER))
        counted = nodes.mix(switch(nodes, "counted"), passed, told)
        nodes.feed(optics.reflected.inputs["Color"], reflected)
        for node in (optics.refraction, optics.portal):
            nodes.feed(node.inputs["Color"], counted)
        self.trees.append(group)
        return group


def share_of(crossing: float | Interface, wavelength_nm: ArrayLike = REPRESENTATIVE_NM) -> Any:
    """The share of a crossing into an interface, one of Bending.shares, (...) at wavelengths (...), nanometres."""
    if not isinstance(crossing, Interface):
        return crossing
    outside, inside = (medium.spectrum(wavelength_nm)[0].real for medium in (crossing.outside, crossing.inside))
    return (outside / inside) ** 2


# ------------------------------------------------------------------------------------------------ kinds of materials


def kind_of(node: bpy.types.Node, path: tuple[bpy.types.Node, ...]) -> str | None:
    """What a closure is to photons: "glass" or "mirror", where it is sharp; "diffuse", where light lands on it; "rough",
    where it lets light through otherwise; None for all else, which only stops light.
    """
    if node.type in DIFFUSE:
        return "diffuse"
    if node.type in MIRRORS:
        roughness = value_of(node.inputs["Roughness"], path)
        if roughness is not None and roughness <= SHINY:
            return "glass" if node.type == "BSDF_GLASS" else "mirror"
        return None if node.type == "BSDF_GLOSSY" else "rough"
    if node.type == "BSDF_PRINCIPLED":
        return _principled(node, path)
    return None


def _principled(node, path):
    value = {
        name: value_of(node.inputs[name], path) if name in node.inputs else 0.0
        for name in (
            "Roughness",
            "Metallic",
            "Transmission Weight",
            "Coat Weight",
            "Sheen Weight",
            "Thin Film Thickness",
        )
    }
    alpha, tint = value_of(node.inputs["Alpha"], path), value_of(node.inputs["Specular Tint"], path)
    plain = value["Coat Weight"] == value["Sheen Weight"] == value["Thin Film Thickness"] == 0.0 and alpha == 1.0
    sharp = plain and value["Roughness"] is not None and value["Roughness"] <= SHINY
    if value["Metallic"] == 1.0:
        return "mirror" if sharp else None
    if value["Transmission Weight"] == 0.0:
        return "diffuse"
    whole = value["Transmission Weight"] == 1.0 and value["Metallic"] == 0.0
    return "glass" if whole and sharp and tint[:3] == WHITE else "rough"


def carrier_of(node: bpy.types.Node) -> Closure | None:
    """The closure of a node that is one of CARRIERS; None of all else."""
    closure = closure_of_node(node)
    return closure if closure in CARRIERS else None


def lands(material: bpy.types.Material | None) -> bool:
    """Whether light lands on a material: it scatters diffusely."""
    return not has_nodes(material) or any(kind_of(*node) == "diffuse" for node in asked(material))


def bends(material: bpy.types.Material | None) -> bool:
    """Whether photons are bent or mirrored by a material: by one of our closures, or sharply by what does not scatter too."""
    nodes = asked(material)
    if any(is_interface(node) or carrier_of(node) for node, _ in nodes):
        return True
    kinds = [kind_of(*node) for node in nodes]
    if any(
        kind == "diffuse" or (kind is None and node.type in MIRRORS)
        for (node, _), kind in zip(nodes, kinds, strict=True)
    ):
        return False
    return "glass" in kinds or "mirror" in kinds


def is_volume(material: bpy.types.Material | None) -> bool:
    """Whether a material has a volume and no surface."""
    output = material.node_tree.get_output_node("CYCLES") if has_nodes(material) else None
    return output is not None and not asked(material) and bool(asked(material, "Volume"))


def check(material: bpy.types.Material | None, name: str) -> None:
    """Raise ValueError, one sentence, for a material by which light goes in a way that photons do not.

    name: of the object that wears it
    """
    if not has_nodes(material):
        return
    kinds = [(node, kind_of(node, path)) for node, path in asked(material)]
    scatters = any(kind == "diffuse" or (kind is None and node.type == "BSDF_GLOSSY") for node, kind in kinds)
    ours = any(is_interface(node) or carrier_of(node) for node, _ in kinds)
    passes = ours or any(kind == "glass" or node.type == "BSDF_REFRACTION" for node, kind in kinds)
    whose = f"the material {material.name} of {name}"
    for node, _ in kinds:
        if _is_shader(node) and (closure := closure_of_node(node)) and not (is_interface(node) or carrier_of(node)):
            raise ValueError(
                f"{whose} bends light by a {closure.label}, of which caustics know nothing; give {name} another material, or "
                "hide it from renders."
            )
    if any(kind == "rough" for _, kind in kinds) or (scatters and passes):
        raise ValueError(
            f"{whose} lets light through in part or roughly, and caustics are traced through smooth and clear glass only; set "
            "its Transmission to 1 or 0, Alpha to 1, and Roughness, Metallic, Coat and Sheen to 0, or hide it from renders."
        )
    if any(is_interface(node) and is_rough(node, path) for node, path in asked(material)):
        raise ValueError(
            f"{whose} is rough, so that Cycles finds lamps in it by itself, and a bake would count that light twice; set its "
            f"Roughness to 0, or hide {name} from renders."
        )
    if not bends(material) and not is_volume(material):
        return
    types = {node.type for node, _ in kinds}
    if "BSDF_TRANSPARENT" in types:
        raise ValueError(
            f"{whose} lets light pass straight too, by a Transparent BSDF, and a bake would count that light twice; take "
            "the Transparent BSDF out of it."
        )
    if "LIGHT_PATH" in types:
        raise ValueError(
            f"{whose} is not the same for all rays, by its Light Path node, and a bake would count light twice; take the "
            "Light Path node out of it."
        )
    if not absorbs(material):
        raise ValueError(
            f"the volume of {whose} scatters or shines, and caustics are traced through absorbing volumes only; make it a "
            "Volume Absorption, or hide it from renders."
        )


def absorbs(material: bpy.types.Material | None) -> bool:
    """Whether the volume of a material, where it has one, takes light and does nothing else to it."""
    return all(
        node.type == "VOLUME_ABSORPTION" or node.type in MIXERS or not _is_shader(node)
        for node, _ in asked(material, "Volume")
    )


def _is_shader(node):
    return any(socket.type == "SHADER" for socket in node.outputs)


def own_groups(tree: bpy.types.NodeTree) -> list[bpy.types.NodeTree]:
    """Give a tree copies of its own of all groups in it, but our closures, so that nodes within them can be changed.

    Returns the copies.
    """
    copies = []
    for node in tree.nodes:
        if node.type == "GROUP" and node.node_tree and not closure_of_node(node):
            node.node_tree = node.node_tree.copy()
            copies += [node.node_tree, *own_groups(node.node_tree)]
    return copies


# ------------------------------------------------------------------------------------------------ nodes


def _unlinked(socket):
    """That input, linked to nothing."""
    for link in list(socket.links):
        socket.id_data.links.remove(link)
    return socket


def _is_white(socket, path):
    value = value_of(socket, path)
    return value is not None and value[:3] == WHITE
