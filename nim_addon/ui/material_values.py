# SPDX-License-Identifier: GPL-3.0-or-later
"""The media of a material's interface node as properties of the material, and what is wrong with them."""

import functools
import math

import bpy
from bpy.app.translations import pgettext_iface

from ..cycles import dispersive
from ..cycles.material import interface_nodes, interface_of, number_of, set_medium
from ..physics import MEDIA, REPRESENTATIVE_NM, VISIBLE_NM, Interface, Medium
from ..physics.media import LEAST_MAGNITUDE, MOST_MAGNITUDE, OPAQUE
from .material_media import k_of_length, medium_node_of, sockets_by_output, take_away
from .media import (
    ABSORBING,
    ABSORBING_NUMBER,
    CUSTOM,
    DISPERSIVE_NUMBERS,
    FILE,
    FILE_NUMBER,
    MEDIUM_NUMBERS,
    MOST_K,
    MOST_MU,
    MOST_N,
    PANEL_ITEMS,
    number,
    plain,
)
from .translations import OWN


def active_node(material: bpy.types.Material | None) -> bpy.types.Node | None:
    """The interface node of a material (or None) that the panel shows: the active one, else the first; or None."""
    nodes = interface_nodes(material)
    active = material.node_tree.nodes.active if nodes else None
    return active if active in nodes else next(iter(nodes), None)


def sockets_of(node: bpy.types.Node, side: str) -> tuple[bpy.types.NodeSocket, bpy.types.NodeSocket]:
    """The sockets of n and mu of a side, "inside" or "outside"."""
    title = side.title()
    return node.inputs[f"Index {title}"], node.inputs[f"Permeability {title}"]


def _values(node, side):
    """n and mu of a side as both shaders read them: mu with the sign of n."""
    n, mu = (plain(socket.default_value) for socket in sockets_of(node, side))
    return n, math.copysign(mu, n)


SYMBOLS = "n", "μ"
# What a medium absorbs within that begins to absorb, metres: of the size of a thing that one looks through.
FIRST_LENGTH = 0.1
NO_INDEX = "n = 0 refracts nothing: give a positive index, or a negative one for a NIM."
NO_PERMEABILITY = "μ = 0 has no impedance: give a positive or a negative permeability."


def complaints(node: bpy.types.Node, side: str) -> list[str]:
    """What is wrong with n and mu of a side, in a sentence each: what a script, a Value node or a keyframe may put there."""
    found = []
    for socket, name, none in zip(sockets_of(node, side), SYMBOLS, (NO_INDEX, NO_PERMEABILITY), strict=True):
        value = number_of(socket)
        if value is None or LEAST_MAGNITUDE <= abs(value) <= MOST_MAGNITUDE:  # which what is no number is not
            continue
        if value == 0:
            found.append(pgettext_iface(none))
        elif math.isnan(value):
            found.append(
                pgettext_iface("{name} is no number: give one, such as {example}.").format(name=name, example=-1)
            )
        else:
            text = pgettext_iface(
                "{name} = {value} is out of range: without its sign it lies between {low} and {high}."
            )
            found.append(
                text.format(name=name, value=number(value), low=number(LEAST_MAGNITUDE), high=number(MOST_MAGNITUDE))
            )
    return found


def sign_note(node: bpy.types.Node, side: str) -> str:
    """What to say where mu has the sign that it cannot have beside n, and so counts with the other; empty where it has not.

    As both shaders read it, and cycles.material.interface_of(): Re(mu n*) is never negative.
    """
    n, mu = (number_of(socket) for socket in sockets_of(node, side))
    if n is None or mu is None:
        return ""
    k, _, mu_imag = _loss(node, side)
    if n * mu + k * mu_imag >= 0 or not math.isfinite(n * mu):
        return ""
    return pgettext_iface("μ counts as {mu} here: it takes the sign of n.").format(mu=number(-mu))


def _number_property(side, which, **how):
    """A side's n (0) or mu (1), as `which` says, for scripts: no more than another name of the node's socket."""

    def read(self):
        node = active_node(self.id_data)
        return _values(node, side)[which] if node else 1.0

    def write(self, value):
        node = active_node(self.id_data)
        if node and self.id_data.is_editable:
            sockets_of(node, side)[which].default_value = value

    return bpy.props.FloatProperty(get=read, set=write, precision=3, options=set(), **how)


