# SPDX-License-Identifier: GPL-3.0-or-later
"""Words that come from elsewhere, made fit for a terminal or for the name of a file."""

NOT_IN_A_NAME = '/\\:*?"<>|'  # on one system or another


def printable(text: object) -> str:
    """The text with escapes, such as \\x1b, for all that is neither seen nor a plain space."""
    return "".join(letter if letter.isprintable() else letter.encode("unicode_escape").decode() for letter in str(text))


def fit(name: str) -> str:
    """What of a name can be in the name of a file on every system."""
    return "".join(letter for letter in name if letter.isprintable() and letter not in NOT_IN_A_NAME)


def duration(seconds: float) -> str:
    """Seconds as a person reads them: 1:30, or 3 h 44 min."""
    minutes, seconds = divmod(round(seconds), 60)
    return f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{minutes}:{seconds:02}"
