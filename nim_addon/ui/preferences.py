# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's preferences, and the check of this Blender."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from ..base import options
from ..cycles import verify, versions

PACKAGE = __package__.rpartition(".")[0]
BACKENDS = (
    ("auto", "Automatic", "OSL where this Blender and the render device have it, else Blender's own nodes", "NONE", 0),
    ("osl", "OSL", "The closure written in the Open Shading Language", "NONE", 1),
    ("nodes", "Nodes", "The same optics in Blender's own nodes, for builds and devices without OSL", "NONE", 2),
)
DEFAULTS = {"backend": "auto", "samples": 128, "folder": ""}


class NIM_AP_preferences(bpy.types.AddonPreferences):
    """What holds for every file."""

    bl_idname = PACKAGE

    backend: bpy.props.EnumProperty(
        name="Backend",
        description="What new materials and scenes are made of",
        items=BACKENDS,
        default=DEFAULTS["backend"],
    )
    samples: bpy.props.IntProperty(
        name="Samples",
        description="Paths a pixel of new scenes",
        min=1,
        soft_max=4096,
        max=options.MOST_SAMPLES,
        default=DEFAULTS["samples"],
    )
    folder: bpy.props.StringProperty(
        name="Renders",
        description="Folder for headless renders; empty: renders beside the file, or in the home folder before it is saved",
        subtype="DIR_PATH",
        default=DEFAULTS["folder"],
    )

    def draw(self, context):
        layout = self.layout
        column = layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        column.row().prop(self, "backend", expand=True)
        column.prop(self, "samples")
        column.prop(self, "folder")

        from . import assets

        row = layout.row()
        row.operator("nim.unregister_assets" if assets.library() else "nim.register_assets", icon="ASSET_MANAGER")
        if versions.outdated():
            row.operator("nim.update_file", icon="FILE_REFRESH")
        row.operator("nim.check_blender", icon="CHECKMARK")
        _draw_check(layout)


def settings():
    """The add-on's preferences; where it is registered without being enabled, their defaults."""
    addon = bpy.context.preferences.addons.get(PACKAGE)
    return addon.preferences if addon and addon.preferences else SimpleNamespace(**DEFAULTS)


# ------------------------------------------------------------------------------------------------ the check

# Run by a second Blender, so that this one stays free and its file untouched.
CHECK = """
import contextlib, io, json, sys
folder, package, target = {words!r}
sys.path.insert(0, folder)
import bpy, importlib
command, verify = (importlib.import_module(package + name) for name in (".command", ".cycles.verify"))
text = io.StringIO()
with contextlib.redirect_stdout(text):
    command.main(["doctor", "--json"])
answer = dict(doctor=json.loads(text.getvalue()), verify=verify.summary(verify.verify(short=True), "auto"))
with open(target, "w", encoding="utf-8") as file:
    json.dump(answer, file)
"""


class _Check:
    """The check that runs, or the one that ran last in this session."""

    def __init__(self):
        self.process = None
        self.folder = None
        self.answer = None  # what doctor and verify said
        self.error = None  # or why they said nothing

    @property
    def running(self):
        return self.process is not None

    def start(self):
        """Start the second Blender; raises OSError."""
        self.answer = self.error = None
        self.folder = tempfile.TemporaryDirectory()
        package = Path(__file__).resolve().parents[1]
        words = (str(package.parent), package.name, str(self._target()))
        script = CHECK.format(words=words)
        if bpy.app.binary_path:
            command = [bpy.app.binary_path, "--background", "--factory-startup", "--python-expr", script]
        else:  # Blender as a Python module
            command = [sys.executable, "-c", script]
        # what it leaves in the folder for temporary files where it is stopped goes with ours
        environment = os.environ | dict.fromkeys(("TMPDIR", "TEMP", "TMP"), self.folder.name)
        with self._log().open("wb") as log:
            self.process = subprocess.Popen(
                command,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            )

    def _target(self):
        return Path(self.folder.name, "answer.json")

    def _log(self):
        return Path(self.folder.name, "log.txt")

    def finish(self):
        """Read what the second Blender found, once it has ended."""
        self.process.wait()
        try:
            self.answer = json.loads(self._target().read_text(encoding="utf-8"))
        except (OSError, ValueError):
            lines = self._log().read_text(encoding="utf-8", errors="replace").split("\n")
            nothing = rpt_("exit code {code}").format(code=self.process.returncode)
            self.error = next((line.strip() for line in reversed(lines) if "Error" in line), nothing)
        self._clean_up()

    def stop(self):
        """End the second Blender, if there is one."""
        if self.process:
            self.process.kill()
            self.process.wait()
            self._clean_up()

    def _clean_up(self):
        self.process = None
        if self.folder:  # none where the computer has no folder for temporary files
            self.folder.cleanup()


check = _Check()


def _poll_check():
    """A timer while the check runs: draw the preferences anew at its end."""
    if not check.running:
        return None
    if check.process.poll() is None:
        return 0.2
    check.finish()
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
            check.error = str(error)
            check._clean_up()
            self.report({"ERROR"}, rpt_("A second Blender could not be started: {reason}").format(reason=error))
            return {"CANCELLED"}
        if not bpy.app.background:
            bpy.app.timers.register(_poll_check, first_interval=0.2, persistent=True)
            return {"FINISHED"}
        check.finish()
        if check.error:
            self.report({"ERROR"}, rpt_("The check did not run: {reason}").format(reason=check.error))
            return {"CANCELLED"}
        self.report({"INFO"}, verdict(check.answer["verify"]))
        return {"FINISHED"}


def verdict(summary):
    """PASS or FAIL with the counts: one line from what verify.summary() says."""
    checks = summary["checks"]
    failed = sum(not one["passed"] for one in checks)
    if failed:
        return iface_("FAIL: {failed} of {all} measurements differ from the equations").format(
            failed=failed, all=len(checks)
        )
    return iface_("PASS: {all} measurements agree with the equations").format(all=len(checks))


def worst(summary):
    """The measurement that lies farthest from its equation, in terms of what is allowed: one line."""

    def share(one):
        # a mean of random paths may lie some standard errors away, a landing point within a fixed tolerance
        if one["z"] is not None:
            return abs(one["z"]) / verify.SIGMAS
        return abs(one["measured"] - one["equation"]) / one["error"]

    one = max(summary["checks"], key=share)
    what = iface_("landing point") if one["what"] == "landing" else iface_("reflectance")
    return iface_(
        "{what} from {incident} to {transmitted} at {angle:g}°: {measured:.4f} measured, "
        "{equation:.4f} by the equation, {share:.0%} of the deviation allowed"
    ).format(**{**one, "what": what, "share": share(one)})


def _draw_check(layout):
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
            ("Materials use", iface_(options.BACKEND_NAMES[summary["backend"]])),
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


CLASSES = (NIM_AP_preferences, NIM_OT_check_blender)


def register():
    """Nothing more than the classes."""


def unregister():
    """End the second Blender if one still runs."""
    if bpy.app.timers.is_registered(_poll_check):
        bpy.app.timers.unregister(_poll_check)
    check.stop()
    check.answer = check.error = None
