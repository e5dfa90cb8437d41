# SPDX-License-Identifier: GPL-3.0-or-later
"""The Negative Index panel: the media of both sides of an interface, and what they mean, live."""

from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface, pgettext_rpt

from ..cycles.animation import curves_of
from ..cycles.closures import INTERFACE
from ..cycles.material import interface_nodes, osl_available, switch_backend
from ..physics import Medium
from ..physics.refractiveindex import SUFFIXES, load
from . import backends, curve, warnings
from .help import fail
from .material_media import medium_node_of, sockets_by_output
from .material_values import (
    SYMBOLS,
    active_node,
    choose_medium,
    complaints,
    interface_shown,
    medium_name,
    sign_note,
    sockets_of,
    source_name,
    wavelength_of,
)
from .media import ABSORBING, FILE, SIDES, backend_for, number
from .panels import Helped, Sidebar, draw_sentence
from .probe import draw_choices, draw_probe, shown_of
from .readings import readings, summary

# Wider than this, at a scale of 1, a region shows the curve beside the numbers; narrower, below them.
WIDE = 460
# The curve's side, in Blender's own unit of a button's height.
CURVE_UNITS = 10


def _animated(material, socket):
    """Whether keyframes or a driver decide a socket of the material's own node tree."""
    animation = material.node_tree.animation_data
    if animation is None:
        return False
    path = socket.path_from_id("default_value")
    keyed = [fcurve for fcurve, _ in curves_of(material.node_tree)]
    return any(fcurve.data_path == path for fcurve in (*animation.drivers, *keyed))


def draw_media(layout: bpy.types.UILayout, context: bpy.types.Context, material: bpy.types.Material) -> None:
    """Draw the media of both sides of a material's interface node, to be changed there."""
    node = active_node(material)
    titles = {"inside": "Inside, behind the faces", "outside": "Outside, where the normals point"}
    for side in SIDES:
        column = layout.column(align=True)
        column.enabled = material.is_editable
        column.label(text=titles[side])
        source = medium_node_of(node, side)
        if source is None:
            _draw_numbers(column, context, material, side)
            continue
        column.prop(material.nim, f"medium_{side}", text="")
        if medium_name(node, side) == FILE:
            column.label(text=source_name(source), icon="FILE", translate=False)


def _draw_numbers(column, context, material, side):
    """Draw n and mu of a side that no medium's node decides, and its absorption length where it has one.

    They are the sockets themselves: what Blender has for a value, keyframes, drivers, its menu, it has for these.
    """
    node = active_node(material)
    sockets = sockets_of(node, side)
    # greyed rather than gone, so that what is pointed at stays where it is
    menu = column.row()
    menu.enabled = not any(socket.is_linked or _animated(material, socket) for socket in sockets)
    menu.prop(material.nim, f"medium_{side}", text="")
    # side by side there is no room for the words
    numbers = column if any(socket.is_linked for socket in sockets) else column.row(align=True)
    for socket, name in zip(sockets, SYMBOLS, strict=True):
        if socket.is_linked:
            numbers.label(text=f"{name}: {pgettext_iface('from the node tree')}", icon="LINKED", translate=False)
        else:
            numbers.prop(socket, "default_value", text=name, translate=False)
    if medium_name(node, side) == ABSORBING:
        column.prop(material.nim, f"length_{side}")
    for text in complaints(node, side):
        draw_sentence(column, context, text, icon="ERROR")
    if text := sign_note(node, side):
        draw_sentence(column, context, text, icon="INFO")


def draw_loss(layout: bpy.types.UILayout, material: bpy.types.Material) -> None:
    """Draw what the media lose, folded: k, the absorption length and the loss of mu of a side that no node decides."""
    node = active_node(material)
    sides = [
        side for side in SIDES if medium_node_of(node, side) is None and sockets_by_output(node, side)["Extinction"]
    ]
    if not sides:
        return
    header, body = layout.panel("NIM_loss", default_closed=True)
    header.label(text="Loss")
    if body is None:
        return
    body.enabled = material.is_editable
    for side in sides:
        column = body.column(align=True)
        column.label(text="Inside" if side == "inside" else "Outside")
        for name in ("k", "length"):
            column.prop(material.nim, f"{name}_{side}")
        if loss := sockets_by_output(node, side).get("Permeability Loss"):
            column.prop(loss, "default_value", text="Loss of μ")


