# SPDX-License-Identifier: GPL-3.0-or-later
"""The Negative Index panel: the media of both sides of an interface, and what they mean, live."""

import functools
import math

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface, pgettext_rpt

from ..cycles.animation import curves_of
from ..cycles.closures import INTERFACE
from ..cycles.material import (
    interface_nodes,
    interface_of,
    number_of,
    osl_available,
    resolve,
    switch_backend,
)
from ..physics import MEDIA, Interface, Medium
from ..physics.media import LEAST_MAGNITUDE, MOST_MAGNITUDE
from . import curve, preferences, warnings
from .panels import draw_sentence
from .translations import OWN

# Of media with the same numbers the first stands for all. The numbers are kept in files: never change one.
MEDIUM_NUMBERS = {
    "air": 1,
    "water": 2,
    "glass": 3,
    "diamond": 4,
    "nim-1.025": 5,
    "nim-1.33": 6,
    "nim-1.5": 7,
    "nim-2.418": 8,
    "nim-4.1": 9,
    "nim-mu10": 10,
    "nim-mu25": 11,
}
MEDIUM_NAMES = {"air": "Air, vacuum", "water": "Water", "glass": "Glass", "diamond": "Diamond"}
CUSTOM = "custom"
SIDES = ("inside", "outside")
# The range of the node's sockets.
MOST_N, MOST_MU = 10.0, 100.0
# Wider than this, at a scale of 1, a region shows the curve beside the numbers; narrower, below them.
WIDE = 460
# The curve's side, in Blender's own unit of a button's height.
CURVE_UNITS = 10


def number(value):
    """A number as a person writes it: four digits that count, no trailing zeros."""
    return f"{value:.4g}"


def _plain(value):
    """The shortest decimal that a single-precision socket value stands for: -1.33, not -1.3300000429."""
    return float(str(np.float32(value)))


def _medium_label(name):
    medium = MEDIA[name]
    text = f"{MEDIUM_NAMES.get(name, 'NIM')}   {number(medium.n)}"
    return text if abs(medium.mu) == 1 else f"{text}, mu {number(medium.mu)}"


def _medium_help(name):
    medium = MEDIA[name]
    return f"n = {number(medium.n)}, mu = {number(medium.mu)}"


MEDIUM_ITEMS = (
    *((name, _medium_label(name), _medium_help(name), "NONE", value) for name, value in MEDIUM_NUMBERS.items()),
    (CUSTOM, "Own values", "The n and mu that are typed in", "NONE", 0),
)


# ------------------------------------------------------------------------------- the values, in the node's sockets


def active_node(material):
    """The interface node of a material (or None) that the panel shows: the active one, else the first; or None."""
    nodes = interface_nodes(material)
    active = material.node_tree.nodes.active if nodes else None
    return active if active in nodes else next(iter(nodes), None)


def _sockets(node, side):
    title = side.title()
    return node.inputs[f"Index {title}"], node.inputs[f"Permeability {title}"]


def _values(node, side):
    """n and mu of a side as both shaders read them: mu with the sign of n."""
    n, mu = (_plain(socket.default_value) for socket in _sockets(node, side))
    return n, math.copysign(mu, n)


NO_INDEX = "n = 0 refracts nothing: give a positive index, or a negative one for a NIM."
NO_PERMEABILITY = "mu = 0 has no impedance: give a positive or a negative permeability."


def _complaints(node, side):
    """What is wrong with n and mu of a side, in a sentence each: what a script, a Value node or a keyframe may put there."""
    found = []
    for socket, name, none in zip(_sockets(node, side), ("n", "mu"), (NO_INDEX, NO_PERMEABILITY), strict=True):
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


# What the panel says about the last value typed in, as long as the values are those it left behind.
_notes = {}


def _note(material, side):
    node = active_node(material)
    values, text, filled = _notes.get((material.session_uid, side), (None, "", {}))
    return pgettext_iface(text).format(**filled) if values == _values(node, side) else ""


