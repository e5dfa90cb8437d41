# SPDX-License-Identifier: GPL-3.0-or-later
"""The JSON that our files carry, read as it must be where anybody may have written it."""

from __future__ import annotations

import json
import math

DEEPEST = 16  # dicts and lists in each other


def parse(text: str) -> dict:
    """The dict that a JSON text holds; ValueError where it holds none, or one too deep to be written again."""
    try:
        record = json.loads(text)
    except RecursionError:
        raise ValueError("too deep") from None
    if not isinstance(record, dict):
        raise ValueError("no dict")
    level: list = [record]
    for _ in range(DEEPEST):
        level = [inner for value in level for inner in (value.values() if isinstance(value, dict) else value)]
        level = [value for value in level if isinstance(value, (dict, list))]
    if level:
        raise ValueError("too deep")
    return record


def text(value: object) -> str:
    """A JSON-ready value as JSON to print, in ASCII without control characters; null for a number that is not finite."""
    return json.dumps(_finite(value), indent=2).replace("\x7f", "\\u007f")


def _finite(value):
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
