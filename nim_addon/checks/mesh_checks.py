# SPDX-License-Identifier: GPL-3.0-or-later
"""What is wrong with the meshes that wear an interface: holes, normals, faces twice; and the mending of it."""

import bpy

# the wheel has bmesh only once bpy is imported
# isort: split
import bmesh
import numpy as np

from ..cycles import visibility
from ..cycles.problem import Problem, about, own_data
from . import media_checks, place_checks
from .borders import Borders
from .sight import Sight, look
from .solids import Solid
from .surroundings import survey

# Where two objects share a mesh that only one of them wants otherwise.
SHARED = "Another object needs the same mesh as it is: make it a mesh of its own first."
# Where a hole is not a plain one.
BY_HAND = "No button can fill it: do it by hand in Edit Mode."
# Modifiers that leave a hole where the mesh has one, and close none.
DEFORMING = {
    *("ARMATURE", "CAST", "CORRECTIVE_SMOOTH", "CURVE", "DISPLACE", "EDGE_SPLIT", "HOOK", "LAPLACIANSMOOTH", "LATTICE"),
    *("NORMAL_EDIT", "SIMPLE_DEFORM", "SMOOTH", "SUBSURF", "SURFACE_DEFORM", "TRIANGULATE", "WARP", "WAVE"),
    *("WEIGHTED_NORMAL",),
}
# Two faces of a filled hole that meet at less than this are shaded as one surface: the cosine.
SMOOTH = 0.87


def find(sight: Sight) -> list[Problem]:
    """The Problems of the meshes that wear an interface, of where they are, and of the media that border on them."""
    borders = Borders(survey(sight))
    own = _normals(sight, borders) + _holes(sight, borders) + _doubled(sight, borders)
    return own + media_checks.find(borders) + place_checks.find(sight, borders.around)


# ---------------------------------------------------------------------------------------------------- normals


def _normals(sight, borders):
    found = []
    turns = _turns(sight, borders)
    for body, wrong, ill in _turned(borders):
        mask = turns[body.one.original]
        parts = body.solid.parts
        if ill:
            text = "The normals of {name} do not agree, so that inside and outside are exchanged here and there."
        elif len(wrong) < len(parts):
            text = "Some parts of {name} are inside out: {count} of {parts}."
        elif parts[wrong[0]].volume < 0:
            text = "The normals of {name} point inwards, so that inside and outside are exchanged."
        else:
            text = "{name} lies in the medium that it has inside itself: its normals should point inwards."
        inwards = not ill and len(wrong) == len(parts) and parts[wrong[0]].volume > 0
        one = about(
            body.one.original,
            "normals",
            text,
            ("Turn them in" if inwards else "Turn them out") if mask is not None else None,
            body.worn,
            mask is None and body.one.original.type == "MESH",
            count=len(wrong) + len(ill),
            parts=len(parts),
        )
        if mask is not None and not _is_wanted(body.one.original, mask, turns):
            one = one._replace(remedy=None, texts=(*one.texts, SHARED))
        found.append(one)
    return found


def _turned(borders):
    """(Body, indices of its parts that are inside out, of those that do not agree), each object of the file once."""
    found = {}
    for index, body in enumerate(borders.around.bodies):
        if body.media and body.one.original not in found:
            interface = {patch.part for patch in borders.patches if patch.body == index}
            wrong = sorted(part for one, part in borders.inverted if one == index)
            ill = [
                part for part in sorted(interface) if not body.solid.parts[part].agreeing
                and body.solid.parts[part].orientable
            ]  # fmt: skip
            found[body.one.original] = (body, wrong, ill)
    return [one for one in found.values() if one[1] or one[2]]


def _turns(sight, borders):
    """{object: the faces of its own mesh that must be turned, (F,); None where a modifier makes them so}."""
    found = {body.one.original: None for body in borders.around.bodies if body.media}
    right = {thing: np.zeros(len(thing.data.polygons), bool) for thing in found if thing.type == "MESH"}
    return {**found, **right, **{body.one.original: _turn(sight, body, *parts) for body, *parts in _turned(borders)}}