def _set_values(material, side, n, mu):
    """Write n and mu into the sockets; mu takes the sign of n, and neither may be 0. The panel says what was changed."""
    node = active_node(material)
    if node is None or not material.is_editable:
        return
    before = _values(node, side)
    text, filled = "", {}
    # a script may write what a slider does not let through; what is no number is kept, and complained of, if it was there
    n, mu = (
        given if math.isnan(given) else max(-most, min(given, most)) for given, most in ((n, MOST_N), (mu, MOST_MU))
    )
    if n == 0 or math.isnan(n):
        n, text = before[0], NO_INDEX
    if mu == 0 or math.isnan(mu):
        mu, text = before[1], text or NO_PERMEABILITY
    if not text and math.copysign(mu, n) != mu:
        text, filled = "mu set to {mu} to go with n = {n}.", {"mu": number(-mu), "n": number(n)}
    for socket, value in zip(_sockets(node, side), (n, math.copysign(mu, n)), strict=True):
        if socket.default_value != value:
            socket.default_value = value
    if text:
        _notes[material.session_uid, side] = (_values(node, side), text, filled)


def _index(side):
    def read(self):
        node = active_node(self.id_data)
        return _values(node, side)[0] if node else 1.0

    def write(self, value):
        node = active_node(self.id_data)
        if node:
            _set_values(self.id_data, side, value, _values(node, side)[1])

    return bpy.props.FloatProperty(
        name="n",
        description="Refractive index; negative for a negative-index material. To animate it, put keyframes on the "
        "node's own socket",
        min=-MOST_N,
        max=MOST_N,
        step=1,
        precision=3,
        get=read,
        set=write,
        options=set(),
    )


def _permeability(side):
    def read(self):
        node = active_node(self.id_data)
        return _values(node, side)[1] if node else 1.0

    def write(self, value):
        node = active_node(self.id_data)
        if node:
            _set_values(self.id_data, side, _values(node, side)[0], value)

    return bpy.props.FloatProperty(
        name="mu",
        description="Relative permeability; it always has the sign of n",
        min=-MOST_MU,
        max=MOST_MU,
        step=10,
        precision=3,
        get=read,
        set=write,
        options=set(),
    )


def _medium(side):
    def read(self):
        node = active_node(self.id_data)
        values = _values(node, side) if node else None
        return next((i for name, i in MEDIUM_NUMBERS.items() if (MEDIA[name].n, MEDIA[name].mu) == values), 0)

    def write(self, value):
        name = next((name for name, i in MEDIUM_NUMBERS.items() if i == value), None)
        if name:
            _set_values(self.id_data, side, MEDIA[name].n, MEDIA[name].mu)

    return bpy.props.EnumProperty(
        name="Medium",
        description="A ready medium; n and mu can be typed below",
        items=MEDIUM_ITEMS,
        translation_context=OWN,
        get=read,
        set=write,
        options=set(),
    )


class NIM_PG_material(bpy.types.PropertyGroup):
    """The media of a material's interface node. Nothing is stored here: the values are the node's own sockets."""

    medium_inside: _medium("inside")
    medium_outside: _medium("outside")
    n_inside: _index("inside")
    n_outside: _index("outside")
    mu_inside: _permeability("inside")
    mu_outside: _permeability("outside")


# ------------------------------------------------------------------------------- the media as operator properties


def medium_property(default, name, description):
    """An EnumProperty of the ready media, for an operator."""
    return bpy.props.EnumProperty(
        name=name, description=description, items=MEDIUM_ITEMS, default=default, translation_context=OWN
    )


def index_property(default):
    """A FloatProperty of n, for an operator whose medium is "custom"."""
    return bpy.props.FloatProperty(
        name="n",
        description="Refractive index; any but 0",
        min=-MOST_N,
        max=MOST_N,
        default=default,
        step=1,
        precision=3,
    )


def permeability_property():
    """A FloatProperty of |mu|, for an operator whose medium is "custom"."""
    return bpy.props.FloatProperty(
        name="|mu|",
        description="Relative permeability; it takes the sign of n",
        min=0.001,
        max=MOST_MU,
        default=1.0,
        step=10,
        precision=3,
    )


def chosen_medium(name, n, mu):
    """The Medium of an enum item; of n and mu where it is "custom". Raises ValueError for n = 0."""
    if name != CUSTOM:
        return MEDIA[name]
    n = _plain(n)
    return Medium(n, math.copysign(_plain(mu), n) if n else None)


