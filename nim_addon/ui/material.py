# SPDX-License-Identifier: GPL-3.0-or-later
"""The Negative Index panel: the media of both sides of an interface, and what they mean, live."""

CLASSES = ()


def register():
    """Add what is no class."""


def unregister():
    """Take it back."""
