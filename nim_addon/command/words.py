# SPDX-License-Identifier: GPL-3.0-or-later
"""What a person writes after `nimray`, and its readers, which argparse calls: each raises UsageError, in one sentence."""

from __future__ import annotations

import argparse
import os
import re
from collections.abc import Callable, Mapping, Sequence
from typing import NoReturn

from ..base import shipped
from ..base.options import BACKENDS, LARGEST_SIDE, LAST_FRAME, MOST_WAVELENGTHS, SCENE_NAMES
from ..base.text import fit
from ..physics import Medium
from ..physics.media import to_number
from ..physics.spectra import wavelengths
from ..sweeps.axes import BETWEEN, apart

A_SCENE = f"{', '.join(SCENE_NAMES[:-1])} or {SCENE_NAMES[-1]}"
LONGEST_NAME = 200  # bytes, of the 255 that file systems take: what is half written has a longer one

Size = tuple[int, int]  # width and height, pixels


class UsageError(Exception):
    """What was asked for makes no sense: exit code 2."""


class _Once:
    """For an argparse.Action that keeps one value: its option is refused where it is given again, as the first were lost."""

    option_strings: Sequence[str]
    _seen: argparse.Namespace | None = None

    def __call__(self, parser, namespace, values, option_string=None) -> None:
        if self._seen is namespace:
            raise UsageError(f"{' and '.join(self.option_strings)} is given twice; give it once.")
        self._seen = namespace
        super().__call__(parser, namespace, values, option_string)  # pyright: ignore[reportAttributeAccessIssue]


class Stored(_Once, argparse._StoreAction):
    """An option, or a word, with a value."""


class Switched(_Once, argparse.BooleanOptionalAction):
    """--NAME or --no-NAME."""


class Parser(argparse.ArgumentParser):
    """Of the command, or of one of its subcommands, which each refuse themselves what they do not know."""

    commands: Mapping[str, Parser] = {}  # those of the subcommands, by name

    def __init__(self, *words, **more) -> None:
        super().__init__(*words, **more)
        for kind in (None, "store"):
            self.register("action", kind, Stored)
        # what is a value though it begins as an option does; argparse's own knows neither -1. nor -1e-3
        self._negative_number_matcher = re.compile(r"-(\.?\d|inf|nan)", re.IGNORECASE)

    def parse_known_args(self, *words) -> tuple[argparse.Namespace, list[str]]:
        """As argparse has it, but what is not known is refused here, where the subcommand is known."""
        found, unknown = super().parse_known_args(*words)
        if hasattr(found, "assignments"):  # which --set may stand before, or not
            found.assignments = [*found.assignments, *filter(_is_assignment, unknown)]
            unknown = [word for word in unknown if not _is_assignment(word)]
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return found, unknown

    def error(self, message: str) -> NoReturn:
        """Refuse the words: UsageError."""
        raise UsageError(f"{message}. Try `{self.prog} --help`.")


def _is_assignment(word):
    return re.match(r"\w+=", word)


