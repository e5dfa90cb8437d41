# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of earlier versions, brought up to date as they are opened."""

CLASSES = ()


def register():
    """Add what is no class."""


def unregister():
    """Take it back."""
