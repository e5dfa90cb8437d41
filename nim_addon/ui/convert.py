# SPDX-License-Identifier: GPL-3.0-or-later
"""Any object with a surface made a NIM in one click, and taken back."""

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface, pgettext_rpt

from .. import checks
from ..cycles import meshes
from ..cycles.material import asked_interfaces, glass_index, interface_material, interface_nodes, interface_of
from ..cycles.surface import remove_material
from ..cycles.visibility import CAUSTICS_MARK, SURFACES, declared, materials_of
from ..physics import Interface, Medium
from . import curves, former, preferences, warnings
from .help import fail
from .material import draw_make, draw_media, draw_readings, draw_summary
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
    plain,
)
from .panels import Sidebar, draw_sentence

# The slots of an object hide those of its mesh: a NIM is put into the first, so the mesh and others that share it stay.


class NIM_PG_object(bpy.types.PropertyGroup):
    """What "Restore Former Materials" needs to know of a converted object."""

    former: bpy.props.CollectionProperty(
        type=former.NIM_PG_former_slot, name="Former slots", description="The slots before the object became a NIM"
    )
    slot_added: bpy.props.BoolProperty(
        name="Slot added", description="The mesh had no material slot: the one it has was made for the NIM"
    )
    shape: bpy.props.StringProperty(name="Shape", description="What a curve or text had before it was given a body")


def converted(object_: bpy.types.Object | None) -> bool:
    """Whether "Restore Former Materials" can undo something in an object (or None)."""
    return object_ is not None and object_.type in SURFACES and len(object_.nim.former) > 0


def obstacle(object_: bpy.types.Object) -> str | None:
    """Why an object cannot be changed, as a template of {name}; or None where it can."""
    if object_.library:
        return "{name} is linked from a library: make it local first"
    if object_.override_library:
        return "{name} is an override of a library: make it local first"
    if object_.data.library and not object_.data.materials:
        return "The mesh of {name} is linked from a library and has no material slot: make it local first"
    return None


def convert(object_: bpy.types.Object, materials: dict[int, bpy.types.Material], *, close: bool = False) -> None:
    """Wear these materials in slots of an object; what was there before is kept for take_back().

    materials: by the slot's place; {0: ...} of an object without slots, which gets one
    close:     whether a curve or text is given a body
    """
    fresh = not converted(object_)
    if fresh and not object_.material_slots:
        object_.data.materials.append(None)
        object_.nim.slot_added = True
    elif fresh:
        # its mesh's only slot may have been made for another object that shares the mesh
        object_.nim.slot_added = any(other.nim.slot_added for other in _sharing(object_))
    else:
        former.align(object_)
    for place, slot in enumerate(object_.material_slots):
        if place >= len(object_.nim.former):
            object_.nim.former.add().kept = True
        if place not in materials:
            continue
        was, earlier = object_.nim.former[place], slot.material
        if was.kept:
            was.kept, was.link = False, slot.link
            slot.link = "OBJECT"
            was.material = slot.material
        slot.link = "OBJECT"
        slot.material = materials[place]
        if earlier and not earlier.users and interface_nodes(earlier):  # one that was made here before
            remove_material(earlier)
    former.note(object_)
    if close and not object_.nim.shape:
        object_.nim.shape = curves.close(object_)


def take_back(object_: bpy.types.Object) -> None:
    """Give a converted object its former slots; a NIM that nothing else wears any more leaves the file, with all it used."""
    worn = {slot.material for slot in object_.material_slots if interface_nodes(slot.material)}
    former.align(object_)
    for slot, was in zip(object_.material_slots, object_.nim.former, strict=False):
        if not was.kept:
            slot.link = "OBJECT"
            slot.material = was.material
            slot.link = was.link
            owned = object_.data.materials[slot.slot_index]
            if owned in worn and owned.name == was.worn:  # Join and others move into the mesh what its objects wear
                object_.data.materials[slot.slot_index] = was.mesh_material
    # the mesh's own slot goes with the last of the objects it was made for
    lone = len(object_.data.materials) == 1 and object_.data.materials[0] is None
    if object_.nim.slot_added and lone and not any(other.nim.slot_added for other in _sharing(object_)):
        object_.data.materials.clear()
    curves.reopen(object_, object_.nim.shape)
    object_.property_unset("nim")
    for material in worn:
        if material.users == 0:
            remove_material(material)


