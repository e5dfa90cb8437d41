# SPDX-License-Identifier: GPL-3.0-or-later
"""Signals: at Ctrl-C, a kill or a closed terminal the process ends at once, and leaves nothing half made behind."""

from __future__ import annotations

import atexit
import contextlib
import os
import re
import shutil
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NoReturn

SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT") if hasattr(signal, name))
PATIENCE = 5  # seconds that the end waits for files to get their names

_clean_ups: list[Callable[[], None]] = []  # what takes away what is half made
_atomic = threading.RLock()
_end_watch: Callable[[], None] | None = None  # while the signals are watched


def watch() -> Callable[[], None] | None:
    """From here on let those signals end the process at once; returns what ends the watch, or None where it goes on.

    A thread of its own hears them, as Python's handlers wait for the end of what runs in C: an import of Blender or
    numpy, which swallow exceptions besides, or a render. Not watched are other threads than the main one, which may not
    ask for it, and a Blender with a window, which has its own ways.
    """
    global _end_watch
    blender = sys.modules.get("bpy")
    background = blender is None or blender.app.background
    if _end_watch or not background or threading.current_thread() is not threading.main_thread():
        return None
    ours, theirs = socket.socketpair()
    theirs.setblocking(False)
    # nohup has the end of the terminal ignored
    heard = [number for number in SIGNALS if number != getattr(signal, "SIGHUP", None) or not _ignored(number)]
    handlers = {number: signal.signal(number, _hear) for number in heard}
    wakeup = signal.set_wakeup_fd(theirs.fileno(), warn_on_full_buffer=False)

    def listen():
        for number in iter(lambda: ours.recv(1), b""):
            if number[0] in handlers and signal.getsignal(number[0]) is _hear:  # not where another took it over
                _stop(number[0])

    listener = threading.Thread(target=listen, daemon=True)
    listener.start()

    def end():
        global _end_watch
        signal.set_wakeup_fd(wakeup)
        for number, handler in handlers.items():
            # None: a handler of Blender's own, in C, which Python cannot put back
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        theirs.close()  # the listener reads the end of the stream and ends
        listener.join()
        ours.close()
        _end_watch = None

    _end_watch = end
    return end


def _hear(*_):
    """Nothing: the listener hears it too."""


def watched() -> bool:
    """Whether watch() is in force."""
    return _end_watch is not None


@contextlib.contextmanager
def importing_blender() -> Iterator[None]:
    """Around the import of Blender as a module, which takes Ctrl-C for itself: watch() hears it all the same."""
    if not watched() or "bpy" in sys.modules:
        yield
        return
    blocks = hasattr(signal, "sigwait")  # not on Windows
    if blocks:
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        threading.Thread(target=lambda: _stop(signal.sigwait({signal.SIGINT})), daemon=True).start()
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, _hear)
        if blocks:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def _ignored(number):
    return signal.getsignal(number) is signal.SIG_IGN


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Within, those signals end the process at once, as watch() has it."""
    end = watch()
    try:
        yield
    finally:
        if end:
            end()


@contextlib.contextmanager
def cleaned_up(clean_up: Callable[[], None]) -> Iterator[None]:
    """Call `clean_up` at the end of the block, or where those signals end the process within it."""
    with atomic():
        _clean_ups.append(clean_up)
    try:
        yield
    finally:
        with atomic():
            clean_up()
            _clean_ups.remove(clean_up)


def atomic() -> contextlib.AbstractContextManager:
    """A context for a short step of which there is no half: the end of the process waits for it."""
    return _atomic


def leave(code: int) -> NoReturn:
    """End the process with that exit code, without Blender's noise about memory that it still holds."""
    if "bpy" not in sys.modules:
        atexit._run_exitfuncs()  # matplotlib's folder, where there is no home; Blender's own make the noise
    _clear_away()
    os._exit(code)


def _stop(number):
    _atomic.acquire(timeout=PATIENCE)  # for good: nothing is begun any more
    _clear_away()
    with contextlib.suppress(OSError):  # nobody listens any more
        os.write(2, b"\n" * os.isatty(2) + b"nimray: stopped.\n")
    os._exit(128 + number)


def _clear_away():
    for clean_up in reversed(_clean_ups):
        with contextlib.suppress(Exception):
            clean_up()
    # Blender takes its own away only where it ends by itself
    folder = Path(getattr(getattr(sys.modules.get("bpy"), "app", None), "tempdir", ""))
    if re.fullmatch(r"blender_\w{6}", folder.name):
        remove(folder)


def remove(folder: Path) -> None:
    """Take a folder away with all that is in it, also while another thread still writes into it."""
    with contextlib.suppress(OSError):
        # under a name that the other does not know
        folder = folder.rename(folder.with_name(f"{folder.name}.gone"))
    for wait in (0, 0.01, 0.1):
        time.sleep(wait)
        shutil.rmtree(folder, ignore_errors=True)
        if not folder.exists():
            return
