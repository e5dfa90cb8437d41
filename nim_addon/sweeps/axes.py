# SPDX-License-Identifier: GPL-3.0-or-later
"""What a sweep varies: axes of a person's words, and the points that they span.

A point is a dict of texts by what is varied, such as {"n": "-1.5", "mu": "-10"}, as a scene's settings are written.
"""

from __future__ import annotations

import csv
import itertools
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import NamedTuple

MOST = 10_000_000  # points of a sweep, of which each is a line of its plan
FORM = "write it like n=-1.5:1.5:0.25, from, to and step, or like n=-1.5,1.5"
VALUES_FORM = "write them like -1.5, -1, 1.33, or like -1.5:1.5:0.25, from, to and step"
# Where values part: not within the brackets of a function, nor before what belongs to the medium that comes before it.
BETWEEN = re.compile(r",(?![^()]*\))(?!\s*(?:mu|k|length)\s*=)")
AN_OWN_MU = re.compile(r"([^=,()]+),\s*(mu\s*=[^,()]+)")


class Axis(NamedTuple):
    """What is varied, and the texts that it takes."""

    key: str
    values: tuple[str, ...]


def axis(text: str) -> Axis:
    """The Axis of a text such as "n=-1.5:1.5:0.25", the last with them, or "mu=-1,-10".

    Raises ValueError, one sentence, for a text that is none, and for a range that does not end.
    """
    key, equals, values = (part.strip() for part in text.partition("="))
    if not equals or not key or not values:
        raise ValueError(f"--vary {text!r} is not understood; {FORM}.")
    return Axis(key, values_of(values, f"--vary {text!r}", FORM))


def values_of(text: str, said: str = "", form: str = VALUES_FORM) -> tuple[str, ...]:
    """The values of a text such as "-1.5:1.5:0.25", the last with them, or "-1, -10".

    said: what the sentence of an error calls the text; form: how it says that the text is to be written
    Raises ValueError, one sentence, for a text that names none, or one twice, and for a range that does not end.
    """
    said = said or repr(text)
    if ":" in text and (numbers := _numbers(text)):
        return _range(said, form, numbers)
    found = tuple(value.strip() for value in BETWEEN.split(text))
    if "" in found:
        raise ValueError(f"{said} has an empty value; {form}.")
    if twice := next((value for value in found if found.count(value) > 1), None):
        raise ValueError(f"{said} names {twice} twice; name each value once.")
    return found


def apart(key: str, value: str, liquids: Sequence[str]) -> list[str]:
    """The settings, texts "key=value", of a value of BETWEEN: a mu behind a number is a parameter of its own.

    liquids: the keys whose values are media, to which a mu= among them belongs
    """
    parts = None if key in liquids else AN_OWN_MU.fullmatch(value)
    return [f"{key}={parts[1]}", parts[2]] if parts else [f"{key}={value}"]


def _numbers(text):
    """The three numbers of a range as it was written, exact; None where it is none, such as a drive's name in a path."""
    try:
        numbers = [Decimal(part.strip()) for part in text.split(":")]
    except InvalidOperation:
        return None
    return numbers if len(numbers) in (2, 3) else None


def _range(said, form, numbers):
    if len(numbers) == 2:
        raise ValueError(f"{said} has no step; {form}.")
    first, last, step = numbers
    if not all(number.is_finite() for number in numbers):
        raise ValueError(f"{said} never ends; {form}.")
    if step == 0:
        raise ValueError(f"{said} has a step of 0, so it never ends; {form}.")
    if first != last and (last - first) * step < 0:
        raise ValueError(f"{said} steps away from its end; give the step the other sign.")
    count = int((last - first) / step) + 1
    if count > MOST:
        raise ValueError(f"{said} has {count} values, more than {MOST}; take a larger step.")
    return tuple(_plain(first + step * place) for place in range(count))


def _plain(number):
    """A Decimal in plain digits, never 1E+1; a zero has no sign."""
    return f"{number.normalize():f}" if number else "0"


def count(axes: Sequence[Axis], *, together: bool = False) -> int:
    """How many points() axes span; ValueError as that."""
    if not together:
        return math.prod(len(values) for _, values in axes)
    lengths = {len(values) for _, values in axes}
    if len(lengths) > 1:
        told = ", ".join(f"{key} {len(values)}" for key, values in axes)
        raise ValueError(
            f"--zip takes one value of each at a time, so all need the same number of them; here are {told}."
        )
    return max(lengths, default=1)


def points(axes: Sequence[Axis], *, together: bool = False) -> Iterator[dict[str, str]]:
    """The points that axes span: each value of one with each of the others, the last running fastest.

    together: instead the first of each, then the second of each, and so on
    Raises ValueError, one sentence, for axes of one key, and for such of other lengths that go together.
    """
    keys = [key for key, _ in axes]
    if twice := next((key for key in keys if keys.count(key) > 1), None):
        raise ValueError(f"--vary names {twice} twice; give all its values at once, {twice}=A,B,C.")
    count(axes, together=together)
    rows = (
        zip(*(values for _, values in axes), strict=True) if together else itertools.product(*(a.values for a in axes))
    )
    return (dict(zip(keys, row, strict=True)) for row in rows)


def table(file: str | Path) -> list[dict[str, str]]:
    """The points of a CSV: what is varied in its first line, a point in each other one; an empty field leaves it as it is.

    Raises OSError where it cannot be read, ValueError, one sentence that names the line, for what is no such table.
    """
    try:
        path = Path(file).expanduser()
        if path.is_char_device():  # which may never end
            raise RuntimeError
        text = path.read_text(encoding="utf-8-sig")
    except (UnicodeDecodeError, RuntimeError):
        raise ValueError(f"{file} is no table of text; give a CSV file in UTF-8.") from None
    try:
        lines = [
            (reader.line_num, row) for reader in [csv.reader(text.splitlines(), strict=True)] for row in reader if row
        ]
    except csv.Error as error:
        raise ValueError(f"{file} is no CSV: {error}.") from None
    if len(lines) < 2:
        raise ValueError(
            f"{file} has no points; name in its first line what is varied, and give a line of values for each."
        )
    keys = [key.strip() for key in lines[0][1]]
    if "" in keys or len(set(keys)) < len(keys):
        raise ValueError(f"the first line of {file} names {', '.join(keys)}; name each column, and each once.")
    return [dict(_row(file, keys, number, row)) for number, row in lines[1:]]


def _row(file, keys, number, row) -> Iterable[tuple[str, str]]:
    if len(row) != len(keys):
        raise ValueError(f"line {number} of {file} has {len(row)} values for {len(keys)} columns.")
    return ((key, value.strip()) for key, value in zip(keys, row, strict=True) if value.strip())
