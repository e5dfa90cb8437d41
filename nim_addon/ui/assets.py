# SPDX-License-Identifier: GPL-3.0-or-later
"""The asset library, registered by one click."""

CLASSES = ()


def register():
    """Add what is no class."""


def unregister():
    """Take it back."""
