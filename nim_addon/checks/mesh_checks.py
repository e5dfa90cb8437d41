# SPDX-License-Identifier: GPL-3.0-or-later
"""What is wrong with the meshes that wear an interface: holes, normals, faces twice; and the mending of it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

# the wheel has bmesh only once bpy is imported
# isort: split
import bmesh
import numpy as np

from ..cycles import meshes, visibility
from ..cycles.problem import Problem, about, own_data
from . import loss_checks, media_checks, place_checks
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
    placeless = _placeless(sight)
    borders = Borders(survey(sight))
    own = _normals(sight, borders) + _holes(sight, borders) + _doubled(sight, borders)
    own += media_checks.find(borders) + loss_checks.find(sight, borders)
    own += place_checks.find(sight, borders.around)
    # whose shape is not known: what else is said of it would be of another
    unknown = {name for problem in placeless for name in problem.objects}
    return placeless + [problem for problem in own if not unknown & set(problem.objects)]


# --------------------------------------------------------------------------------- vertices that are nowhere


def _placeless(sight):
    found = {}
    for shown in sight.shown:
        obj = shown.original
        if obj in found or (sight.limit is not None and len(shown.mesh.polygons) > sight.limit):
            continue
        count = sight.measured(shown, "placeless", lambda mesh: int(meshes.placeless(mesh).sum()))
        if count:
            own = obj.type == "MESH" and meshes.placeless(obj.data).any()
            text = (
                "{name} has vertices whose coordinates are no finite numbers ({count}), so that its shape is not known."
            )
            remedy = "Remove these vertices" if own else None
            found[obj] = about(obj, "placeless", text, remedy, None, not own and obj.type == "MESH", count=count)
    return list(found.values())


def _remove_placeless(scene, problem):
    for mesh in own_data(problem):
        lost = np.flatnonzero(meshes.placeless(mesh)).tolist()
        with edited(mesh) as shape:
            shape.verts.ensure_lookup_table()
            bmesh.ops.delete(shape, geom=[shape.verts[vertex] for vertex in lost], context="VERTS")


# ---------------------------------------------------------------------------------------------------- normals


def _normals(sight, borders):
    found = []
    turns = _turns(sight, borders)
    for body, wrong, ill in _turned(borders):
        mask = turns[body.object]
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
        problem = about(
            body.object,
            "normals",
            text,
            ("Turn them in" if inwards else "Turn them out") if mask is not None else None,
            body.worn,
            mask is None and body.object.type == "MESH",
            count=len(wrong) + len(ill),
            parts=len(parts),
        )
        if mask is not None and not _is_wanted(body.object, mask, turns):
            problem = problem._replace(remedy=None, texts=(*problem.texts, SHARED))
        found.append(problem)
    return found


def _turned(borders):
    """(Body, indices of its parts that are inside out, of those that do not agree), each object of the file once."""
    found = {}
    for index, body in enumerate(borders.around.bodies):
        if body.media and body.object not in found:
            interface = {patch.part for patch in borders.patches if patch.body == index}
            wrong = sorted(part for where, part in borders.inverted if where == index)
            ill = [
                part for part in sorted(interface) if not body.solid.parts[part].agreeing
                and body.solid.parts[part].orientable
            ]  # fmt: skip
            found[body.object] = (body, wrong, ill)
    return [(body, wrong, ill) for body, wrong, ill in found.values() if wrong or ill]


def _turns(sight, borders):
    """{object: the faces of its own mesh that must be turned, (F,); None where a modifier makes them so}."""
    found = {body.object: None for body in borders.around.bodies if body.media}
    right = {obj: np.zeros(len(obj.data.polygons), bool) for obj in found if obj.type == "MESH"}
    return {**found, **right, **{body.object: _turn(sight, body, *parts) for body, *parts in _turned(borders)}}


def _turn(sight, body, wrong, ill):
    """(F,) the faces of an object's own mesh that must be turned so that its parts are right; or None."""
    obj, shape = body.object, body.solid
    if obj.type != "MESH":
        return None
    own = shape if len(obj.modifiers) == 0 else _own(sight, obj)
    if own.count != len(obj.data.polygons):
        return None
    mask = np.zeros(own.count, bool)
    if own is not shape and len(own.parts) != len(shape.parts):
        # which part has become which cannot be told, but if all are wrong
        if len(wrong) + len(ill) < len(shape.parts) or not own.parts:
            return None
        ill = [part for part, whole in enumerate(own.parts) if not whole.agreeing]
        wrong = [part for part in range(len(own.parts)) if part not in ill]
        sign = min(part.volume for part in shape.parts)
    else:
        sign = None
    for part in (*wrong, *ill):
        own_part, faces = own.parts[part], own.part == part
        if part in ill:
            if own_part.agreeing:
                return None
            outward = own_part.volume >= 0 or not own_part.closed
            mask[faces] = own.turned[faces] if outward else ~own.turned[faces]
        elif not own_part.agreeing or _side(own_part) != np.sign(shape.parts[part].volume if sign is None else sign):
            return None
        else:
            mask[faces] = True
    return mask


