# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes in files of strangers: PLY, OBJ and STL, read here, as Blender's importers end the process on some of them."""

import re
import warnings
from array import array
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np

LARGEST = 512 << 20  # bytes of a file; read, it takes some ten times as much memory at worst
CUT_OFF = "it is cut off"
NO_NUMBER = "it has a word where a number should be"

_Number = TypeVar("_Number", int, float)


class Mesh(NamedTuple):
    """Vertices (N, 3), in the file's unit, each of use; the vertices (C,) at the corners of all faces in turn; and how
    many corners each face has (F,), 3 at least and no vertex twice."""

    vertices: np.ndarray
    corners: np.ndarray
    counts: np.ndarray


def read(path: str | Path) -> Mesh:
    """The faces in a file whose name ends in .ply, .obj or .stl, turned as Blender's own importers turn them.

    Raises OSError where it cannot be read, and ValueError, a few words, where it is damaged or holds no faces.
    """
    path = Path(path)
    if path.stat().st_size > LARGEST:
        raise ValueError(f"it is larger than {LARGEST >> 20} MB")
    try:
        mesh = {".ply": _ply, ".obj": _obj, ".stl": _stl}[path.suffix.lower()](path)
    except OverflowError:
        raise ValueError("it holds a number that is out of range") from None
    return _sound(*mesh)


def _sound(vertices, corners, counts):
    """The Mesh of what a file says, if it makes sense."""
    if len(corners) and not (corners.min() >= 0 and corners.max() < len(vertices)):
        raise ValueError("a face of it names a vertex that is not there")
    face = np.repeat(np.arange(len(counts)), counts)
    order = np.lexsort([corners, face])
    twice = (np.diff(corners[order]) == 0) & (np.diff(face[order]) == 0)
    fit = counts >= 3
    fit[face[order][1:][twice]] = False
    used, corners = np.unique(corners[fit[face]], return_inverse=True)
    vertices = vertices[used]
    if not len(corners):
        raise ValueError("it has no faces")
    if not np.isfinite(vertices).all():
        raise ValueError("a coordinate in it is not a finite number")
    with np.errstate(over="ignore"):
        extent = np.ptp(vertices, axis=0).max()
    if not 0 < extent < np.inf:
        raise ValueError("its faces have no size that could be measured")
    return Mesh(vertices, corners.ravel(), counts[fit])


# ------------------------------------------------------------------------------------------------------------ OBJ, STL


def _obj(path):
    vertices, corners, counts = array("d"), array("q"), array("q")
    begun = []
    with path.open("rb") as file:
        for line in file:
            begun.append(line.rstrip())
            if begun[-1].endswith(b"\\"):  # it goes on in the next
                begun[-1] = begun[-1][:-1]
                continue
            line, begun = b" ".join(begun), []
            keyword, *words = line.split() or [b""]
            if keyword == b"v":
                if len(words) < 3:
                    raise ValueError("a vertex of it has fewer than three coordinates")
                vertices.extend(map(_number, words[:3]))
            elif keyword == b"f":
                known = len(vertices) // 3
                for word in words:
                    index = _number(word.partition(b"/")[0], int)
                    # counted from 1, or, if negative, back from the last; 0 is neither
                    corners.append(index - 1 if index > 0 else known + index if index < 0 else -1)
                counts.append(len(words))
    x, y, z = np.array(vertices).reshape(-1, 3).T
    return np.column_stack([x, -z, y]), np.array(corners, np.int64), np.array(counts, np.int64)


def _number(word: bytes, type_: type[_Number] = float) -> _Number:
    try:
        return type_(word)
    except ValueError:
        raise ValueError(NO_NUMBER) from None


