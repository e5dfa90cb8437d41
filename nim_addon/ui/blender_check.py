# SPDX-License-Identifier: GPL-3.0-or-later
"""The check of this Blender: a second one measures whether it obeys the equations."""

from __future__ import annotations

import json
import subprocess
import tempfile
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from ..base.options import BACKEND_NAMES
from ..base.processes import second_blender
from ..cycles import verify
from .help import fail

MODULE = "command.check"  # what the second Blender runs, so that this one stays free and its file untouched
INTERVAL = 0.2  # seconds between two looks at it


class Check:
    """The check that runs, or the one that ran last in this session."""

    def __init__(self) -> None:
        self.process: subprocess.Popen[str] | None = None
        self.folder: tempfile.TemporaryDirectory | None = None
        self.answer: dict | None = None  # what doctor and verify said
        self.error: str | None = None  # or why they said nothing

    @property
    def running(self) -> bool:
        """Whether it is under way."""
        return self.process is not None

    def start(self) -> None:
        """Start the second Blender; raises OSError, which is then the `error`, too."""
        self.answer = self.error = None
        try:
            self.folder = tempfile.TemporaryDirectory()
            # what it leaves in the folder for temporary files where it is stopped goes with ours
            environment = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), self.folder.name)
            with self._log().open("wb") as log:
                self.process = second_blender(
                    MODULE,
                    [str(self._target())],
                    binary=bpy.app.binary_path,
                    stdout=log,
                    environment=environment,
                )
        except OSError as error:
            self.error = str(error)
            self._clean_up()
            raise

    def _target(self):
        return Path(self.folder.name, "answer.json")

    def _log(self):
        return Path(self.folder.name, "log.txt")

    def look(self) -> bool:
        """See whether it has ended; returns `running`."""
        if self.process and self.process.poll() is not None:
            self.finish()
        return self.running

    def finish(self) -> None:
        """Wait for the second Blender, and read what it found."""
        if not self.process:
            return
        code = self.process.wait()
        try:
            self.answer = json.loads(self._target().read_text(encoding="utf-8"))
        except (OSError, ValueError):
            lines = self._log().read_text(encoding="utf-8", errors="replace").split("\n")
            nothing = rpt_("exit code {code}").format(code=code)
            self.error = next((line.strip() for line in reversed(lines) if "Error" in line), nothing)
        self._clean_up()

    def stop(self) -> None:
        """End the second Blender, if there is one."""
        if self.process:
            self.process.kill()
            self.process.wait()
            self._clean_up()

    def _clean_up(self):
        if self.process and self.process.stdin:
            self.process.stdin.close()
        self.process = None
        if self.folder:  # none where the computer has no folder for temporary files
            self.folder.cleanup()
            self.folder = None


check = Check()


def _poll_check():
    """A timer while the check runs: draw the preferences anew at its end."""
    if check.look():
        return INTERVAL
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "PREFERENCES":
                area.tag_redraw()
    return None


class NIM_OT_check_blender(bpy.types.Operator):
    """See what this Blender has, and measure in a second one without a window whether it obeys the equations (seconds)"""

    bl_idname = "nim.check_blender"
    bl_label = "Check This Blender"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        if check.running:
            cls.poll_message_set("The check is running")
            return False
        return True

    def execute(self, context):
        try:
            check.start()
        except OSError as error:
            return fail(self, rpt_("A second Blender could not be started: {reason}").format(reason=error))
        if not bpy.app.background:
            bpy.app.timers.register(_poll_check, first_interval=INTERVAL, persistent=True)
            return {"FINISHED"}
        check.finish()
        if check.answer is None:
            return fail(self, rpt_("The check did not run: {reason}").format(reason=check.error))
        self.report({"INFO"}, verdict(check.answer["verify"]))
        return {"FINISHED"}


def verdict(summary: dict) -> str:
    """PASS or FAIL with the counts: one line from what verify.summary() says."""
    measurements = summary["checks"]
    failed = sum(not measurement["passed"] for measurement in measurements)
    if failed:
        return iface_("FAIL: {failed} of {all} measurements differ from the equations").format(
            failed=failed, all=len(measurements)
        )
    return iface_("PASS: {all} measurements agree with the equations").format(all=len(measurements))


def worst(summary: dict) -> str:
    """The measurement that lies farthest from its equation, in terms of what is allowed: one line."""

    def share(measurement):
        # a mean of random paths may lie some standard errors away, a landing point within a fixed tolerance
        if measurement["z"] is not None:
            return abs(measurement["z"]) / verify.SIGMAS
        return abs(measurement["measured"] - measurement["equation"]) / measurement["error"]

    farthest = max(summary["checks"], key=share)
    what = iface_("landing point") if farthest["what"] == "landing" else iface_("reflectance")
    return iface_(
        "{what} from {incident} to {transmitted} at {angle:g}°: {measured:.4f} measured, "
        "{equation:.4f} by the equation, {share:.0%} of the deviation allowed"
    ).format(**{**farthest, "what": what, "share": share(farthest)})


def draw(layout: bpy.types.UILayout) -> None:
    """What the check has found, or why it found nothing."""
    if check.running:
        layout.label(text="Measuring in a second Blender, some seconds...", icon="TIME")
    elif check.error:
        layout.label(text=iface_("The check did not run: {reason}").format(reason=check.error), icon="ERROR")
    elif check.answer:
        doctor, summary = check.answer["doctor"], check.answer["verify"]
        box = layout.box()
        box.label(text=verdict(summary), icon="CHECKMARK" if summary["passed"] else "CANCEL")
        yes = {True: iface_("yes"), False: iface_("no")}
        rows = (
            ("Blender", doctor["blender"]),
            ("OSL", yes[doctor["osl"]]),
            ("Materials use", iface_(BACKEND_NAMES[summary["backend"]])),
            ("Denoiser", yes[doctor["denoiser"]]),
            ("Devices", ", ".join(doctor["devices"])),
            ("Worst deviation", worst(summary)),
        )
        split = box.split(factor=0.25)
        names, values = split.column(align=True), split.column(align=True)
        for name, value in rows:
            names.label(text=name)
            values.label(text=value, translate=False)
        for problem in doctor["problems"]:
            box.label(text=problem, icon="ERROR", translate=False)


CLASSES = (NIM_OT_check_blender,)


def register() -> None:
    """Nothing more than the classes."""


def unregister() -> None:
    """End the second Blender if one still runs, and forget what it found."""
    if bpy.app.timers.is_registered(_poll_check):
        bpy.app.timers.unregister(_poll_check)
    check.stop()
    check.answer = check.error = None