def _side(part):
    """The sign of the volume that a part encloses or half encloses; 0 for a sheet."""
    return 0 if abs(part.volume) < 1e-7 * part.area**1.5 else np.sign(part.volume)


def _is_wanted(obj, mask, turns):
    """Whether all objects that are interfaces and share a mesh want the same of it."""
    return all(
        other is not None and np.array_equal(mask, other) for user, other in turns.items() if user.data == obj.data
    )


def _turn_out(scene, problem):
    with visibility.as_rendered(scene) as depsgraph:
        sight = look(scene, depsgraph)
        turns = _turns(sight, Borders(survey(sight)))
        masks = {obj.data: turns[obj] for obj in turns if obj.name in problem.objects and not obj.library}
    for mesh, mask in masks.items():
        if mask is not None and mask.any():
            with edited(mesh) as shape:
                shape.faces.ensure_lookup_table()
                for face in np.flatnonzero(mask).tolist():
                    shape.faces[face].normal_flip()


# ------------------------------------------------------------------------------------------------------ holes


def _holes(sight, borders):
    found = []
    seen = set()
    for index, body in enumerate(borders.around.bodies):
        obj = body.object
        if obj in seen or not body.media:
            continue
        parts = sorted({patch.part for patch in borders.patches if patch.body == index})
        loose = [
            part for part in parts if body.solid.parts[part].holes and not borders.around.is_supported(index, part)
        ]
        if not loose:
            continue
        seen.add(obj)
        filled = tuple(sorted(material.name for material in body.shown.materials if material and _has_volume(material)))
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
        problem = about(obj, code, text, remedy, filled or body.worn, modified)
        if problem.remedy and not _can_close(sight, obj, own):
            sheet = any(part.is_sheet for part in own.parts if part.holes)
            problem = problem._replace(remedy=None, texts=problem.texts if sheet else (*problem.texts, BY_HAND))
        found.append(problem)
    return found


def _can_close(sight, obj, own):
    kept = sight.kept.setdefault(obj.session_uid, {})
    if "closes" not in kept:
        mesh = bpy.data.meshes.new("filled")
        try:
            kept["closes"] = _fill(obj.data, own, mesh)
        finally:
            bpy.data.meshes.remove(mesh)
    return kept["closes"] and all(modifier.type in DEFORMING for modifier in obj.modifiers)


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
        obj = body.object
        worn = np.isin(body.slots(), list(body.media)) & body.solid.doubled
        if obj not in found and worn.any():
            text = "{name} has faces twice in the same place ({count}), so that one or the other is met by chance."
            own = _own_or_shown(sight, body)
            # a wall between two bodies, once on each side, would still be there
            remedy = "Remove the second ones" if own and not own.backed.any() else None
            modified = own is not None and not own.doubled.any()
            found[obj] = about(obj, "doubled", text, remedy, body.worn, modified, count=int(worn.sum()))
    return list(found.values())


def _remove_doubled(scene, problem):
    for mesh in own_data(problem):
        doubled = Solid(mesh).doubled
        with edited(mesh) as shape:
            faces = [face for face, twice in zip(shape.faces, doubled.tolist(), strict=True) if twice]
            bmesh.ops.delete(shape, geom=faces, context="FACES")


# -----------------------------------------------------------------------------------------------------------


def _own(sight, obj):
    """The Solid of an object's mesh without its modifiers."""
    kept = sight.kept.setdefault(obj.session_uid, {})
    if "own" not in kept:
        kept["own"] = Solid(obj.data)
    return kept["own"]


def _own_or_shown(sight, body):
    """The Solid of an object's own mesh, which is what is shown where nothing modifies it; None of curves and texts."""
    obj = body.object
    if obj.type != "MESH":
        return None
    return _own(sight, obj) if obj.modifiers else body.solid


@contextmanager
def edited(mesh: bpy.types.Mesh) -> Iterator[bmesh.types.BMesh]:
    """A mesh as a bmesh, written back at the end where nothing was raised."""
    shape = bmesh.new()
    try:
        shape.from_mesh(mesh)
        yield shape
        shape.to_mesh(mesh)
        mesh.update()
    finally:
        shape.free()


MENDS = {
    **media_checks.MENDS,
    **loss_checks.MENDS,
    **place_checks.MENDS,
    "normals": _turn_out,
    "open": _close,
    "open_volume": _close,
    "doubled": _remove_doubled,
    "placeless": _remove_placeless,
}
# Of all Problems that find() may find.
CODES = {*MENDS, "coarse", "far"}
