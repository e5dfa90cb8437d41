# SPDX-License-Identifier: GPL-3.0-or-later
"""The JSON that our files carry, read as it must be where anybody may have written it."""

import json
import math

DEEPEST = 16  # dicts and lists in each other


def parse(text, nan=False) -> dict:
    """The dict that a JSON text holds; `nan`: with numbers that are not finite, which Python writes.

    Raises ValueError where it holds none, or what cannot be written again.
    """
    try:
        record = json.loads(text, parse_constant=None if nan else _refuse, parse_float=None if nan else _finite)
    except RecursionError:
        raise ValueError("too deep") from None
    if not isinstance(record, dict):
        raise ValueError("no dict")
    level = [record]
    for _ in range(DEEPEST):
        level = [value for one in level for value in (one.values() if isinstance(one, dict) else one)]
        level = [value for value in level if isinstance(value, (dict, list))]
    if level:
        raise ValueError("too deep")
    return record


def _refuse(word):
    raise ValueError(word)


def _finite(text):
    return number if math.isfinite(number := float(text)) else _refuse(text)


def text(value) -> str:
    """A JSON-ready value as JSON to print, in ASCII without control characters."""
    return json.dumps(value, indent=2).replace("\x7f", "\\u007f")
