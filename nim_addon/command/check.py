# SPDX-License-Identifier: GPL-3.0-or-later
"""What *Check This Blender* has run in a second Blender: doctor and a short verify. No subcommand: a person has those two."""

from __future__ import annotations

import sys

from ..base import records
from ..base.files import whole
from ..base.signals import leave
from . import doctor


def main(target: str) -> None:
    """Write what they say to the file `target`, as JSON: {"doctor": {...}, "verify": {...}}."""
    facts, problems = doctor.examine()
    from ..cycles import verify

    answer = {
        "doctor": {**facts, "problems": problems},
        "verify": verify.summary(verify.verify(short=True), "auto"),
    }
    whole(target, lambda part: part.write_text(records.text(answer), encoding="utf-8"))


if __name__ == "__main__":
    main(*sys.argv[1:])
    leave(0)  # Blender as a module may wait for itself for good at its own end