def backend_for(scene, choice=None):
    """The backend, "osl" or "nodes", of a new material, such that it renders in `scene` as that is set up.

    choice: "osl", "nodes" or "auto"; the preferences' if None. "auto" is OSL only where the scene has it turned on.
    """
    choice = choice or preferences.settings().backend
    if choice == "osl" and osl_available():
        return "osl"
    if choice == "nodes" or not getattr(scene, "cycles", None) or not scene.cycles.shading_system:
        return "nodes"
    return resolve("auto", scene)


# ------------------------------------------------------------------------------- what the values mean


@functools.lru_cache(maxsize=64)
def _readings(interface, _locale):
    back = interface.reversed()
    say = pgettext_iface
    lines = [(say("Bends backwards"), say("yes") if interface.bends_backwards else say("no"))]
    ratio = interface.inside.impedance / interface.outside.impedance
    lines.append((say("Impedance ratio Z_t / Z_i"), number(ratio)))
    R = float(interface.fresnel(1.0).R)
    lines.append((say("R at normal incidence"), f"{100 * R:.3g} %" if R > 1e-12 else "0 %"))
    lines.append((say("Critical angle"), _both_sides(interface.critical_angle(), back.critical_angle())))
    for polarization, label in (("p", "Brewster angle, p"), ("s", "Brewster angle, s")):
        angles = interface.brewster_angle(polarization), back.brewster_angle(polarization)
        if polarization == "p" or angles != (None, None):
            lines.append((say(label), _both_sides(*angles)))
    return tuple(lines)


def _both_sides(outside, inside):
    """An angle, in radians or None, seen from outside and from inside."""
    say = pgettext_iface
    parts = []
    if outside is not None:
        parts.append(say("{angle} from outside").format(angle=f"{math.degrees(outside):.1f}°"))
    if inside is not None:
        parts.append(say("{angle} from inside").format(angle=f"{math.degrees(inside):.1f}°"))
    return ", ".join(parts) or say("none")


def readings(interface):
    """What a physics.Interface means: pairs (label, value) of text, in the user's language, made once for each."""
    return _readings(interface, bpy.app.translations.locale)


@functools.lru_cache(maxsize=64)
def _summary(interface, _locale):
    say = pgettext_iface
    if interface.bends_backwards:
        bend = say("Light bends backwards here: n has another sign on the other side.")
    elif interface.inside.n == interface.outside.n:
        bend = say("Light goes straight on: n is the same on both sides.")
    else:
        bend = say("Light bends the usual way: n has the same sign on both sides.")
    if max(interface.fresnel(np.cos(curve.ANGLES[:-1:20])).R) < 1e-12:
        return bend, say("Nothing is reflected at any angle.")
    if interface.critical_angle() is not None:
        return bend, say("From {angle} on, all light from outside is reflected.").format(
            angle=f"{math.degrees(interface.critical_angle()):.1f}°"
        )
    if interface.reversed().critical_angle() is not None:
        return bend, say("From {angle} on, all light from inside is reflected.").format(
            angle=f"{math.degrees(interface.reversed().critical_angle()):.1f}°"
        )
    return bend, say("No angle reflects all light.")


def summary(interface):
    """What a physics.Interface does to light, in two sentences."""
    return _summary(interface, bpy.app.translations.locale)


# ------------------------------------------------------------------------------- drawing


@functools.lru_cache(maxsize=64)
def _interface(values):
    """The Interface of ((n, mu) inside, (n, mu) outside), the same object each time."""
    return Interface(*(Medium(n, mu) for n, mu in values))


def interface_shown(node):
    """The physics.Interface of a node, its numbers as a person typed them; None where interface_of() is None."""
    interface = interface_of(node)
    if interface is None:
        return None
    return _interface(tuple((_plain(one.n), _plain(one.mu)) for one in (interface.inside, interface.outside)))


def _animated(material, socket):
    """Whether keyframes or a driver decide a socket of the material's own node tree."""
    animation = material.node_tree.animation_data
    if animation is None:
        return False
    path = socket.path_from_id("default_value")
    keyed = [curve for curve, _ in curves_of(material.node_tree)]
    return any(one.data_path == path for one in (*animation.drivers, *keyed))


