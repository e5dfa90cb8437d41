# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the command starts: `nimray ...` and `python -m nim_addon ...`."""

import os
import sys


def _end(number, _=None):
    os.write(2, b"nimray: stopped.\n")
    os._exit(128 + number)


def script():
    """Run the command and end the process; where numpy is missing, without which there is nothing to run, say so."""
    try:
        import signal

        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, _end)  # until there is more to it
    except KeyboardInterrupt:  # which is heard first of all, as 2
        _end(2)
    from .base import signals, streams

    streams.prepare()
    signals.watch()
    try:
        from . import command
    except ModuleNotFoundError as error:
        if error.name != "numpy":
            raise
        sys.exit(
            "nimray: it needs numpy, which this Python does not have; in the project's folder run python3 build.py ..., "
            "or pip install . to have nimray here."
        )
    command.script()


if __name__ == "__main__":
    script()