def _turn(sight, body, wrong, ill):
    """(F,) the faces of an object's own mesh that must be turned so that its parts are right; or None."""
    thing, shape = body.one.original, body.solid
    if thing.type != "MESH":
        return None
    own = shape if len(thing.modifiers) == 0 else _own(sight, thing)
    if own.count != len(thing.data.polygons):
        return None
    mask = np.zeros(own.count, bool)
    if own is not shape and len(own.parts) != len(shape.parts):
        # which part has become which cannot be told, but if all are wrong
        if len(wrong) + len(ill) < len(shape.parts) or not own.parts:
            return None
        ill = [part for part, one in enumerate(own.parts) if not one.agreeing]
        wrong = [part for part in range(len(own.parts)) if part not in ill]
        sign = min(part.volume for part in shape.parts)
    else:
        sign = None
    for part in (*wrong, *ill):
        one, faces = own.parts[part], own.part == part
        if part in ill:
            if one.agreeing:
                return None
            outward = one.volume >= 0 or not one.closed
            mask[faces] = own.turned[faces] if outward else ~own.turned[faces]
        elif not one.agreeing or _side(one) != np.sign(shape.parts[part].volume if sign is None else sign):
            return None
        else:
            mask[faces] = True
    return mask


def _side(part):
    """The sign of the volume that a part encloses or half encloses; 0 for a sheet."""
    return 0 if abs(part.volume) < 1e-7 * part.area**1.5 else np.sign(part.volume)


def _is_wanted(thing, mask, turns):
    """Whether all objects that are interfaces and share a mesh want the same of it."""
    return all(
        other is not None and np.array_equal(mask, other) for one, other in turns.items() if one.data == thing.data
    )


def _turn_out(scene, problem):
    with visibility.as_rendered(scene) as depsgraph:
        sight = look(scene, depsgraph)
        turns = _turns(sight, Borders(survey(sight)))
        masks = {thing.data: turns[thing] for thing in turns if thing.name in problem.things and not thing.library}
    for mesh, mask in masks.items():
        if mask is not None and mask.any():
            with _Edited(mesh) as shape:
                shape.faces.ensure_lookup_table()
                for face in np.flatnonzero(mask).tolist():
                    shape.faces[face].normal_flip()


# ------------------------------------------------------------------------------------------------------ holes


def _holes(sight, borders):
    found = []
    seen = set()
    for index, body in enumerate(borders.around.bodies):
        thing = body.one.original
        if thing in seen or not body.media:
            continue
        parts = sorted({patch.part for patch in borders.patches if patch.body == index})
        loose = [
            part for part in parts if body.solid.parts[part].holes and not borders.around.is_supported(index, part)
        ]
        if not loose:
            continue
        seen.add(thing)
        filled = tuple(sorted(one.name for one in body.one.materials if one and _has_volume(one)))
        if filled:
            text = "{name} has holes, but its material has a volume, which then has no end."
        elif all(body.solid.parts[part].is_sheet for part in loose):
            text = (
                "{name} is a sheet with nothing at its rim, so that light goes round it: close it to a body, or let it "
                "end at something."
            )
        else:
            text = "{name} has holes: light that goes through them is in the wrong medium."
        own = _own_or_shown(sight, body)
        modified = own is not None and not any(part.holes for part in own.parts)
        code, remedy = "open_volume" if filled else "open", "Close the holes" if own else None
        one = about(thing, code, text, remedy, filled or body.worn, modified)
        if one.remedy and not _can_close(sight, thing, own):
            sheet = any(part.is_sheet for part in own.parts if part.holes)
            one = one._replace(remedy=None, texts=one.texts if sheet else (*one.texts, BY_HAND))
        found.append(one)
    return found


def _can_close(sight, thing, own):
    kept = sight.kept.setdefault(thing.session_uid, {})
    if "closes" not in kept:
        mesh = bpy.data.meshes.new("filled")
        try:
            kept["closes"] = _fill(thing.data, own, mesh)
        finally:
            bpy.data.meshes.remove(mesh)
    return kept["closes"] and all(modifier.type in DEFORMING for modifier in thing.modifiers)