def draw_media(layout, context, material, sides=SIDES):
    """Draw the media of both sides of a material's interface node, to be changed there."""
    node = active_node(material)
    titles = {"inside": "Inside, behind the faces", "outside": "Outside, where the normals point"}
    for side in sides:
        column = layout.column(align=True)
        column.enabled = material.is_editable
        column.label(text=titles[side])
        sockets = _sockets(node, side)
        decided = [socket.is_linked or _animated(material, socket) for socket in sockets]
        if not any(decided):
            column.prop(material.nim, f"medium_{side}", text="")
        row = column.row(align=True)
        for socket, name, elsewhere in zip(sockets, ("n", "mu"), decided, strict=True):
            if socket.is_linked:
                row.label(text=f"{name}: {pgettext_iface('from the node tree')}", icon="LINKED", translate=False)
            elif elsewhere:
                row.prop(socket, "default_value", text=name, translate=False)
            else:
                row.prop(material.nim, f"{name}_{side}", text=name, translate=False)
        if note := _note(material, side):
            draw_sentence(column, context, note, icon="INFO")
        else:
            for text in _complaints(node, side):
                draw_sentence(column, context, text, icon="ERROR")


def draw_summary(layout, context, material):
    """Draw in two sentences what the media of a material's interface node do to light."""
    interface = interface_shown(active_node(material))
    if interface:
        column = layout.column()
        for sentence in summary(interface):
            draw_sentence(column, context, sentence)


def draw_readings(layout, context, material):
    """Draw what the media of a material's interface node mean: numbers and the curve."""
    node = active_node(material)
    interface = interface_shown(node)
    if interface is None and any(_complaints(node, side) for side in SIDES):
        return  # which draw_media() says
    if interface is None:
        text = pgettext_iface("The node tree decides n or mu, point by point: there is no one curve to show.")
        draw_sentence(layout, context, text, icon="INFO")
        return
    scale = context.preferences.system.ui_scale
    wide = context.region is not None and context.region.width > WIDE * scale
    box = layout.box()
    if wide:
        split = box.split(factor=min(0.6, (CURVE_UNITS + 0.5) * 20 * scale / context.region.width))
        left, right = split.column(), split.column(align=True)
    else:
        left = right = box.column(align=True)
    side = int(CURVE_UNITS * (round(18 * scale) + 2 * context.preferences.system.pixel_size))
    left.template_icon(curve.icon(interface, side, scale), scale=CURVE_UNITS)
    if not wide:
        right.separator()
    for label, value in readings(interface):
        if wide:
            line = right.column(align=True)
            line.scale_y = 0.8
            line.label(text=label, translate=False)
            line.label(text=value, icon="BLANK1", translate=False)
        else:
            draw_sentence(right, context, f"{label}: {value}")
    draw_sentence(
        box, context, pgettext_iface("R over the angle of incidence. Solid: from outside; dashed: from inside.")
    )


def draw_backend(layout, material):
    """Draw which backend the material has, and the buttons that give it another."""
    used = INTERFACE.backend_of(active_node(material).node_tree)
    column = layout.column(align=True)
    column.enabled = material.is_editable
    column.label(text="Rendered by")
    row = column.row(align=True)
    for choice, text in (("auto", "Auto"), ("osl", "OSL"), ("nodes", "Nodes")):
        cell = row.row(align=True)
        cell.enabled = choice != "osl" or osl_available()
        button = cell.operator("nim.switch_backend", text=text, depress=choice == used)
        button.material, button.backend = material.name, choice


