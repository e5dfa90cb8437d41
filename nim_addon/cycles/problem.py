# SPDX-License-Identifier: GPL-3.0-or-later
"""What may be wrong in a scene, as a value: the sentence that says it, and whether a button can mend it."""

from typing import NamedTuple

import bpy

# The sentence that is added where a thing cannot be changed in this file.
LINKED = "It is linked from a library: mend it in that file."
# And where the mesh itself needs no mending, so that a button could change nothing.
MODIFIED = "A modifier makes it so, not the mesh itself: mend it there."


class Problem(NamedTuple):
    """One thing that is wrong.

    code:      what kind it is, a key of MENDS
    texts:     templates of the sentences that say it, filled in from `values`
    remedy:    what mending does, in a few words for a button; None where only a person can
    things:    names of the objects it is about, if any
    materials: names of the interface materials it is about; None for all of the scene's
    """

    code: str
    texts: tuple
    values: dict
    remedy: str | None
    things: tuple = ()
    materials: tuple | None = None

    @property
    def sentence(self):
        """What is wrong, in English."""
        return " ".join(self.texts).format(**self.values)


def about(thing, code, text, remedy, materials=None, modified=False, owner=None, **values):
    """The Problem of a bpy.types.Object; without a button where what would be mended is a library's.

    code, text, remedy, materials, values: as of Problem; modified: whether a modifier is what is wrong;
    owner: what would be mended, the object's data if None
    """
    texts = (text, MODIFIED) if modified else (text,)
    # modifiers are the object's, which may be of this file though its data is linked
    linked = (owner or (thing if modified else thing.data)).library
    if linked:
        texts += (LINKED,)
    remedy = None if modified or linked else remedy
    return Problem(code, texts, {"name": thing.name, **values}, remedy, (thing.name,), materials)


def own_things(problem):
    """The objects of this file that a Problem is about."""
    return [bpy.data.objects[name, None] for name in problem.things]


def own_data(problem):
    """The object data that a Problem is about, each once, though several objects share it."""
    return list(dict.fromkeys(thing.data for thing in own_things(problem)))
