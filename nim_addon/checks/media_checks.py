# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the media of two interfaces do not fit: the most common is an outside that was forgotten; and the mending."""

import bpy

from ..cycles.material import asked_interfaces, medium_of, set_medium
from ..cycles.problem import LINKED, Problem
from .bodies import BACK, FRONT
from .borders import Borders, Misfit

# By Misfit.relation: what is said of one object, and of several; {medium} is what `other` says, {own} what they say.
SENTENCES = {
    "lies": (
        "{name} lies in {medium} ({other}), but its outside is {own}.",
        "{name} and {more} more lie in {medium} ({other}), but their outside is {own}.",
    ),
    "partly": (
        "{name} lies partly in {medium} ({other}), but its outside is {own}: it takes a material for each part.",
        "{name} and {more} more lie partly in {medium} ({other}), but their outside is {own}: each part takes a material.",
    ),
    "overlaps": (
        "{name} and {other} overlap: where they do, there are two media in one place.",
        "{name}, {more} more and {other} overlap: where they do, there are two media in one place.",
    ),
    "faces": (
        "{name} and {other} face each other, but the outside of the first is {own}, of the second {medium}.",
        "{name} and {more} more face {other}, but their outside is {own}, and its outside {medium}.",
    ),
    "joins": (
        "{name} and {other} have their inside in common, but that of the first is {own}, of the second {medium}.",
        "{name}, {more} more and {other} have their inside in common, but theirs is {own}, and its {medium}.",
    ),
}
REMEDIES = {FRONT: "Set the outside", BACK: "Set the inside"}
SOCKETS = {FRONT: "Outside", BACK: "Inside"}


def find(borders: Borders) -> list[Problem]:
    """The Problems of media that do not fit to what is around them."""
    groups = {}
    for misfit in borders.misfits:
        material = _material(borders, misfit.patch)
        label = _names(borders, misfit)[1]
        groups.setdefault(
            (material, misfit.relation, misfit.sure, label, _said(misfit.own), _said(misfit.medium)), []
        ).append(misfit)
    return [_problem(borders, key, misfits) for key, misfits in groups.items()]


def _problem(borders, key, misfits):
    material, relation, sure, other, own, medium = key
    side = BACK if relation == "joins" else FRONT
    names = list(dict.fromkeys(_names(borders, misfit)[0] for misfit in misfits))
    objects = tuple(dict.fromkeys(_object(borders, misfit.patch).name for misfit in misfits))
    values = {"name": names[0], "more": len(names) - 1, "other": other, "own": own, "medium": medium}
    texts = (SENTENCES[relation][len(names) > 1],)
    if relation == "overlaps" and misfits[0].patch.body == misfits[0].partner.body:
        values["name"] = objects[0]
        texts = ("Parts of {name} overlap: where they do, there are two media in one place.",)
    if material.library:
        texts += (LINKED,)
    how = _how(borders, material, misfits, side) if sure else None
    values |= {"wanted": misfits[0].medium, "side": side, "copies": how == "copy"}
    partner = _material(borders, misfits[0].partner)
    materials = tuple(sorted({material.name, partner.name}))
    values["material"] = material.name
    return Problem("outside", texts, values, REMEDIES[side] if how else None, objects, materials)


def _how(borders, material, misfits, side):
    """How the value can be set: in the "material", in a "copy" of it for the objects concerned, or None."""
    node = _settable(material, side)
    if node is None:
        return None
    wearing = [patch for patch in borders.patches if _material(borders, patch) is material]
    wrong = {misfit.patch for misfit in misfits}
    if set(wearing) <= wrong:
        return "material"
    objects = {_object(borders, patch) for patch in wrong}
    if any(patch not in wrong for patch in wearing if _object(borders, patch) in objects):
        return None  # one object needs it both ways
    kept = any(obj.library or obj.override_library for obj in objects)
    worn = all(material in [slot.material for slot in obj.material_slots] for obj in objects)
    return "copy" if worn and not kept else None


def _settable(material, side):
    """The interface node of a material if its values on that side are its own; or None."""
    # one within a group is other materials' too, and what is animated comes back
    nodes = asked_interfaces(material)
    if material.library or len(nodes) != 1 or nodes[0].path or material.node_tree.animation_data:
        return None
    node, name = nodes[0].node, SOCKETS[side]
    free = not any(node.inputs[f"{quantity} {name}"].is_linked for quantity in ("Index", "Permeability"))
    return node if free or medium_of(node, name) else None


def _set_medium(scene, problem):
    values = problem.values
    material = bpy.data.materials[values["material"], None]
    if values["copies"]:
        former, material = material, material.copy()
        for name in problem.objects:
            for slot in bpy.data.objects[name, None].material_slots:
                if slot.material == former:
                    slot.link = "OBJECT"
                    slot.material = material
    node = _settable(material, values["side"])
    if node:
        set_medium(node, SOCKETS[values["side"]], values["wanted"])


def _material(borders, patch):
    return borders.around.bodies[patch.body].shown.materials[patch.slot]


def _object(borders, patch):
    return borders.around.bodies[patch.body].object


def _names(borders, misfit: Misfit):
    """What the two of a Misfit are called: by their objects, or within one object by their materials."""
    pair = (misfit.patch, misfit.partner)
    objects = [_object(borders, patch) for patch in pair]
    if objects[0] == objects[1]:
        return [_material(borders, patch).name for patch in pair]
    return [obj.name for obj in objects]


def _said(medium):
    """A medium in a few words, the same in every language."""
    if medium.dispersion:
        return str(medium)
    n, mu = (f"{number.real if number.imag == 0 else number:.6g}" for number in (medium.index, medium.permeability))
    usual = medium.permeability == (-1 if medium.is_nim else 1)
    return f"{'NIM' if medium.is_nim else 'n ='} {n}" + ("" if usual else f", mu = {mu}")


MENDS = {"outside": _set_medium}
