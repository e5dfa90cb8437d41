# SPDX-License-Identifier: GPL-3.0-or-later
"""A render as a value: what is asked for, known by its content, and the act."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

from .asked import Asked, NoPhotons, known
from .external import sha256_of
from .session import NotTraced, Rendered, Session, Showing, can_denoise

__all__ = ["NoPhotons", "NotTraced", "Rendered", "Request", "Session", "Showing", "can_denoise"]


def digest(record: dict) -> str:
    """The SHA-256 of a JSON-ready dict, in hexadecimal."""
    return hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class Request(Asked):
    """What is asked for, with what is done with it."""

    def decided(self) -> Request:
        """The same with all decided that it leaves open, as its image records it; raises as Session.request does."""
        with Session(self) as session:
            return session.request

    def key(self) -> str:
        """A hash, in hexadecimal, of all that decides the pixels: files count by their content, not by their names.

        It is of what is decided(), so a request and the record of its image have the same: where something is open, the
        scene is built to decide it. Raises as decided() does.
        """
        return digest(self.decided().content())

    def content(self) -> dict:
        """Its record with the content of files in the place of their names."""
        record = self.record()
        if self.blend:
            del record["blend"]["file"]
            if files := record["blend"].pop("files", None):
                record["blend"]["files"] = sorted(files.values())
        else:
            record["parameters"] |= {name: sha256_of(path) for name, path in known(self.parameters).files().items()}
        return record

    # -------------------------------------------------------------------------------------------- the act

    def render(self, folder: str | Path, name: str | None = None, **options) -> Rendered:
        """Render it to NAME.exr (linear, 32-bit) and NAME.png (as displayed), NAME being `name` where nobody says.

        folder, options: as for Session.render(); raises as it does
        """
        with Session(self) as session:
            return session.render(folder, self.name if name is None else name, **options)