def _index(side):
    text = "Refractive index, as the node's own socket holds it; negative for a negative-index material"
    return _number_property(side, 0, name="n", description=text, min=-MOST_N, max=MOST_N)


def _permeability(side):
    text = "Relative permeability, as the node's own socket holds it, with the sign of n"
    return _number_property(side, 1, name="μ", description=text, min=-MOST_MU, max=MOST_MU)


def _loss(node, side):
    """k, the absorption per metre and the loss of mu that stand in the sockets of a side."""
    sockets = sockets_by_output(node, side)
    names = "Extinction", "Absorption", "Permeability Loss"
    return tuple(plain(sockets[name].default_value) if name in sockets else 0.0 for name in names)


def _set_loss(material, side, k, absorption):
    """Write k, and the absorption per metre that goes with it, into the sockets of a side."""
    node = active_node(material)
    if node is None or not material.is_editable:
        return
    sockets = sockets_by_output(node, side)
    for name, value in (("Extinction", k), ("Absorption", absorption)):
        if name in sockets and sockets[name].default_value != value:
            sockets[name].default_value = value


def _extinction(side):
    def read(self):
        node = active_node(self.id_data)
        return _loss(node, side)[0] if node else 0.0

    def write(self, value):
        _set_loss(self.id_data, side, value, 4 * math.pi * value / (REPRESENTATIVE_NM * 1e-9))

    return bpy.props.FloatProperty(
        name="k",
        description="Extinction, the imaginary part of n. Beyond 0.001 a surface is a mirror for all that one can see, and "
        "nothing is seen through it: for a clear liquid give the absorption length",
        get=read,
        set=write,
        min=0.0,
        max=MOST_K,
        step=1,
        precision=4,
        options=set(),
    )


def _absorption_length(side):
    def read(self):
        node = active_node(self.id_data)
        absorption = _loss(node, side)[1] if node else 0.0
        return 1 / absorption if absorption else 0.0

    def write(self, value):
        _set_loss(self.id_data, side, *((k_of_length(value), 1 / value) if value else (0.0, 0.0)))

    return bpy.props.FloatProperty(
        name="Absorption Length",
        description="The way within which light falls to 1/e, in all colors alike; 0 where nothing is absorbed",
        get=read,
        set=write,
        min=0.0,
        soft_max=100.0,
        step=1,
        precision=4,
        unit="LENGTH",
        options=set(),
    )


def source_name(source: bpy.types.Node) -> str:
    """What the medium of a medium's node is called."""
    return str(source.node_tree[dispersive.MARK])


def medium_name(node: bpy.types.Node, side: str) -> str:
    """What stands on a side of an interface node: the identifier of a menu's item."""
    if (source := medium_node_of(node, side)) is not None:
        name = source_name(source)
        return name if name in DISPERSIVE_NUMBERS else FILE
    k, absorption, mu_imag = _loss(node, side)
    if k or absorption or mu_imag:
        return ABSORBING if absorption and k <= OPAQUE and not mu_imag else CUSTOM
    values = _values(node, side)
    return next((name for name in MEDIUM_NUMBERS if (MEDIA[name].n, MEDIA[name].mu) == values), CUSTOM)


def choose_medium(material: bpy.types.Material, side: str, medium: Medium) -> None:
    """Put a medium on a side of a material's interface node; nothing where there is none, or it cannot be changed here.

    Raises ValueError for a medium that is not known over all the visible.
    """
    node = active_node(material)
    if node and material.is_editable:
        set_medium(node, side.title(), medium)


_ITEM_NUMBERS = MEDIUM_NUMBERS | DISPERSIVE_NUMBERS | {CUSTOM: 0, ABSORBING: ABSORBING_NUMBER, FILE: FILE_NUMBER}
_ITEM_NAMES = {value: name for name, value in _ITEM_NUMBERS.items()}


