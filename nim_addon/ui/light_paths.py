# SPDX-License-Identifier: GPL-3.0-or-later
"""Light paths: rays through the interfaces of a scene, drawn as curves."""

CLASSES = ()


def register():
    """Add what is no class."""


def unregister():
    """Take it back."""
