# SPDX-License-Identifier: GPL-3.0-or-later
"""A render in a second Blender without a window, while this one stays free."""

CLASSES = ()


def register():
    """Add what is no class."""


def unregister():
    """Take it back."""
