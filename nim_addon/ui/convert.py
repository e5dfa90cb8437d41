# SPDX-License-Identifier: GPL-3.0-or-later
"""Any mesh made a NIM in one click, and taken back."""

CLASSES = ()


def register():
    """Add what is no class."""


def unregister():
    """Take it back."""