def draw_material(layout, context, material):
    """Draw all of the panel for a material, or the button that makes a NIM where it has no interface node."""
    if material is None or active_node(material) is None:
        text = "This material has no negative-index interface." if material else "There is no material yet."
        draw_sentence(layout, context, pgettext_iface(text), icon="INFO")
        layout.operator("nim.convert", text="Make Negative-Index", icon="MATERIAL")
        return
    if not material.is_editable:
        text = pgettext_iface("The material is linked from a library: change it in that file.")
        draw_sentence(layout, context, text, icon="LIBRARY_DATA_DIRECT")
    draw_media(layout, context, material)
    draw_summary(layout, context, material)
    draw_readings(layout, context, material)
    tint = active_node(material).inputs["Tint"]
    row = layout.row()
    row.enabled = material.is_editable
    if tint.is_linked:
        row.label(text="Tint")
        row.label(text="from the node tree", icon="LINKED")
    else:
        row.prop(tint, "default_value", text="Tint")
    draw_backend(layout, material)
    warnings.draw_problems(layout, context, warnings.found(context.scene, material))


class NIM_OT_switch_backend(bpy.types.Operator):
    """Render the material by another backend, OSL or Blender's own nodes; its values and links stay"""

    bl_idname = "nim.switch_backend"
    bl_label = "Switch Backend"
    bl_options = {"REGISTER", "UNDO"}

    material: bpy.props.StringProperty(name="Material", description="Name of the material", options={"HIDDEN"})
    backend: bpy.props.EnumProperty(
        name="Backend",
        description="What the optics are made of",
        items=(
            ("auto", "Auto", "OSL where the scene has it turned on and the device can run it, else nodes", "NONE", 0),
            ("osl", "OSL", "The closure in the Open Shading Language", "NONE", 1),
            ("nodes", "Nodes", "The same optics in Blender's own nodes, for any build and device", "NONE", 2),
        ),
    )

    @classmethod
    def poll(cls, context):
        """Only where there is an interface material."""
        if not any(interface_nodes(material) for material in bpy.data.materials):
            cls.poll_message_set("No material here has a negative-index interface")
            return False
        return True

    def execute(self, context):
        """Switch, and say what is used now."""
        material = next((one for one in bpy.data.materials if one.name == self.material and one.is_editable), None)
        if not interface_nodes(material):
            text = pgettext_rpt("{name} is no material with an interface that can be changed here")
            self.report({"ERROR"}, text.format(name=repr(self.material)))
            return {"CANCELLED"}
        if self.backend == "osl" and not osl_available():
            text = pgettext_rpt("This Blender was built without OSL; choose nodes, or use a build from blender.org")
            self.report({"ERROR"}, text)
            return {"CANCELLED"}
        used = backend_for(context.scene, self.backend)
        switch_backend(material, used)
        names = {"osl": "OSL", "nodes": pgettext_rpt("Blender's own nodes")}
        self.report({"INFO"}, pgettext_rpt("{name}: {backend}").format(name=material.name, backend=names[used]))
        return {"FINISHED"}


class NIM_PT_material(bpy.types.Panel):
    """The media of both sides of the active material's interface, and what they mean"""

    bl_idname = "NIM_PT_material"
    bl_label = "Negative Index"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"

    @classmethod
    def poll(cls, context):
        """For a material, or a mesh that could have one."""
        return context.material is not None or (context.object is not None and context.object.type == "MESH")

    def draw(self, context):
        """Draw it."""
        draw_material(self.layout, context, context.material)


class NIM_PT_material_nodes(bpy.types.Panel):
    """The media of both sides of the edited material's interface, and what they mean"""

    bl_idname = "NIM_PT_material_nodes"
    bl_label = "Negative Index"
    bl_space_type = "NODE_EDITOR"
    bl_region_type = "UI"
    bl_category = "NIM"

    @classmethod
    def poll(cls, context):
        """For the shader trees of materials."""
        space = context.space_data
        return space.tree_type == "ShaderNodeTree" and isinstance(space.id, bpy.types.Material)

    def draw(self, context):
        """Draw it."""
        draw_material(self.layout, context, context.space_data.id)


CLASSES = (NIM_PG_material, NIM_OT_switch_backend, NIM_PT_material, NIM_PT_material_nodes)


def register():
    """Give each material its NIM_PG_material, and the curves their icons."""
    bpy.types.Material.nim = bpy.props.PointerProperty(
        type=NIM_PG_material, name="Negative Index", description="The media of the material's interface node"
    )
    curve.register()


def unregister():
    """Take them back."""
    curve.unregister()
    del bpy.types.Material.nim
    _notes.clear()
