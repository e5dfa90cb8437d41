# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's preferences, and the check of this Blender."""

CLASSES = ()


def register():
    """Add what is no class."""


def unregister():
    """Take it back."""
