# SPDX-License-Identifier: GPL-3.0-or-later
"""Negative-Index Materials: light bent the wrong way, rendered with Cycles by the physics."""

from .base.version import VERSION as __version__  # noqa: F401

_commands = []


def register():
    """Called by Blender when the extension is enabled: adds the panels, and `blender --command nimray`."""
    import bpy

    from . import command, ui

    ui.register()
    _commands.append(bpy.utils.register_cli_command("nimray", command.main))


def unregister():
    """Called by Blender when the extension is disabled."""
    import bpy

    from . import ui

    while _commands:
        bpy.utils.unregister_cli_command(_commands.pop())
    ui.unregister()
