# SPDX-License-Identifier: GPL-3.0-or-later
"""The wrong settings that cycles.checks finds, each with the button that mends it."""

CLASSES = ()


def register():
    """Add what is no class."""


def unregister():
    """Take it back."""
