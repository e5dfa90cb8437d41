# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the media of two interfaces do not fit: the most common is an outside that was forgotten; and the mending."""

import bpy

from ..cycles.material import asked_interfaces
from ..cycles.problem import LINKED, Problem
from .bodies import BACK, FRONT
from .borders import Borders, Misfit
from .surroundings import same

# By Misfit.kind: what is said of one thing, and of several; {medium} is what `other` says, {own} what the thing says.
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
    for one in borders.misfits:
        material = _material(borders, one.patch)
        label = _names(borders, one)[1]
        groups.setdefault((material, one.kind, one.sure, label, _said(one.own), _said(one.medium)), []).append(one)
    return [_problem(borders, *those) for those in groups.items()]


def _problem(borders, key, misfits):
    material, kind, sure, other, own, medium = key
    side = BACK if kind == "joins" else FRONT
    names = list(dict.fromkeys(_names(borders, one)[0] for one in misfits))
    things = tuple(dict.fromkeys(_thing(borders, one.patch).name for one in misfits))
    values = {"name": names[0], "more": len(names) - 1, "other": other, "own": own, "medium": medium}
    texts = (SENTENCES[kind][len(names) > 1],)
    if kind == "overlaps" and misfits[0].patch.body == misfits[0].partner.body:
        values["name"] = things[0]
        texts = ("Parts of {name} overlap: where they do, there are two media in one place.",)
    if material.library:
        texts += (LINKED,)
    how = _how(borders, material, misfits, side) if sure else None
    values |= {"n": misfits[0].medium.n, "mu": misfits[0].medium.mu, "side": side, "copies": how == "copy"}
    partner = _material(borders, misfits[0].partner)
    materials = tuple(sorted({material.name, partner.name}))
    values["material"] = material.name
    return Problem("outside", texts, values, REMEDIES[side] if how else None, things, materials)


def _how(borders, material, misfits, side):
    """How the value can be set: in the "material", in a "copy" of it for the objects concerned, or None."""
    node = _settable(material, side)
    if node is None:
        return None
    wearing = [patch for patch in borders.patches if _material(borders, patch) is material]
    wrong = {one.patch for one in misfits}
    if set(wearing) <= wrong:
        return "material"
    things = {_thing(borders, patch) for patch in wrong}
    if any(patch not in wrong for patch in wearing if _thing(borders, patch) in things):
        return None  # one object needs it both ways
    kept = any(thing.library or thing.override_library for thing in things)
    worn = all(material in [slot.material for slot in thing.material_slots] for thing in things)
    return "copy" if worn and not kept else None


def _settable(material, side):
    """The interface node of a material if its values on that side are its own; or None."""
    # one within a group is other materials' too, and what is animated comes back
    nodes = asked_interfaces(material)
    if material.library or len(nodes) != 1 or nodes[0].path or material.node_tree.animation_data:
        return None
    inputs = nodes[0].node.inputs
    free = not any(inputs[f"{kind} {SOCKETS[side]}"].is_linked for kind in ("Index", "Permeability"))
    return nodes[0].node if free else None


def _set_medium(scene, problem):
    values = problem.values
    material = bpy.data.materials[values["material"], None]
    if values["copies"]:
        former, material = material, material.copy()
        for name in problem.things:
            for slot in bpy.data.objects[name, None].material_slots:
                if slot.material == former:
                    slot.link = "OBJECT"
                    slot.material = material
    node = _settable(material, values["side"])
    if node:
        for kind, key in (("Index", "n"), ("Permeability", "mu")):
            node.inputs[f"{kind} {SOCKETS[values['side']]}"].default_value = values[key]


def _material(borders, patch):
    return borders.around.bodies[patch.body].one.materials[patch.slot]


def _thing(borders, patch):
    return borders.around.bodies[patch.body].one.original


def _names(borders, misfit: Misfit):
    """What the two of a Misfit are called: by their objects, or within one object by their materials."""
    pair = (misfit.patch, misfit.partner)
    things = [_thing(borders, patch) for patch in pair]
    return [one.name for one in (things if things[0] != things[1] else [_material(borders, patch) for patch in pair])]


def _said(medium):
    """A medium in a few words, the same in every language."""
    mu = "" if same(medium, type(medium)(medium.n)) else f", mu = {medium.mu:.6g}"
    return f"{'NIM' if medium.is_nim else 'n ='} {medium.n:.6g}{mu}"


MENDS = {"outside": _set_medium}