def add_parser(
    commands: argparse._SubParsersAction,
    name: str,
    run: Callable[[argparse.Namespace], int | None],
    summary: str,
    epilog: str | None = None,
) -> Parser:
    """Add the parser of a subcommand, which `run` runs with the parsed arguments; returns it.

    Its help names the page that tells of it, where that is at hand.
    """
    address = shipped.page(f"command-line#{name}")
    epilog = "\n\n".join(filter(None, (epilog, address and f"More: {address}")))
    parser = commands.add_parser(
        name,
        help=summary,
        description=summary,
        epilog=epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(run=run)
    return parser


def add_backend(parser: argparse.ArgumentParser) -> None:
    """Add --backend, of what is measured."""
    parser.add_argument("--backend", choices=BACKENDS, default="auto", help="OSL, or Blender's own nodes")


def add_json(parser: argparse._ActionsContainer) -> None:
    """Add --json to a parser, or to a group of options that exclude each other."""
    parser.add_argument("--json", action="store_true", help="for programs")


# ------------------------------------------------------------------------------------------------ readers


def medium(text: str) -> Medium:
    """A medium of its name or of its numbers."""
    try:
        return Medium.parse(text)
    except ValueError as error:
        raise UsageError(str(error)) from None


def size(text: str) -> Callable[[Size], Size]:
    """A function that turns a scene's own size into the one of a text such as 800x600 or 50%."""
    if text.endswith("%"):
        part = whole("--size", 1, 100, "%")(text)
        return lambda own: (max(1, round(own[0] * part / 100)), max(1, round(own[1] * part / 100)))
    words = text.lower().split("x")
    if len(words) != 2 or not all(word.isdecimal() for word in words):
        raise UsageError(f"--size {text!r} is not a size; write it like 800x600 or 50%.")
    width, height = map(int, words)
    if not (1 <= width <= LARGEST_SIDE and 1 <= height <= LARGEST_SIDE):
        raise UsageError(f"--size {text} is out of range; each side lies between 1 and {LARGEST_SIDE} pixels.")
    return lambda own: (width, height)


def whole(option: str, low: int, high: int, unit: str = "") -> Callable[[str], int]:
    """A reader of whole numbers from `low` to `high`, written with or without their unit."""

    def read(text: str) -> int:
        try:
            value = to_number(text.removesuffix(unit), int)
        except ValueError:
            raise UsageError(f"{option} {text!r} is not a whole number.") from None
        if not low <= value <= high:
            raise UsageError(f"{option} {text} is out of range; it lies between {low}{unit} and {high}{unit}.")
        return value

    return read


def number(option: str) -> Callable[[str], float]:
    """A reader of numbers."""

    def read(text: str) -> float:
        try:
            return to_number(text)
        except ValueError:
            raise UsageError(f"{option} {text!r} is not a number.") from None

    return read


def stack(text: str) -> list[float]:
    """Wavelengths, nanometres, of a text such as 400:700:10, the last with them, or 450,550,650."""
    form = "write it like 400:700:10, from, to and step in nanometres, or like 450,550,650"
    parts = text.split(":") if ":" in text else text.split(",")
    try:
        numbers = [to_number(part) for part in parts]
    except ValueError:
        raise UsageError(f"--wavelengths {text!r} is not understood; {form}.") from None
    if ":" not in text:
        return numbers
    if len(numbers) != 3:
        raise UsageError(f"--wavelengths {text!r} is not understood; {form}.")
    first, last, step = numbers
    if not step > 0:
        raise UsageError(f"--wavelengths {text!r} has a step that is not above 0; {form}.")
    if first > last:
        raise UsageError(f"--wavelengths {text!r} runs backwards; write it like {last:g}:{first:g}:{step:g}.")
    if not (last - first) / step < MOST_WAVELENGTHS:
        raise UsageError(f"--wavelengths {text!r} has more than {MOST_WAVELENGTHS} wavelengths; take a larger step.")
    return [first + step * index for index in range(int((last - first) / step + 1e-9) + 1)]


def region(text: str) -> tuple[int, ...]:
    """x, y, width and height of a text such as 10,20,4,3, or x and y alone, of one pixel."""
    words = text.split(",")
    if len(words) not in (2, 4) or not all(word.strip().isdecimal() for word in words):
        raise UsageError(
            f"{text!r} is no part of a picture; write --pixel 10,20 (x, y from the top left) or --region 10,20,4,3 (with "
            "width and height)."
        )
    return tuple(map(int, words))


def frames(text: str) -> tuple[int, int]:
    """First and last frame of a text such as 1-48, or 12."""
    words = text.split("-")
    if len(words) > 2 or not all(word.isdecimal() for word in words):
        raise UsageError(
            f"--frames {text!r} is not a range of frames from 0 on; write it like 1-48, or 12 for one frame."
        )
    first, last = int(words[0]), int(words[-1])
    if max(first, last) > LAST_FRAME:
        raise UsageError(f"--frames {text} is out of range; frames lie between 0 and {LAST_FRAME}.")
    if first > last:
        raise UsageError(f"--frames {text} runs backwards; write it like {last}-{first}.")
    return first, last


def rate(text: str) -> float:
    """Frames a second."""
    value = number("--fps")(text)
    if not 0.01 <= value <= 1000:
        raise UsageError(f"--fps {text} is out of range; it lies between 0.01 and 1000.")
    return value


def name(text: str) -> str:
    """The name of a file, without its suffix."""
    if len(os.fsencode(text)) > LONGEST_NAME:
        raise UsageError(f"--name of {len(text)} letters is too long for a file; use at most {LONGEST_NAME}.")
    if not text or text in (".", "..") or fit(text) != text or text[0] in "- " or text[-1] in ". ":
        raise UsageError(f"--name {text!r} cannot name a file; use letters, digits, dots and dashes.")
    return text


def own_name(text: str) -> str:
    """The same for a name that nobody gave: files get it of what was asked for."""
    try:
        return name(text)
    except UsageError:
        raise UsageError(f"no file can be named {text!r}, after all that is set; give --name.") from None


def folder(text: str) -> str:
    """What is written to."""
    if not text:
        raise UsageError("--out is empty; name what to write to, or leave it out.")
    return text


def wavelength(text: str) -> float:
    """A vacuum wavelength, nanometres."""
    value = number("--wavelength")(text)
    try:
        return float(wavelengths(value))
    except ValueError as error:
        raise UsageError(str(error)) from None


def variants(words: Sequence[str], liquids: Sequence[str]) -> list[list[str]]:
    """The settings of each variant, lists of texts "key=value", from words such as "liquid=none,n=-1.33,mu=-10".

    liquids: the keys whose values are media, to which a mu= among them belongs; elsewhere mu is a parameter of its own
             where a number comes before it
    """
    settings = []
    for word in words:
        key, equals, values = word.partition("=")
        if not equals:
            raise UsageError(f"--vary {word!r} is not understood; write KEY=A,B,C.")
        settings += [apart(key, value, liquids) for value in BETWEEN.split(values)]
    if len(settings) < 2:
        raise UsageError(f"--vary {' '.join(words)} is one image; give at least two values, KEY=A,B.")
    return settings
