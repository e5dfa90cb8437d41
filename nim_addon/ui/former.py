# SPDX-License-Identifier: GPL-3.0-or-later
"""What an object wore before it was made a NIM, slot by slot, wherever its slots have gone since."""

import bpy

from ..cycles.material import interface_nodes


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
    kept: bpy.props.BoolProperty(name="Kept", description="This slot was left as it is")
    mesh_material: bpy.props.PointerProperty(
        type=bpy.types.Material, name="Mesh Material", description="The mesh's material in this slot, which it keeps"
    )
    # a name: a pointer would count as one more that uses it
    worn: bpy.props.StringProperty(name="Worn", description="The name of the material that was put into this slot")


FIELDS = ("material", "link", "kept", "mesh_material", "worn")


def note(object_: bpy.types.Object) -> None:
    """Note by what the slots are known again, in each of object_.nim.former; these are of the same order."""
    for slot, owned, former in zip(object_.material_slots, object_.data.materials, object_.nim.former, strict=False):
        former.mesh_material, former.worn = owned, slot.material.name if slot.material else ""


def align(object_: bpy.types.Object) -> None:
    """Put object_.nim.former into the order of the slots as they are now: some may have been removed, moved or added.

    What was of a slot that is gone goes; what is of a new one is `kept`. A slot is known by the mesh's material in it, which
    no conversion changes and which moves along, then by what it wears, then by its place.
    """
    slots, former = object_.material_slots, object_.nim.former
    remembered = [{field: getattr(entry, field) for field in FIELDS} for entry in former]
    names = {slot.material.name for slot in slots if slot.material}
    noted = {entry["worn"] for entry in remembered}
    pairs = []
    for place, slot in enumerate(slots):
        owned, worn = object_.data.materials[place], slot.material.name if slot.material else ""
        for was, entry in enumerate(remembered):
            same, known = owned == entry["mesh_material"], worn == entry["worn"] != ""
            likeness = known + same * (2 if owned else known)
            # files of earlier versions have noted nothing
            stayed = place == was and (len(slots) == len(remembered) or not (entry["mesh_material"] or entry["worn"]))
            renamed = interface_nodes(slot.material) and worn not in noted and entry["worn"] not in names
            if likeness or stayed or (renamed and not entry["kept"]):
                pairs.append((-likeness, abs(place - was), was, place))
    taken = {}
    for _, _, was, place in sorted(pairs):
        if place not in taken and was not in taken.values():
            taken[place] = was
    if all(taken.get(place) == place for place in range(max(len(slots), len(remembered)))):
        return
    former.clear()
    for place in range(len(slots)):
        entry = former.add()
        for field, value in remembered[taken[place]].items() if place in taken else (("kept", True),):
            setattr(entry, field, value)