def nims_of(object_: bpy.types.Object, places: list[int]) -> list[tuple[bpy.types.Material, Interface | None]]:
    """What makes an evaluated object negative-index, in those of these slots that its faces use, as a render shows it.

    Of a curve, a text and the like all slots count. Returns a list of pairs (material, physics.Interface); the latter None
    where nodes decide it.
    """
    worn = materials_of(object_)
    used = np.unique(meshes.slots(object_.data, len(worn))) if object_.type == "MESH" else range(len(worn))
    found = []
    for slot in set(used) & set(places):
        for node, path in asked_interfaces(worn[slot]):
            interface = interface_of(node, path)
            if interface is None or interface.inside.is_nim or interface.outside.is_nim:
                found.append((worn[slot], interface))
    return found


def _sharing(object_):
    return [other for other in bpy.data.objects if other.data == object_.data and other != object_]


def _selected(context):
    """The selected objects with a surface; the active one where none is selected. Metaballs are the first of their family."""
    objects = [object_ for object_ in context.selected_objects if object_.type in SURFACES]
    active = context.object
    objects = objects or ([active] if active and active.type in SURFACES else [])
    return list(dict.fromkeys(_family_head(object_) for object_ in objects))


def _family_head(object_):
    """Of metaballs that melt into one another, those of one name but for its number, the one whose material all have."""
    head = bpy.data.objects.get(object_.name.partition(".")[0]) if object_.type == "META" else None
    return head if head and head.type == "META" else object_


def _poll(cls, context):
    if context.mode != "OBJECT":
        cls.poll_message_set("Leave the mode you are in for Object Mode first")
        return False
    if not _selected(context):
        cls.poll_message_set("Select an object with a surface first")
        return False
    return True


