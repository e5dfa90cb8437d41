# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes panel: choose, set, build, and the line that renders the same headlessly."""

CLASSES = ()


def register():
    """Add what is no class."""


def unregister():
    """Take it back."""
