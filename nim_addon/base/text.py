# SPDX-License-Identifier: GPL-3.0-or-later
"""Words that come from elsewhere: made fit for a terminal or the name of a file, and found among those that are known."""

import difflib
from collections.abc import Collection, Iterable

NOT_IN_A_NAME = '/\\:*?"<>|'  # on one system or another


def printable(text: object) -> str:
    """The text with escapes, such as \\x1b, for all that is neither seen nor a plain space."""
    return "".join(letter if letter.isprintable() else letter.encode("unicode_escape").decode() for letter in str(text))


def fit(name: str) -> str:
    """What of a name can be in the name of a file on every system."""
    return "".join(letter for letter in name if letter.isprintable() and letter not in NOT_IN_A_NAME)


def listed(names: Iterable[str], most: int = 3) -> str:
    """Names in a sentence: "Floor, Wall, Table...", where there are more than are named."""
    names = list(names)
    return ", ".join(names[:most]) + ("..." if len(names) > most else "")


def counted(count: int, thing: str) -> str:
    """So many things, "1 sample" or "2 samples", in words of a sentence."""
    return f"{count} {thing}" + "s" * (count != 1)


def in_any_case(word: str, known: Iterable[str]) -> str:
    """The one of the `known` names that a person's `word` is, whatever its case; else the word."""
    return next((name for name in known if name.lower() == word.lower()), word)


def nearest(word: str, known: Iterable[str]) -> str | None:
    """The one of the `known` names that a person may have meant by a `word`, or None."""
    folded = {name.lower(): name for name in known}
    near = difflib.get_close_matches(word.lower(), folded, 1, 0.5)
    return folded[near[0]] if near else None


def unknown(sort: str, word: str, known: Collection[str]) -> str:
    """The sentence for a `word` that is no name of that sort, as the `known` ones are, with the nearest of them."""
    near = nearest(word, known)
    hint = f"did you mean {near}? The" if near else "the"
    return f"there is no {sort} {word!r}; {hint} ones that exist are {', '.join(known)}."


def said_by(error: BaseException) -> str:
    """What an error says, in one line; its name where it says nothing, as a time that is over or a connection that is closed."""
    return " ".join(str(error).split()) or type(error).__name__


def duration(seconds: float) -> str:
    """Seconds as a person reads them: 1:30, or 3 h 44 min."""
    minutes, seconds = divmod(round(seconds), 60)
    return f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{minutes}:{seconds:02}"
