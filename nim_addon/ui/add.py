# SPDX-License-Identifier: GPL-3.0-or-later
"""What the Add menus gain: the interface node with ready media, and small NIM objects."""

CLASSES = ()


def register():
    """Add what is no class."""


def unregister():
    """Take it back."""