def draw_surface(layout: bpy.types.UILayout, material: bpy.types.Material) -> None:
    """Draw what the surface itself does to light, folded: its roughness, and the tint."""
    header, body = layout.panel("NIM_surface", default_closed=True)
    header.label(text="Surface")
    if body is None:
        return
    body.use_property_split = True
    body.use_property_decorate = False
    body.enabled = material.is_editable
    for name in ("Roughness", "Tint"):
        socket = active_node(material).inputs.get(name)
        if socket is None:
            continue
        if socket.is_linked:
            row = body.row(heading=name)
            row.label(text="from the node tree", icon="LINKED")
        else:
            body.prop(socket, "default_value", text=name)


def draw_summary(layout: bpy.types.UILayout, context: bpy.types.Context, material: bpy.types.Material) -> None:
    """Draw in some sentences what the media of a material's interface node do to light."""
    interface = interface_shown(active_node(material))
    if interface:
        column = layout.column()
        try:
            sentences = summary(interface, wavelength_of(context.scene))
        except ValueError as error:  # a medium that is not known at that wavelength
            draw_sentence(column, context, str(error), icon="ERROR")
            return
        for sentence in sentences:
            draw_sentence(column, context, sentence)


def draw_readings(layout: bpy.types.UILayout, context: bpy.types.Context, material: bpy.types.Material) -> None:
    """Draw what the media of a material's interface node mean: numbers, the curve and the probe on it."""
    node = active_node(material)
    interface = interface_shown(node)
    if interface is None and any(complaints(node, side) for side in SIDES):
        return  # which draw_media() says
    if interface is None:
        text = pgettext_iface("The node tree decides n or μ, point by point: there is no one curve to show.")
        draw_sentence(layout, context, text, icon="INFO")
        return
    box = layout.box()
    draw_choices(box, context.scene, interface)
    shown = shown_of(context.scene, interface)
    try:
        lines = readings(interface, shown.wavelength)
    except ValueError:  # which draw_summary() says
        return
    scale = context.preferences.system.ui_scale
    wide = context.region is not None and context.region.width > WIDE * scale
    if wide:
        split = box.split(factor=min(0.6, (CURVE_UNITS + 0.5) * 20 * scale / context.region.width))
        left, right = split.column(), split.column(align=True)
    else:
        left = right = box.column(align=True)
    side = int(CURVE_UNITS * (round(18 * scale) + 2 * context.preferences.system.pixel_size))
    left.template_icon(curve.icon(shown, side, scale), scale=CURVE_UNITS)
    if not wide:
        right.separator()
    for label, value in lines:
        if wide:
            line = right.column(align=True)
            line.scale_y = 0.8
            line.label(text=label, translate=False)
            line.label(text=value, icon="BLANK1", translate=False)
        else:
            draw_sentence(right, context, f"{label}: {value}")
    if shown.by_wavelength:
        text = pgettext_iface("Over the wavelength in nm: R at normal incidence, left; n and k, right.")
    else:
        text = pgettext_iface("R over the angle of incidence θ. Solid: from outside; dashed: from inside.")
    draw_sentence(box, context, text)
    draw_probe(box, context, material, shown)


def draw_backend(layout: bpy.types.UILayout, material: bpy.types.Material) -> None:
    """Draw which backend the material has, and the buttons that give it another."""
    used = INTERFACE.backend_of(active_node(material).node_tree)
    column = layout.column(align=True)
    column.enabled = material.is_editable
    column.label(text="Rendered by")
    row = column.row(align=True)
    for choice, text in (("auto", "Auto"), ("osl", "OSL"), ("nodes", "Nodes")):
        button = backends.draw_cell(row, choice).operator("nim.switch_backend", text=text, depress=choice == used)
        button.material, button.backend = material.name, choice


def draw_make(layout: bpy.types.UILayout, objects: list[bpy.types.Object]) -> None:
    """Draw the button that makes these objects negative-index: all of them, or of one that is in part the chosen slot."""
    button = layout.operator("nim.convert", icon="MATERIAL")
    partly = any(interface_nodes(slot.material) for object_ in objects for slot in object_.material_slots)
    button.slots = "ACTIVE" if partly and len(objects) == 1 else "ALL"


