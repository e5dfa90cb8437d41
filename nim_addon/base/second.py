# SPDX-License-Identifier: GPL-3.0-or-later
"""What a second Blender does, which processes.second_blender() starts: it runs a module of this package."""

from __future__ import annotations

import os
import runpy
import signal
import sys
import threading
import time

from .shipped import PACKAGE

PATIENCE = 3  # seconds in which what was begun is cleared away


def main() -> None:
    """Run the module that sys.argv names behind "--", with the words behind it, until standard input ends.

    It does as the first process ends or is killed: an interrupt then lets the module clear away what it has begun. What
    comes in before, the module reads as its own standard input.
    """
    module, *words = sys.argv[sys.argv.index("--") + 1 :]
    inner, outer = os.pipe()
    sys.stdin = open(inner, encoding="utf-8")  # noqa: SIM115, it lasts as long as the process

    def end_with_parent():
        while said := os.read(0, 65536):
            os.write(outer, said)
        signal.raise_signal(signal.SIGINT)
        time.sleep(PATIENCE)
        os._exit(130)

    threading.Thread(target=end_with_parent, daemon=True).start()
    sys.argv = ["nimray", *words]
    runpy.run_module(f"{PACKAGE}.{module}", run_name="__main__")
