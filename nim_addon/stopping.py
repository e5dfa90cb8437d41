# SPDX-License-Identifier: GPL-3.0-or-later
"""Ctrl-C and a kill, for the command: what they do while it loads, and what once there is something to clear away."""

import os
import signal

SIGNALS = (signal.SIGINT, signal.SIGTERM)


def at_once():
    """Let them end this process at once: while Blender or numpy is imported, an exception is swallowed, or breaks them."""
    for number in SIGNALS:
        signal.signal(number, _end)


def clear_away():
    """Let them raise KeyboardInterrupt from here on, its argument the signal, where at_once() was called before."""
    for number in SIGNALS:
        if signal.getsignal(number) is _end:
            signal.signal(number, _raise)


def _end(number, _):
    os.write(2, b"nimray: stopped.\n")
    os._exit(128 + number)


def _raise(number, _):
    raise KeyboardInterrupt(number)