class NIM_OT_convert(bpy.types.Operator):
    """Make the selected objects negative-index; Restore Former Materials gives the old ones back; |n| of a glass is kept"""

    bl_idname = "nim.convert"
    bl_label = "Make Negative-Index"
    bl_options = {"REGISTER", "UNDO"}

    keep: bpy.props.BoolProperty(
        name="Keep |n|",
        description="What was glass has the index that it had, of this sign, unless another medium is chosen inside",
        default=True,
    )
    sign: bpy.props.EnumProperty(
        name="Sign",
        description="Of the index that is kept",
        items=(
            ("NEGATIVE", "Negative", "It bends light backwards", "REMOVE", 0),
            ("POSITIVE", "Positive", "It bends light as before, by this add-on's material", "ADD", 1),
        ),
    )
    slots: bpy.props.EnumProperty(
        name="Slots",
        description="Which materials of an object are replaced",
        items=(
            ("ALL", "All", "Those in all slots of the object", "NONE", 0),
            ("ACTIVE", "Active", "The one in the slot that is chosen in its list of materials", "NONE", 1),
        ),
        options={"SKIP_SAVE"},
    )
    close: bpy.props.BoolProperty(
        name="Close Curves",
        description="Give flat texts and curves a thickness, and tubes ends: a medium needs an inside",
        default=True,
    )
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
        """Only where something with a surface is selected, in Object Mode."""
        return _poll(cls, context)

    def execute(self, context):
        """Convert those that can be, and name those that cannot and those that are negative-index already."""
        refused, free = _told_apart(_selected(context))
        depsgraph = context.evaluated_depsgraph_get()
        places = {object_: self._places(object_) for object_ in free}
        already = {
            object_: [] if self.replace else nims_of(object_.evaluated_get(depsgraph), places[object_])
            for object_ in free
        }
        free = [object_ for object_ in free if not already[object_]]
        kept = [_refusals(refused)] if refused else []
        kept += [_already(object_, nims) for object_, nims in already.items() if nims]
        if not free:
            self.report({"ERROR"} if refused else {"WARNING"}, ". ".join(kept))
            return {"CANCELLED"}
        try:
            inside = chosen_medium(self.inside, self.n_inside, self.mu_inside)
            media = {object_: self._media(object_, places[object_], inside) for object_ in free}
            made = self._materials(context, free[0].name, media)
        except (ValueError, RuntimeError) as error:
            return fail(self, str(error))
        for object_ in free:
            convert(object_, {place: made[n] for place, n in media[object_].items()}, close=self.close)
        indices = ", ".join(number(medium.n) for medium in made)
        negative = set(made) == {inside} and inside.is_nim
        text = pgettext_rpt("{count} made negative-index" if negative else "{count} made of index {n}")
        said = text.format(count=len(free), n=indices)
        if kept:
            self.report({"WARNING"}, ". ".join([said, *kept]))
        elif wrong := len(checks.problems(context.scene, warnings.LARGEST)):
            text = pgettext_rpt("{said}. To be mended before it renders right: {wrong}, see Checks")
            self.report({"INFO"}, text.format(said=said, wrong=wrong))
        else:
            self.report({"INFO"}, said)
        return {"FINISHED"}

    def _places(self, object_):
        """The slots to be replaced; 0 of an object that has none yet."""
        if self.slots == "ACTIVE" and object_.material_slots:
            return [object_.active_material_index]
        return list(range(max(1, len(object_.material_slots))))

    def _media(self, object_, places, inside):
        """{slot: Medium} behind the faces: what was glass keeps its index, unless a person has chosen a medium."""
        media = dict.fromkeys(places, inside)
        if self.keep and not self.properties.is_property_set("inside"):
            for place, slot in enumerate(object_.material_slots):
                if place in media and (n := glass_index(slot.material)) and not interface_nodes(slot.material):
                    signed = -n if self.sign == "NEGATIVE" else n
                    media[place] = Medium(plain(signed))
        return media

    def _materials(self, context, name, media):
        """{Medium: a new material}, one for each that is wanted."""
        outside = chosen_medium(self.outside, self.n_outside, self.mu_outside)
        wanted = dict.fromkeys(medium for of_slots in media.values() for medium in of_slots.values())
        backend = backend_for(context.scene)
        # a name of no number: n changes later, and Blender takes what follows a dot for its own
        return {medium: interface_material(f"{name} Interface", medium, outside, backend=backend) for medium in wanted}

    def draw(self, context):
        """Draw the redo panel: numbers only where the medium is of own values."""
        column = self.layout.column()
        column.use_property_split = True
        column.row().prop(self, "sign", expand=True)
        column.prop(self, "keep")
        column.row().prop(self, "slots", expand=True)
        column.prop(self, "close")
        for side in SIDES:
            draw_choice(self.layout, self, side, f"n_{side}", f"mu_{side}")
        self.layout.prop(self, "replace")


class NIM_OT_revert(bpy.types.Operator):
    """Give the selected objects the materials back that they had before they became negative-index"""

    bl_idname = "nim.revert"
    bl_label = "Restore Former Materials"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Only where a converted object is selected, in Object Mode."""
        if not _poll(cls, context):
            return False
        if not any(converted(object_) for object_ in _selected(context)):
            cls.poll_message_set("None of the selected objects was made negative-index by Make Negative-Index")
            return False
        return True

    def execute(self, context):
        """Take back those that can be, and name those that cannot."""
        refused, free = _told_apart([object_ for object_ in _selected(context) if converted(object_)])
        if not free:
            return fail(self, _refusals(refused))
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
        text = pgettext_rpt("{name} has a NIM Interface material already, {material}: it stays as it is")
        return text.format(name=object_.name, material=material.name)
    n = interface.inside.n if interface.inside.is_nim else interface.outside.n
    text = pgettext_rpt("{name} is negative-index already, n = {n}: it stays as it is; change n in the panel")
    return text.format(name=object_.name, n=number(n))


def _shown_of(object_):
    """The material whose media are shown of an object (or None): its active slot's, else what its modifiers or instances wear."""
    if object_ is None or (object_.type in SURFACES and active_node(object_.active_material)):
        return object_ and object_.active_material
    own = {slot.material for slot in object_.material_slots}
    others = (material for material in declared([object_])[object_] if material not in own)
    return next((material for material in others if active_node(material)), None)