def draw_material(layout: bpy.types.UILayout, context: bpy.types.Context, material: bpy.types.Material | None) -> None:
    """Draw all of the panel for a material, or the button that makes a NIM where it has no interface node."""
    if material is None or active_node(material) is None:
        text = "This material is not negative-index yet." if material else "There is no material yet."
        draw_sentence(layout, context, pgettext_iface(text), icon="INFO")
        draw_make(layout, [context.object] if context.object else [])
        return
    if not material.is_editable:
        text = pgettext_iface("The material is linked from a library: change it in that file.")
        draw_sentence(layout, context, text, icon="LIBRARY_DATA_DIRECT")
    draw_media(layout, context, material)
    draw_summary(layout, context, material)
    draw_readings(layout, context, material)
    draw_loss(layout, material)
    draw_surface(layout, material)
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
            ("osl", "OSL", backends.OSL, "NONE", 1),
            ("nodes", "Nodes", "The same optics in Blender's own nodes, for any build and device", "NONE", 2),
        ),
    )

    @classmethod
    def description(cls, context, properties):
        """The tooltip: why it cannot be pressed, where that is so; else what Blender has of the class."""
        return backends.why_not(properties.backend)

    @classmethod
    def poll(cls, context):
        """Only where there is an interface material."""
        if not any(interface_nodes(material) for material in bpy.data.materials):
            cls.poll_message_set("There is no NIM Interface material here")
            return False
        return True

    def execute(self, context):
        """Switch, and say what is used now."""
        material = next(
            (known for known in bpy.data.materials if known.name == self.material and known.is_editable), None
        )
        if not interface_nodes(material):
            text = pgettext_rpt("{name} is no NIM Interface material that can be changed here")
            return fail(self, text.format(name=repr(self.material)))
        if self.backend == "osl" and not osl_available():
            return fail(self, pgettext_rpt(backends.OSL_MISSING))
        used = backend_for(context.scene, self.backend)
        switch_backend(material, used)
        names = {"osl": "OSL", "nodes": pgettext_rpt("Blender's own nodes")}
        self.report({"INFO"}, pgettext_rpt("{name}: {backend}").format(name=material.name, backend=names[used]))
        return {"FINISHED"}


class NIM_OT_medium_file(bpy.types.Operator):
    """Let a side of the material be of a file of the refractiveindex.info database: n and k by wavelength, a .yml"""

    bl_idname = "nim.medium_file"
    bl_label = "Medium from a File"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    material: bpy.props.StringProperty(name="Material", description="Name of the material", options={"HIDDEN"})
    side: bpy.props.EnumProperty(
        name="Side",
        description="Which side of the faces",
        items=(
            ("inside", "Inside", "The medium behind the faces", "NONE", 0),
            ("outside", "Outside", "The medium on the side the normals point to", "NONE", 1),
        ),
        options={"HIDDEN"},
    )
    filepath: bpy.props.StringProperty(
        name="File", description="A .yml file of refractiveindex.info", subtype="FILE_PATH", options={"SKIP_SAVE"}
    )
    filter_glob: bpy.props.StringProperty(
        name="Filter",
        description="Which files are shown",
        default=";".join(f"*{suffix}" for suffix in SUFFIXES),
        options={"HIDDEN", "SKIP_SAVE"},
    )

    def invoke(self, context, event):
        """Open the file browser."""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        """Take the file, or say what is wrong with it."""
        material = bpy.data.materials.get((self.material, None))
        if active_node(material) is None or not material.is_editable:
            text = pgettext_rpt("{name} is no NIM Interface material that can be changed here")
            return fail(self, text.format(name=repr(self.material)))
        path = bpy.path.abspath(self.filepath)
        try:
            medium = Medium.dispersive(load(path, Path(path).name))
            choose_medium(material, self.side, medium)
        except ValueError as error:
            return fail(self, str(error))
        text = pgettext_rpt("{material}: {medium}, n = {n} at 550 nm")
        self.report({"INFO"}, text.format(material=material.name, medium=medium, n=number(medium.n)))
        return {"FINISHED"}


class NIM_PT_material(Helped, bpy.types.Panel):
    """The media on both sides of the active material's surface, and what they mean"""

    bl_idname = "NIM_PT_material"
    bl_label = "Negative Index"
    page = "material#the-panel"
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


class NIM_PT_material_nodes(Sidebar, bpy.types.Panel):
    """The media on both sides of the edited material's surface, and what they mean"""

    bl_idname = "NIM_PT_material_nodes"
    bl_label = "Negative Index"
    page = "material#the-panel"
    bl_space_type = "NODE_EDITOR"

    @classmethod
    def poll(cls, context):
        """For the shader trees of materials."""
        space = context.space_data
        return space.tree_type == "ShaderNodeTree" and isinstance(space.id, bpy.types.Material)

    def draw(self, context):
        """Draw it."""
        draw_material(self.layout, context, context.space_data.id)


CLASSES = (NIM_OT_switch_backend, NIM_OT_medium_file, NIM_PT_material, NIM_PT_material_nodes)


def register():
    """Make room for the curves' icons."""
    curve.register()


def unregister():
    """Free them."""
    curve.unregister()