def _medium(side):
    def read(self):
        node = active_node(self.id_data)
        return _ITEM_NUMBERS[medium_name(node, side)] if node else 0

    def write(self, value):
        node, name = active_node(self.id_data), _ITEM_NAMES[value]
        if node is None or not self.id_data.is_editable:
            return
        if name == FILE:
            if not bpy.app.background:  # where no file browser opens
                bpy.ops.nim.medium_file("INVOKE_DEFAULT", material=self.id_data.name, side=side)
        elif name in (CUSTOM, ABSORBING):
            was = medium_name(node, side)
            take_away(node, side)
            if name == ABSORBING and was != ABSORBING:
                _set_loss(self.id_data, side, k_of_length(FIRST_LENGTH), 1 / FIRST_LENGTH)
            elif name == CUSTOM and was == ABSORBING:
                _set_loss(self.id_data, side, 0.0, 0.0)
        else:
            choose_medium(self.id_data, side, Medium.parse(name))

    return bpy.props.EnumProperty(
        name="Medium",
        description="A ready medium; n and μ can be typed below",
        items=PANEL_ITEMS,
        translation_context=OWN,
        get=read,
        set=write,
        options=set(),
    )


class NIM_PG_material(bpy.types.PropertyGroup):
    """The media of a material's interface node. Nothing is stored here: the values are the node's own sockets.

    n and mu are for scripts: panels show the sockets themselves, which can be animated.
    """

    medium_inside: _medium("inside")
    medium_outside: _medium("outside")
    n_inside: _index("inside")
    n_outside: _index("outside")
    mu_inside: _permeability("inside")
    mu_outside: _permeability("outside")
    k_inside: _extinction("inside")
    k_outside: _extinction("outside")
    length_inside: _absorption_length("inside")
    length_outside: _absorption_length("outside")


class NIM_PG_curve(bpy.types.PropertyGroup):
    """What the curve of a material shows of media that absorb or disperse."""

    over: bpy.props.EnumProperty(
        name="Over",
        description="What the curve runs over",
        items=(
            ("ANGLE", "Angle", "R over the angle of incidence, at one wavelength", "NONE", 0),
            ("WAVELENGTH", "Wavelength", "n, k and R at normal incidence over the wavelength", "NONE", 1),
        ),
        translation_context=OWN,
    )
    wavelength: bpy.props.FloatProperty(
        name="Wavelength (nm)",
        description="The wavelength in vacuum, in nanometers, that the numbers and the curve are of",
        default=REPRESENTATIVE_NM,
        min=VISIBLE_NM[0],
        max=VISIBLE_NM[1],
        step=1000,
        precision=1,
    )
    side: bpy.props.EnumProperty(
        name="From",
        description="Which side the light of the probe comes from",
        items=(
            ("OUTSIDE", "From Outside", "Light from the side that the normals point to", "NONE", 0),
            ("INSIDE", "From Inside", "Light from behind the faces", "NONE", 1),
        ),
    )
    angle: bpy.props.FloatProperty(
        name="θ₁",
        description="Angle of incidence of the probe: R, T and the angle of the transmitted ray are told, and marked on the "
        "curve; no render depends on it",
        default=math.radians(45),
        min=0.0,
        max=math.pi / 2,
        subtype="ANGLE",
        step=100,
        precision=2,
    )


def wavelength_of(scene: bpy.types.Scene) -> float:
    """The wavelength in vacuum, nanometres, that the panels show numbers of."""
    return plain(scene.nim_curve.wavelength)


@functools.lru_cache(maxsize=64)
def _typed(interface):
    """The Interface of the numbers that a person typed, the same object each time."""
    return Interface(*map(_medium_typed, (interface.inside, interface.outside)))


def _medium_typed(medium):
    index, permeability = (
        complex(plain(value.real), plain(value.imag)) if value.imag else plain(value.real)
        for value in (medium.index, medium.permeability)
    )
    try:
        return medium if medium.dispersion else Medium(index, permeability)
    except ValueError:  # which go together in all their digits alone
        return medium


def interface_shown(node: bpy.types.Node) -> Interface | None:
    """The physics.Interface of a node, its numbers as a person typed them; None where interface_of() is None."""
    interface = interface_of(node)
    return interface and _typed(interface)


CLASSES = (NIM_PG_material, NIM_PG_curve)


def register():
    """Give each material its NIM_PG_material, and each scene its NIM_PG_curve."""
    bpy.types.Material.nim = bpy.props.PointerProperty(
        type=NIM_PG_material, name="Negative Index", description="The media of the material's interface node"
    )
    bpy.types.Scene.nim_curve = bpy.props.PointerProperty(
        type=NIM_PG_curve, name="NIM Curve", description="What the curve of a material shows"
    )


def unregister():
    """Take them back."""
    del bpy.types.Scene.nim_curve
    del bpy.types.Material.nim
