# SPDX-License-Identifier: GPL-3.0-or-later
"""The other side of peer.Peer: a program that answers requests for renders. Standard library and numpy only."""

import contextlib
import json
import os
import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np


def answer(start):
    """Answer the requests on the standard input until it ends.

    start: function that gets ready and returns another, of the words of a request, the last a seed; that returns pixels
           (height, width, 3), and seconds on the clock and on the processors
    What else is written on the standard output goes to the standard error.
    """
    with _apart() as answers, tempfile.TemporaryDirectory() as folder:
        render = start()
        print("ready", file=answers, flush=True)
        for line in sys.stdin:
            *words, seed = line.split()
            pixels, clock, processors = render(*words, int(seed))
            file = Path(folder, "picture.npy")
            np.save(file, pixels)
            said = {"clock": clock, "processors": processors, "file": str(file)}
            print(json.dumps(said), file=answers, flush=True)


@contextlib.contextmanager
def _apart():
    sys.stdout.flush()
    with os.fdopen(os.dup(1), "w") as answers:
        os.dup2(2, 1)
        yield answers


def timed(action):
    """What action() returns, and the seconds that it took, on the clock and on all processors."""
    clock, processors = time.perf_counter(), _processor_seconds()
    result = action()
    return result, time.perf_counter() - clock, _processor_seconds() - processors


def _processor_seconds():
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime
