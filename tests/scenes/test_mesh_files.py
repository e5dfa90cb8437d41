# SPDX-License-Identifier: GPL-3.0-or-later
"""Mesh files as their programs write them are read as Blender reads them; as nobody should, they are refused in words."""

import random
import struct

import bpy
import numpy as np
import pytest

from nim_addon.scenes import glass, mesh_files

POINTS = [(0, 0, 0), (2, 0, 0), (0, 3, 0), (0, 0, 5), (2, 3, 5)]
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 4, 3)]


def ply(form="ascii", faces=FACES, more=False):
    """A PLY file of POINTS and faces; `more`: with values that no mesh needs, before, between and after."""
    order = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}[form]
    extra = "property uchar red\n" if more else ""
    text = f"ply\nformat {form} 1.0\ncomment made by hand\nelement vertex {len(POINTS)}\nproperty float x\nproperty double y\n"
    text += f"{extra}property float z\nelement face {len(faces)}\n{extra}property list uchar int vertex_indices\n"
    text += "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n"
    color = [200] if more else []
    rows = [("fd" + "B" * more + "f", [x, y, *color, z]) for x, y, z in POINTS]
    rows += [("B" * more + f"B{len(face)}i", [*color, len(face), *face]) for face in faces] + [("2i", [0, 1])]
    if order is None:
        return (text + "".join(" ".join(map(str, row)) + "\n" for _, row in rows)).encode()
    return text.encode() + b"".join(struct.pack(order + form, *row) for form, row in rows)


STRIPS = ply(faces=[]).replace(
    b"element edge 1", b"element tristrips 1\nproperty list int int vertex_indices\nelement edge 1"
)
STRIPS = STRIPS.replace(b"\n0 1\n", b"\n9 0 1 2 3 -1 1 2 3 4\n0 1\n")
OBJ = b"""# made by hand
mtllib none.mtl
v 0 0 0
v 2 0 0 1.0
v 0 0 -3
v 0 5 0
vn 0 0 1
vt 0 0
o a\xff
f 1//1 3//1 2//1
usemtl blue
s off
f -4/1 -3/1/1 \\
  -1
g b
v 2 5 -3
f 1 4 3
f 2 3 5 4
l 1 2
"""


def triangles():
    return [[POINTS[corner] for corner in face[:3]] for face in FACES]


def stl():
    body = b"".join(b"\0" * 12 + np.array(face, np.float32).tobytes() + b"\0\0" for face in triangles())
    return b"solid in name only".ljust(80) + struct.pack("<I", len(FACES)) + body


def stl_in_words():
    facets = (
        "facet normal 0 0 0\n outer loop\n"
        + "".join("  vertex {} {} {}\n".format(*point) for point in face)
        + " endloop\nendfacet\n"
        for face in triangles()
    )
    return f"solid thing\n{''.join(facets)}endsolid thing\n".encode()


FILES = {
    "words.ply": ply(),
    "windows.ply": ply().replace(b"\n", b"\r\n"),
    "little.ply": ply("binary_little_endian"),
    "big.ply": ply("binary_big_endian"),
    "more.ply": ply(more=True),
    "more little.ply": ply("binary_little_endian", more=True),
    "more big.ply": ply("binary_big_endian", FACES[:3], more=True),
    "triangles.ply": ply("binary_little_endian", FACES[:3]),
    "strips.ply": STRIPS,
    "a.obj": OBJ,
    "b.stl": stl(),
    "words.stl": stl_in_words(),
}


def drawn(vertices, faces):
    """The faces as places of their corners, each begun at its least, in an order of their own."""
    places = [[tuple(np.round(vertices[corner], 5) + 0.0) for corner in face] for face in faces]
    return sorted(face[(least := face.index(min(face))) :] + face[:least] for face in places)


def ours(path):
    mesh = mesh_files.read(path)
    return drawn(mesh.vertices, np.split(mesh.corners, np.cumsum(mesh.counts)[:-1]))


