# SPDX-License-Identifier: GPL-3.0-or-later
"""NIM for Blender: negative-index materials, rendered with Cycles by the physics."""

__version__ = "0.1.0"


def register():
    """Called by Blender when the extension is enabled."""


def unregister():
    """Called by Blender when the extension is disabled."""