def _stl(path):
    data = path.read_bytes()
    faces = int.from_bytes(data[80:84], "little")
    if len(data) == 84 + 50 * faces:
        facet = np.dtype([("normal", "<f4", 3), ("points", "<f4", (3, 3)), ("rest", "<u2")])
        points = np.frombuffer(data, facet, faces, 84)["points"].reshape(-1, 3).astype(float)
    elif data.lstrip()[:5].lower() == b"solid":
        if b"endsolid" not in data[-1000:].lower():
            raise ValueError(CUT_OFF)
        numbers = array("d")
        for vertex in re.finditer(rb"(?im)^[ \t]*vertex[ \t]+(\S+)[ \t]+(\S+)[ \t]+(\S+)", data):
            numbers.extend(map(_number, vertex.groups()))
        points = np.array(numbers).reshape(-1, 3)
        faces, rest = divmod(len(points), 3)
        if rest:
            raise ValueError(CUT_OFF)
    else:
        raise ValueError("it is not an STL file, or is cut off")
    # a corner that faces share is there once for each of them
    vertices, corners = np.unique(points + 0.0, axis=0, return_inverse=True)
    return vertices, corners.ravel(), np.full(faces, 3)


# ----------------------------------------------------------------------------------------------------------------- PLY

TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
LONGEST_HEADER = 1 << 24  # bytes
ORDERS = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}


class _Property(NamedTuple):
    name: str
    form: np.dtype
    length: np.dtype | None  # of what says how long the list is, if it is one


def _ply(path):
    data = path.read_bytes()
    end = re.compile(rb"[\r\n][ \t]*end_header[ \t]*(?:\r\n|\r|\n|$)").search(data, 0, LONGEST_HEADER)
    if not data.startswith(b"ply") or not end:
        raise ValueError("it has no header of a PLY file")
    order, elements = _header(data[: end.start()].decode("ascii", "replace"))
    body = memoryview(data)[end.end() :]
    if order is None:  # numbers in words are, read, all of one form
        body = memoryview(_numbers(body).tobytes())
    read = {}
    for name, count, properties in elements:
        read[name], body = _element(body, count, properties)
    axes = [read.get("vertex", {}).get(axis, (CUT_OFF, None)) for axis in "xyz"]
    if any(lengths is not None for lengths, _ in axes):
        raise ValueError("its vertices have no x, y and z")
    points = np.column_stack([values for _, values in axes]).astype(float)
    for name in ("vertex_indices", "vertex_index"):
        counts, corners = read.get("face", {}).get(name, (None, None))
        if counts is not None and len(counts):
            return points, _whole(corners), counts
        counts, strips = read.get("tristrips", {}).get(name, (None, None))
        if counts is not None and len(counts):
            corners = _triangles(_whole(strips))
            return points, corners.ravel(), np.full(len(corners), 3)
    raise ValueError("it has no faces")


def _whole(values):
    with np.errstate(invalid="ignore"):
        whole = values.astype(np.int64)
    if (whole != values).any():
        raise ValueError("a face of it names a vertex that is not there")
    return whole


def _numbers(text):
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)  # which numpy made an error later
        try:
            return np.fromstring(bytes(text), sep=" ")
        except (DeprecationWarning, ValueError):
            raise ValueError(NO_NUMBER) from None


def _header(text):
    """Byte order, None for numbers in words, and the elements, (name, count, list of _Property), of a PLY header."""
    lines = [line.split() for line in text.splitlines()[1:]]
    lines = [line for line in lines if line and line[0] not in ("comment", "obj_info")]
    elements, names = [], set()
    match lines[:1]:
        case [["format", form, _]] if form in ORDERS:
            order = ORDERS[form]
        case _:
            raise ValueError("its header names no format that is known")
    for line in lines[1:]:
        match line:
            case ["element", name, count] if re.fullmatch(r"[0-9]{1,18}", count) and name not in names:
                elements.append((name, int(count), []))
                names.add(name)
                known = set()
                continue
            case ["property", "list", length, form, name] if elements and {length, form} <= set(TYPES):
                if TYPES[length][0] == "f":
                    raise ValueError("a list in it is not counted in whole numbers")
            case ["property", form, name] if elements and form in TYPES:
                length = None
            case _:
                raise ValueError(f"its header says {' '.join(line)[:40]!r}, which is not understood")
        if name in known:
            raise ValueError(f"its header names {name[:40]!r} twice")
        known.add(name)
        elements[-1][2].append(_Property(name, _dtype(order, form), _dtype(order, length) if length else None))
    return order, elements


