# SPDX-License-Identifier: GPL-3.0-or-later
"""Words that come from elsewhere, made fit for a terminal or for the name of a file."""

NOT_IN_A_NAME = '/\\:*?"<>|'  # on one system or another


def printable(text) -> str:
    """The text with escapes, such as \\x1b, for all that is neither seen nor a plain space."""
    return "".join(one if one.isprintable() else one.encode("unicode_escape").decode() for one in str(text))


def fit(name) -> str:
    """What of a name can be in the name of a file on every system."""
    return "".join(one for one in name if one.isprintable() and one not in NOT_IN_A_NAME)