def _fill(mesh, solid, into):
    """Fill the holes of a mesh, no vertex moved or merged, into another; whether that one is closed then, as it must be."""
    outlines = solid.outlines()
    if not outlines or any(part.is_sheet or not part.agreeing for part in solid.parts if part.holes):
        return False
    shape = bmesh.new()
    try:
        shape.from_mesh(mesh)
        shape.verts.ensure_lookup_table()
        faces, caps = list(shape.faces), []
        for outline, beside in outlines:
            try:
                caps.append(shape.faces.new([shape.verts[vertex] for vertex in outline], faces[beside]))
            except ValueError:  # there is one already
                return False
            _soften(caps[-1])
        bmesh.ops.triangulate(shape, faces=[face for face in caps if len(face.verts) > 4])
        shape.to_mesh(into)
    finally:
        shape.free()
    filled = Solid(into)
    former = np.zeros(filled.count, bool)
    former[: solid.count] = np.isin(solid.part, [i for i, part in enumerate(solid.parts) if part.holes])
    parts = np.unique(filled.part[former]).tolist()
    if any(part.holes for part in filled.parts) or not all(_is_whole(filled.parts[part]) for part in parts):
        return False
    # what is closed now must not reach into what is beside it
    if len(filled.parts) > 1:
        for part in range(len(filled.parts)):
            for place in filled.samples(filled.part == part, 9)[0]:
                others = filled.within(place) - {part}
                if others & set(parts) or (others and part in parts):
                    return False
    return True


def _is_whole(part):
    return part.closed and part.agreeing and _side(part) != 0


def _soften(face):
    """Shade a face that fills a hole as one surface with its neighbours only where it goes on like them."""
    face.normal_update()
    smooth = face.smooth
    for edge in face.edges:
        beside = [other for other in edge.link_faces if other is not face]
        if not beside or any(other.normal.dot(face.normal) < SMOOTH for other in beside):
            edge.smooth = False
            smooth = smooth and len(face.verts) <= 4
    face.smooth = smooth


def _close(scene, problem):
    for mesh in own_data(problem):
        filled = bpy.data.meshes.new("filled")
        try:
            if _fill(mesh, Solid(mesh), filled):
                _fill(mesh, Solid(mesh), mesh)  # itself, with its shape keys
                mesh.update()
        finally:
            bpy.data.meshes.remove(filled)


def _has_volume(material):
    output = material.node_tree.get_output_node("CYCLES") if visibility.has_nodes(material) else None
    return output is not None and output.inputs["Volume"].is_linked


# ------------------------------------------------------------------------------------------------ faces twice


def _doubled(sight, borders):
    found = {}
    for body in borders.around.bodies:
        thing = body.one.original
        worn = np.isin(body.slots(), list(body.media)) & body.solid.doubled
        if thing not in found and worn.any():
            text = "{name} has {count} faces twice in the same place, so that one or the other is met by chance."
            own = _own_or_shown(sight, body)
            # a wall between two bodies, once on each side, would still be there
            remedy = "Remove the second ones" if own and not own.backed.any() else None
            modified = own is not None and not own.doubled.any()
            found[thing] = about(thing, "doubled", text, remedy, body.worn, modified, count=int(worn.sum()))
    return list(found.values())


def _remove_doubled(scene, problem):
    for mesh in own_data(problem):
        doubled = Solid(mesh).doubled
        with _Edited(mesh) as shape:
            faces = [face for face, twice in zip(shape.faces, doubled.tolist(), strict=True) if twice]
            bmesh.ops.delete(shape, geom=faces, context="FACES")


# -----------------------------------------------------------------------------------------------------------


def _own(sight, thing):
    """The Solid of an object's mesh without its modifiers."""
    kept = sight.kept.setdefault(thing.session_uid, {})
    if "own" not in kept:
        kept["own"] = Solid(thing.data)
    return kept["own"]


def _own_or_shown(sight, body):
    """The Solid of an object's own mesh, which is what is shown where nothing modifies it; None of curves and texts."""
    thing = body.one.original
    if thing.type != "MESH":
        return None
    return _own(sight, thing) if thing.modifiers else body.solid


class _Edited:
    """A mesh as a bmesh, written back at the end."""

    def __init__(self, mesh):
        self.mesh = mesh

    def __enter__(self):
        self.shape = bmesh.new()
        self.shape.from_mesh(self.mesh)
        return self.shape

    def __exit__(self, *error):
        if error[0] is None:
            self.shape.to_mesh(self.mesh)
            self.mesh.update()
        self.shape.free()


MENDS = {
    **media_checks.MENDS,
    **place_checks.MENDS,
    "normals": _turn_out,
    "open": _close,
    "open_volume": _close,
    "doubled": _remove_doubled,
}
# Of all Problems that find() may find.
CODES = {*MENDS, "coarse", "far"}
