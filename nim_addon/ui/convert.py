# SPDX-License-Identifier: GPL-3.0-or-later
"""Any mesh made a NIM in one click, and taken back."""

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface, pgettext_rpt

from .. import checks
from ..cycles import meshes
from ..cycles.material import asked_interfaces, interface_material, interface_nodes, interface_of
from ..cycles.visibility import materials_of
from ..physics import Interface
from . import warnings
from .material import draw_media, draw_summary
from .material_values import active_node
from .media import (
    SIDES,
    backend_for,
    chosen_medium,
    draw_choice,
    index_property,
    medium_property,
    number,
    permeability_property,
)
from .panels import Sidebar, draw_sentence

# The slots of an object hide those of its mesh: a NIM is put into the first, so the mesh and others that share it stay.


class NIM_PG_former_slot(bpy.types.PropertyGroup):
    """A material slot of an object as it was: the object's own material, and whether that or the mesh's counted."""

    material: bpy.props.PointerProperty(
        type=bpy.types.Material, name="Material", description="The object's own material in this slot"
    )
    link: bpy.props.EnumProperty(
        name="Link",
        description="Whose material counted",
        items=(
            ("DATA", "Mesh", "The mesh's material counted", "NONE", 0),
            ("OBJECT", "Object", "The object's own material counted", "NONE", 1),
        ),
    )


class NIM_PG_object(bpy.types.PropertyGroup):
    """What "Take Back" needs to know of a converted object."""

    former: bpy.props.CollectionProperty(
        type=NIM_PG_former_slot, name="Former slots", description="The slots before the object became a NIM"
    )
    slot_added: bpy.props.BoolProperty(
        name="Slot added", description="The mesh had no material slot: the one it has was made for the NIM"
    )


def converted(object_: bpy.types.Object | None) -> bool:
    """Whether "Take Back" can undo something in an object (or None)."""
    return object_ is not None and object_.type == "MESH" and len(object_.nim.former) > 0


def obstacle(object_: bpy.types.Object) -> str | None:
    """Why an object cannot be changed, as a template of {name}; or None where it can."""
    if object_.library:
        return "{name} is linked from a library: make it local first"
    if object_.override_library:
        return "{name} is an override of a library: make it local first"
    if object_.data.library and not object_.data.materials:
        return "The mesh of {name} is linked from a library and has no material slot: make it local first"
    return None


def convert(object_: bpy.types.Object, material: bpy.types.Material) -> None:
    """Wear `material` in every slot of a mesh object; what was there before is kept for take_back()."""
    fresh = not converted(object_)
    if fresh and not object_.material_slots:
        object_.data.materials.append(None)
        object_.nim.slot_added = True
    elif fresh:
        # its mesh's only slot may have been made for another object that shares the mesh
        object_.nim.slot_added = any(other.nim.slot_added for other in _sharing(object_))
    for place, slot in enumerate(object_.material_slots):
        if place >= len(object_.nim.former):
            former = object_.nim.former.add()
            former.link = slot.link
            slot.link = "OBJECT"
            former.material = slot.material
        slot.link = "OBJECT"
        slot.material = material


def take_back(object_: bpy.types.Object) -> None:
    """Give a converted object its former slots; a NIM that nothing else wears any more leaves the file."""
    worn = {slot.material for slot in object_.material_slots if interface_nodes(slot.material)}
    for slot, former in zip(object_.material_slots, object_.nim.former, strict=False):
        slot.link = "OBJECT"
        slot.material = former.material
        slot.link = former.link
    # the mesh's own slot goes with the last of the objects it was made for
    lone = len(object_.data.materials) == 1 and object_.data.materials[0] is None
    if object_.nim.slot_added and lone and not any(other.nim.slot_added for other in _sharing(object_)):
        object_.data.materials.clear()
    object_.nim.former.clear()
    object_.nim.slot_added = False
    for material in worn:
        if material.users == 0:
            bpy.data.materials.remove(material)


def nims_of(object_: bpy.types.Object) -> list[tuple[bpy.types.Material, Interface | None]]:
    """What makes an evaluated mesh object negative-index, in any of the slots that its faces use, as a render shows it.

    Returns a list of pairs (material, physics.Interface); the latter None where nodes decide it.
    """
    worn = materials_of(object_)
    found = []
    for slot in np.unique(meshes.slots(object_.data, len(worn))):
        for asked in asked_interfaces(worn[slot]):
            interface = interface_of(asked.node, asked.path)
            if interface is None or interface.inside.is_nim or interface.outside.is_nim:
                found.append((worn[slot], interface))
    return found


def _sharing(object_):
    return [other for other in bpy.data.objects if other.data == object_.data and other != object_]


def _meshes(context):
    """The selected mesh objects; the active one where none is selected."""
    objects = [object_ for object_ in context.selected_objects if object_.type == "MESH"]
    active = context.object
    return objects or ([active] if active and active.type == "MESH" else [])


def _poll(cls, context):
    if context.mode != "OBJECT":
        cls.poll_message_set("Leave the mode you are in for Object Mode first")
        return False
    if not _meshes(context):
        cls.poll_message_set("Select a mesh object first")
        return False
    return True