def _dtype(order, form):
    """Of numbers of that form in a body; all are read as one form where they are words, which have no byte order."""
    return np.dtype(order + TYPES[form] if order else "f8")


def _element(body, count, properties):
    """Read an element from its beginning in the memoryview `body`; returns ({property: (lengths, values)}, the rest).

    Of a list, all its values follow each other, and the lengths (count,) part them; else the lengths are None.
    """
    least = sum((property_.length or property_.form).itemsize for property_ in properties)
    if count * least > len(body):
        raise ValueError(CUT_OFF)
    if not least or not count:
        empty = np.empty(0, int)
        return {property_.name: (empty if property_.length else None, empty) for property_ in properties}, body
    row = _alike(body, properties)
    if row is not None and count * row.itemsize <= len(body):
        rows = np.frombuffer(body, row, count)
        lists = [property_ for property_ in properties if property_.length]
        if all((rows[f"length {property_.name}"] == row[property_.name].shape[0]).all() for property_ in lists):
            lengths = {property_.name: rows[f"length {property_.name}"].astype(np.int64) for property_ in lists}
            found = {
                property_.name: (lengths.get(property_.name), rows[property_.name].ravel()) for property_ in properties
            }
            return found, body[count * row.itemsize :]
    return _one_by_one(body, count, properties)


def _alike(body, properties):
    """The dtype of a row whose lists are as long as in the first; None where that is too much for one."""
    fields, size = [], 0
    for property_ in properties:
        if property_.length:
            length, end = _length(body, size, property_)
            fields += [(f"length {property_.name}", property_.length), (property_.name, property_.form, (length,))]
            size = end + length * property_.form.itemsize
        else:
            fields.append((property_.name, property_.form))
            size += property_.form.itemsize
    return np.dtype(fields) if size < 1 << 30 else None


def _one_by_one(body, count, properties):
    lengths = {property_.name: array("q") for property_ in properties}
    values, at = {property_.name: bytearray() for property_ in properties}, 0
    for _ in range(count):
        for property_ in properties:
            length, at = _length(body, at, property_) if property_.length else (1, at)
            end = at + length * property_.form.itemsize
            if end > len(body):
                raise ValueError(CUT_OFF)
            lengths[property_.name].append(length)
            values[property_.name] += body[at:end]
            at = end
    found = {
        name: (np.array(lengths[name], np.int64) if length else None, np.frombuffer(values[name], form))
        for name, form, length in properties
    }
    return found, body[at:]


def _length(body, at, property_):
    """How long the list is that begins at a place of `body`, and where its values begin."""
    end = at + property_.length.itemsize
    if end > len(body):
        raise ValueError(CUT_OFF)
    length = float(np.frombuffer(body[at:end], property_.length)[0])
    if not (length >= 0 and length.is_integer()):
        raise ValueError("a list in it is not counted in whole numbers")
    if length * property_.form.itemsize > len(body) - end:
        raise ValueError(CUT_OFF)
    return int(length), end


def _triangles(strips):
    """The triangles (T, 3) of strips that -1 parts: each vertex closes one with the two before it, every other turned."""
    if not len(strips):
        return np.empty((0, 3), np.int64)
    triangles = np.stack([strips[:-2], strips[1:-1], strips[2:]], axis=-1)
    place = np.arange(len(strips))
    begun = np.maximum.accumulate(np.where(strips == -1, place + 1, 0))[: len(triangles)]
    odd = (place[: len(triangles)] - begun) % 2 == 1
    triangles[odd, :2] = triangles[odd, 1::-1]
    return triangles[(triangles != -1).all(axis=1)]