def _meant(context):
    """The object that a person means: the active one if it is selected, else the first with a surface that is; or None.

    Where nothing is selected the active object is only the last one, which may even be hidden: it is meant if what it wears
    is negative-index, for its numbers.
    """
    active = context.object
    if context.mode != "OBJECT" or active is None or active in context.selected_objects:
        return active
    chosen = [object_ for object_ in context.selected_objects if object_.type in SURFACES]
    return chosen[0] if chosen else active if _shown_of(active) else None


def draw_buttons(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw what can be done with what is selected: add a body where that is nothing, make what is none yet, take back."""
    object_ = _meant(context)
    chosen = _selected(context) if object_ else []
    column = layout.column(align=True)
    if not chosen:
        if context.mode == "OBJECT" and _shown_of(object_) is None:
            column.menu("NIM_MT_add_mesh", text="Add a Body", icon="ADD")
        return
    if any(_shown_of(object_) is None for object_ in chosen):
        draw_make(column, chosen)
    if any(converted(object_) for object_ in chosen):
        column.operator("nim.revert", icon="LOOP_BACK")


class NIM_PT_convert(Sidebar, bpy.types.Panel):
    """The active object's negative-index material in short"""

    bl_idname = "NIM_PT_convert"
    bl_label = "Material"
    page = "material#making-and-taking-back"
    bl_order = 0

    def draw(self, context):
        """Draw its media and what they do, and what can be done with it."""
        layout = self.layout
        object_ = _meant(context)
        if object_ and object_.get(CAUSTICS_MARK):
            text = pgettext_iface(
                "{name} shines for a surface that is hidden meanwhile: change that, not this. Clear Caustics shows it again."
            )
            draw_sentence(layout, context, text.format(name=object_.name), icon="INFO")
            layout.operator("nim.clear_caustics", icon="TRASH")
            return
        material = _shown_of(object_)
        if object_ and object_.type in SURFACES and len(object_.material_slots) > 1:
            layout.template_list(
                "MATERIAL_UL_matslots", "", object_, "material_slots", object_, "active_material_index", rows=2
            )
        if object_ is None or (object_.type not in SURFACES and material is None):
            if object_ is None:
                layout.label(text="Select an object with a surface", icon="INFO")
            else:  # others that have one may be selected
                text = pgettext_iface("{name}, the active object, has no surface.").format(name=object_.name)
                draw_sentence(layout, context, text, icon="INFO")
        elif material is None:
            # of several slots the one that is chosen
            named = object_.active_material if len(object_.material_slots) > 1 else None
            text = pgettext_iface("{name} is not negative-index yet.").format(name=(named or object_).name)
            draw_sentence(layout, context, text, icon="INFO")
        else:
            layout.label(text=f"{object_.name}: {material.name}", icon="MATERIAL", translate=False)
            draw_media(layout, context, material)
            draw_summary(layout, context, material)
            header, body = layout.panel("NIM_curve", default_closed=True)
            header.label(text="Reflectance")
            if body:
                draw_readings(body, context, material)
        draw_buttons(layout, context)
        if material is None:  # where a person looks for one; where there is one it would stand among its buttons
            preferences.draw_offer(layout)


CLASSES = (former.NIM_PG_former_slot, NIM_PG_object, NIM_OT_convert, NIM_OT_revert, NIM_PT_convert)


def register():
    """Give each object its NIM_PG_object."""
    bpy.types.Object.nim = bpy.props.PointerProperty(
        type=NIM_PG_object, name="Negative Index", description="What Restore Former Materials needs to know"
    )


def unregister():
    """Take it back."""
    del bpy.types.Object.nim