def blenders(path):
    getattr(bpy.ops.wm, f"{path.suffix[1:]}_import")(filepath=str(path))
    found = []
    for object_ in bpy.context.scene.objects:
        vertices = [object_.matrix_basis @ vertex.co for vertex in object_.data.vertices]
        found += drawn(vertices, [face.vertices for face in object_.data.polygons])
    return sorted(found)


@pytest.mark.parametrize("name", FILES)
def test_a_file_is_read_as_blenders_own_importer_reads_it(name, tmp_path, empty_file):
    path = tmp_path / name
    path.write_bytes(FILES[name])
    theirs = blenders(path)
    assert len(theirs) >= 3
    if name == "strips.ply":  # of a triangle that is there twice, turned, Blender keeps one
        assert [face for face in ours(path) if face in theirs] == theirs and len(ours(path)) == len(theirs) + 1
    else:
        assert ours(path) == theirs


HEAD = ply(faces=FACES[:1])
POINTS_ONLY = ply().partition(b"element face")[0]
REFUSED = {
    # these ended the process, and Blender with it
    "many vertices.ply": (ply().replace(b"vertex 5", b"vertex 999999999"), "cut off"),
    "no count.ply": (ply().replace(b"vertex 5", b"vertex"), "'element vertex'"),
    # these were taken, or refused without a reason
    "many faces.ply": (ply().replace(b"face 4", b"face 99999999999"), "cut off"),
    "long list.ply": (HEAD.replace(b"\n3 0 2 1", b"\n4000000000 0 2 1"), "cut off"),
    "negative list.ply": (HEAD.replace(b"\n3 0 2 1", b"\n-3 0 2 1"), "whole numbers"),
    "half a corner.ply": (HEAD.replace(b"\n3 0 2 1", b"\n3 0 2.5 1"), "not there"),
    "no corner.ply": (HEAD.replace(b"\n3 0 2 1", b"\n3 0 2 nan"), "not there"),
    "far corner.ply": (HEAD.replace(b"\n3 0 2 1", b"\n3 0 2 5"), "not there"),
    "negative corner.ply": (HEAD.replace(b"\n3 0 2 1", b"\n3 0 2 -1"), "not there"),
    "minus.ply": (ply().replace(b"vertex 5", b"vertex -5"), "'element vertex -5'"),
    "big count.ply": (ply().replace(b"vertex 5", b"vertex " + b"9" * 5000), "not understood"),
    "twice.ply": (ply().replace(b"double y", b"double x"), "'x' twice"),
    "no z.ply": (ply().replace(b"float z", b"float q"), "no x, y and z"),
    "listed z.ply": (ply().replace(b"float z", b"list uchar int z"), ""),
    "points.ply": (POINTS_ONLY + b"end_header\n" + ply().partition(b"end_header\n")[2], "no faces"),
    "klingon.ply": (ply().replace(b"ascii", b"klingon"), "no format"),
    "headless.ply": (ply().replace(b"end_header", b""), "no header"),
    "words.ply": (ply().replace(b"\n2 0.0 0", b"\ntwo 0 0").replace(b"\n2 0 0", b"\ntwo 0 0"), "a word"),
    "nan.ply": (ply().replace(b"\n2 0 0", b"\nnan 0 0"), "finite"),
    "wide.ply": (ply().replace(b"\n2 0 0", b"\n1e308 0 0").replace(b"\n0 3 0", b"\n-1e308 0 0"), "no size"),
    "escape.ply": (ply().replace(b"element face", b"\x1b[31mred"), "\\x1b[31mred 4"),
    "bare.ply": (ply().partition(b"end_header\n")[0] + b"end_header\n", "cut off"),
    "blank.ply": (ply().partition(b"end_header\n")[0] + b"end_header\n \n", "cut off"),
    "cut.ply": (ply("binary_little_endian")[:-20], "cut off"),
    "far corner.obj": (OBJ + b"f 1 2 9\n", "not there"),
    "corner 0.obj": (OBJ + b"f 1 2 0\n", "not there"),
    "far back.obj": (OBJ + b"f 1 2 -9\n", "not there"),
    "huge.obj": (OBJ + b"f 1 2 99999999999999999999\n", "out of range"),
    "words.obj": (OBJ + b"f a b c\n", "a word"),
    "short.obj": (OBJ + b"v 1 2\n", "fewer than three"),
    "inf.obj": (OBJ.replace(b"v 0 5 0", b"v 0 inf 0"), "finite"),
    "thin.obj": (b"v 0 0 0\nv 1 0 0\nf 1 2 1\n", "no faces"),
    "claims.stl": (b"\0" * 80 + b"\xff" * 4, "not an STL file"),
    "cut.stl": (stl_in_words()[:-60], "cut off"),
    "part.stl": (stl_in_words().replace(b"endsolid", b"facet\nvertex 0 0 0\nendsolid"), "cut off"),
    "empty.stl": (b"solid x\nendsolid x\n", "no faces"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_file_that_makes_no_sense_is_refused_in_a_few_words(name, tmp_path):
    content, says = REFUSED[name]
    assert content not in FILES.values()
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError) as caught:
        mesh_files.read(tmp_path / name)
    assert says in str(caught.value)
    assert len(str(caught.value)) < 240 and str(caught.value).isprintable()


def test_a_long_comment_is_no_matter(tmp_path):
    """200 kB of it ended Blender."""
    path = tmp_path / "long.ply"
    path.write_bytes(ply().replace(b"comment", b"comment " + b"x" * 200000))
    assert len(mesh_files.read(path).counts) == len(FACES)


def test_a_large_file_is_refused_before_it_is_read(tmp_path):
    with (tmp_path / "large.ply").open("wb") as file:
        file.truncate(1 << 40)  # takes no room
    with pytest.raises(ValueError, match="larger than 512 MB"):
        mesh_files.read(tmp_path / "large.ply")


def mutated(content, chance):
    """The file with bytes, numbers, pieces changed, as a stranger or a bad disk would."""
    content = bytearray(content)
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(len(content) or 1)
        match chance.randrange(6):
            case 0:
                content[at] = chance.randrange(256)
            case 1:
                content[at : at + chance.randint(1, 40)] = b""
            case 2:
                content[at:at] = chance.choice((b"9", b"-", b"1e", b" ", b"\n", b"nan ", b"\0" * 4, b"\xff" * 4))
            case 3:
                start = chance.randrange(len(content) or 1)
                content[at:at] = content[start : start + chance.randint(1, 60)]
            case 4:
                del content[at + 1 :]
            case 5:
                content[at : at + 4] = struct.pack("<i", chance.choice((-1, 2**31 - 1, -(2**31), 3, 1 << 24)))
    return bytes(content)


@pytest.mark.parametrize("name", FILES)
def test_whatever_a_file_holds_a_sound_mesh_comes_out_or_a_sentence(name, tmp_path, empty_file):
    chance, path = random.Random(name), tmp_path / name
    outcomes = set()
    for _ in range(300):
        path.write_bytes(mutated(FILES[name], chance))
        try:
            mesh = mesh_files.read(path)
        except ValueError as error:
            assert str(error).isprintable() and len(str(error)) < 240
            outcomes.add("refused")
        else:
            outcomes.add("read")
            assert np.isfinite(mesh.vertices).all() and mesh.vertices.shape == (mesh.corners.max() + 1, 3)
            assert mesh.counts.sum() == len(mesh.corners) and mesh.counts.min() >= 3 and mesh.corners.min() == 0
            statue = glass.statue_mesh(str(path))
            assert not statue.validate() and len(statue.polygons)
            bpy.data.meshes.remove(statue)
    assert outcomes == {"refused", "read"}