class NIM_OT_convert(bpy.types.Operator):
    """Make the selected meshes a negative-index material, one for all of them; their materials are kept for Take Back"""

    bl_idname = "nim.convert"
    bl_label = "Make Negative-Index"
    bl_options = {"REGISTER", "UNDO"}

    inside: medium_property("nim-1.5", "Inside", "The medium behind the faces")
    n_inside: index_property(-1.5)
    mu_inside: permeability_property()
    outside: medium_property("air", "Outside", "The medium on the side the normals point to")
    n_outside: index_property(1.0)
    mu_outside: permeability_property()
    replace: bpy.props.BoolProperty(
        name="Replace",
        description="Make those anew too that are negative-index already",
        default=False,
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context):
        """Only where a mesh is selected, in Object Mode."""
        return _poll(cls, context)

    def execute(self, context):
        """Convert those that can be, and name those that cannot and those that are negative-index already."""
        refused, free = _told_apart(_meshes(context))
        depsgraph = context.evaluated_depsgraph_get()
        already = {} if self.replace else {object_: nims_of(object_.evaluated_get(depsgraph)) for object_ in free}
        free = [object_ for object_ in free if not already.get(object_)]
        kept = [_refusals(refused)] if refused else []
        kept += [_already(object_, nims) for object_, nims in already.items() if nims]
        if not free:
            self.report({"ERROR"} if refused else {"WARNING"}, ". ".join(kept))
            return {"CANCELLED"}
        try:
            inside = chosen_medium(self.inside, self.n_inside, self.mu_inside)
            outside = chosen_medium(self.outside, self.n_outside, self.mu_outside)
            backend = backend_for(context.scene)
            # a name of no number: n changes later, and Blender takes what follows a dot for its own
            material = interface_material(f"{free[0].name} Interface", inside, outside, backend=backend)
        except (ValueError, RuntimeError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for object_ in free:
            convert(object_, material)
        text = pgettext_rpt("{count} made negative-index" if inside.is_nim else "{count} made of index {n}")
        said = text.format(count=len(free), n=number(inside.n))
        if kept:
            self.report({"WARNING"}, ". ".join([said, *kept]))
        elif wrong := len(checks.problems(context.scene, warnings.LARGEST)):
            text = pgettext_rpt("{said}. To be mended before it renders right: {wrong}, see Checks")
            self.report({"INFO"}, text.format(said=said, wrong=wrong))
        else:
            self.report({"INFO"}, said)
        return {"FINISHED"}

    def draw(self, context):
        """Draw the redo panel: numbers only where the medium is of own values."""
        for side in SIDES:
            draw_choice(self.layout, self, side, f"n_{side}", f"mu_{side}")
        self.layout.prop(self, "replace")


class NIM_OT_revert(bpy.types.Operator):
    """Give the selected meshes the materials back that they had before they became negative-index"""

    bl_idname = "nim.revert"
    bl_label = "Take Back"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Only where a converted mesh is selected, in Object Mode."""
        if not _poll(cls, context):
            return False
        if not any(converted(object_) for object_ in _meshes(context)):
            cls.poll_message_set("None of the selected meshes was made negative-index by Make Negative-Index")
            return False
        return True

    def execute(self, context):
        """Take back those that can be, and name those that cannot."""
        refused, free = _told_apart([object_ for object_ in _meshes(context) if converted(object_)])
        if not free:
            self.report({"ERROR"}, _refusals(refused))
            return {"CANCELLED"}
        for object_ in free:
            take_back(object_)
        said = pgettext_rpt("{count} given their former materials").format(count=len(free))
        self.report({"WARNING"} if refused else {"INFO"}, f"{said}. {_refusals(refused)}" if refused else said)
        return {"FINISHED"}


def _told_apart(objects):
    """Those of the objects that cannot be changed, and those that can."""
    return [object_ for object_ in objects if obstacle(object_)], [
        object_ for object_ in objects if not obstacle(object_)
    ]


def _refusals(objects):
    return ". ".join(pgettext_rpt(obstacle(object_)).format(name=object_.name) for object_ in objects)


def _already(object_, nims):
    """That an object is what it should become."""
    material, interface = nims[0]
    if interface is None:
        text = pgettext_rpt("{name} has an interface already, {material}: it stays as it is")
        return text.format(name=object_.name, material=material.name)
    n = interface.inside.n if interface.inside.is_nim else interface.outside.n
    text = pgettext_rpt("{name} is negative-index already, n = {n}: it stays as it is; change n in the panel")
    return text.format(name=object_.name, n=number(n))


class NIM_PT_convert(Sidebar, bpy.types.Panel):
    """The active object's interface in short"""

    bl_idname = "NIM_PT_convert"
    bl_label = "Material"
    bl_order = 0

    def draw(self, context):
        """Draw its media and what they do, and the two buttons."""
        layout = self.layout
        object_ = context.object
        material = object_.active_material if object_ and object_.type == "MESH" else None
        if object_ and object_.type == "MESH" and len(object_.material_slots) > 1:
            layout.template_list(
                "MATERIAL_UL_matslots", "", object_, "material_slots", object_, "active_material_index", rows=2
            )
        if object_ is None or object_.type != "MESH":
            layout.label(text="Select a mesh object", icon="INFO")
        elif material is None or active_node(material) is None:
            text = pgettext_iface("{name} has no negative-index interface.").format(name=object_.name)
            draw_sentence(layout, context, text, icon="INFO")
        else:
            layout.label(text=f"{object_.name}: {material.name}", icon="MATERIAL", translate=False)
            draw_media(layout, context, material)
            draw_summary(layout, context, material)
        column = layout.column(align=True)
        column.operator("nim.convert", icon="MATERIAL")
        column.operator("nim.revert", icon="LOOP_BACK")


CLASSES = (NIM_PG_former_slot, NIM_PG_object, NIM_OT_convert, NIM_OT_revert, NIM_PT_convert)


def register():
    """Give each object its NIM_PG_object."""
    bpy.types.Object.nim = bpy.props.PointerProperty(
        type=NIM_PG_object, name="Negative Index", description="What Take Back needs to know"
    )


def unregister():
    """Take it back."""
    del bpy.types.Object.nim
