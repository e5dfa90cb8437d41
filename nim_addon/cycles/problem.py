# SPDX-License-Identifier: GPL-3.0-or-later
"""What may be wrong in a scene, as a value: the sentence that says it, and whether a button can mend it."""

from __future__ import annotations

from typing import Any, NamedTuple

import bpy

# The sentence that is added where something cannot be changed in this file.
LINKED = "It is linked from a library: mend it in that file."
# And where the mesh itself needs no mending, so that a button could change nothing.
MODIFIED = "A modifier makes it so, not the mesh itself: mend it there."


class Problem(NamedTuple):
    """One thing that is wrong.

    code:      what kind it is, a key of MENDS
    texts:     templates of the sentences that say it, filled in from `values`
    remedy:    what mending does, in a few words for a button; None where only a person can
    objects:   names of the objects it is about, if any
    materials: names of the interface materials it is about; None for all of the scene's
    """

    code: str
    texts: tuple[str, ...]
    values: dict[str, Any]
    remedy: str | None
    objects: tuple[str, ...] = ()
    materials: tuple[str, ...] | None = None

    @property
    def sentence(self) -> str:
        """What is wrong, in English."""
        return " ".join(self.texts).format(**self.values)


def about(
    obj: bpy.types.Object,
    code: str,
    text: str,
    remedy: str | None,
    materials: tuple[str, ...] | None = None,
    modified: bool = False,
    owner: bpy.types.ID | None = None,
    **values: Any,
) -> Problem:
    """The Problem of a bpy.types.Object; without a button where what would be mended is a library's.

    code, text, remedy, materials, values: as of Problem; modified: whether a modifier is what is wrong;
    owner: what would be mended, the object's data if None
    """
    texts = (text, MODIFIED) if modified else (text,)
    # modifiers are the object's, which may be of this file though its data is linked
    linked = (owner or (obj if modified else obj.data)).library
    if linked:
        texts += (LINKED,)
    remedy = None if modified or linked else remedy
    return Problem(code, texts, {"name": obj.name, **values}, remedy, (obj.name,), materials)


def own_objects(problem: Problem) -> list[bpy.types.Object]:
    """The objects of this file that a Problem is about."""
    return [bpy.data.objects[name, None] for name in problem.objects]


def own_data(problem: Problem) -> list[Any]:
    """The object data that a Problem is about, each once, though several objects share it."""
    return list(dict.fromkeys(obj.data for obj in own_objects(problem)))
