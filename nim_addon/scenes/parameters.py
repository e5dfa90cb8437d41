# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameters of a scene: fields of a frozen dataclass that carry description, range or choices, read from text."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np

from ..base.text import fit, in_any_case, unknown
from ..physics import MEDIA, Medium
from ..physics.media import plain_minus, to_number
from ..physics.refractiveindex import SUFFIXES


# A field has any type: what a dataclass takes from it is its default.
def number(default: float | None, description: str, low: float, high: float, unit: str = "") -> Any:
    """A field that holds a float in [low, high]; `default` None means "chosen from the other parameters"."""
    return dataclasses.field(
        default=default,
        metadata={"kind": "number", "description": description, "low": low, "high": high, "unit": unit},
    )


def integer(default: int, description: str, low: int, high: int) -> Any:
    """A field that holds an int in [low, high]."""
    return dataclasses.field(
        default=default, metadata={"kind": "integer", "description": description, "low": low, "high": high}
    )


def switch(default: bool, description: str) -> Any:
    """A field that holds a bool."""
    return dataclasses.field(default=default, metadata={"kind": "switch", "description": description})


def choice(default: str, description: str, choices: Mapping[str, str]) -> Any:
    """A field that holds one of `choices`, {word: what it means}; new ones come last, as Blender files hold their number."""
    return dataclasses.field(
        default=default,
        metadata={"kind": "choice", "description": description, "choices": tuple(choices), "meanings": dict(choices)},
    )


def liquid(default: Medium | None, description: str) -> Any:
    """A field that holds None, or the Medium that fills a vessel."""
    return dataclasses.field(default=default, metadata={"kind": "liquid", "description": description})


def index(default: float, description: str, low: float, high: float) -> Any:
    """A field that holds a real refractive index, a float, or the Medium of anything else that a person names.

    low, high: of the real part of n
    """
    return dataclasses.field(
        default=default,
        metadata={"kind": "index", "description": description, "low": low, "high": high, "unit": ""},
    )


def mesh_file(default: str, description: str, words: Mapping[str, str]) -> Any:
    """A field that holds one of `words`, {word: what it means}, or the path of a mesh file (PLY, OBJ or STL)."""
    return dataclasses.field(
        default=default,
        metadata={"kind": "mesh", "description": description, "choices": tuple(words), "meanings": dict(words)},
    )


@dataclasses.dataclass(frozen=True)
class Parameters:
    """Base of every scene's parameter dataclass: construction checks each value against its field.

    Values may be given as text, as on the command line. Raises ValueError, one sentence, for a value out of its range.
    """

    def __post_init__(self):
        for field in dataclasses.fields(self):
            object.__setattr__(self, field.name, _checked(field, getattr(self, field.name)))

    @classmethod
    def read(cls, assignments: Iterable[str]) -> Self:
        """An instance from texts "key=value"; ValueError names the keys that exist, the nearest first."""
        return cls.of(cls.assigned(assignments))

    @classmethod
    def assigned(cls, assignments: Iterable[str]) -> dict[str, str]:
        """The values of texts "key=value" by their keys, whatever these are; ValueError for a text that is none, and for two
        of one key."""
        values = {}
        for text in assignments:
            key, equals, value = text.partition("=")
            if not equals:
                first = dataclasses.fields(cls)[0].name
                raise ValueError(f"{text!r} is not a setting; write key=value, such as {first}=...")
            if key.strip() in values:
                raise ValueError(f"{key.strip()} is set twice; set it once.")
            values[key.strip()] = value.strip()
        return values

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> Self:
        """An instance from a dict, such as plain() gives; ValueError names the keys that exist, the nearest first."""
        names = [field.name for field in dataclasses.fields(cls)]
        for key in values:
            if key not in names:
                raise ValueError(unknown("parameter", key, names))
        return cls(**values)

    def plain(self) -> dict[str, Any]:
        """A dict of JSON-ready values that of() takes back."""
        values = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        return {key: str(value) if isinstance(value, Medium) else value for key, value in values.items()}

    def files(self) -> dict[str, Path]:
        """The files that they name, of meshes and of media, by the fields that do."""
        named = {}
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if field.metadata["kind"] == "mesh" and value not in field.metadata["choices"]:
                named[field.name] = Path(value)
            elif isinstance(value, Medium) and (path := value.file) is not None:
                named[field.name] = path
        return named

    def assignments(self) -> list[str]:
        """The fewest texts "key=value" that read() makes these parameters of; a list."""
        names = [field.name for field in dataclasses.fields(self)]
        texts = {name: f"{name}={written(getattr(self, name))}" for name in names}
        for key in list(texts):
            others = [text for other, text in texts.items() if other != key]
            try:
                if type(self).read(others) == self:
                    del texts[key]
            except ValueError:  # this one needs its key
                pass
        return list(texts.values())


def file_name(scene: str, assignments: Iterable[str]) -> str:
    """The name, without suffix, of the files that a scene's render with these texts "key=value" goes to."""
    settings = []
    for text in assignments:
        key, _, value = text.partition("=")
        # a file's path is no part of a file's name
        settings.append(f"{key.strip()}-{Path(value.strip()).stem if '/' in value else value.strip()}")
    return plain_minus(fit("_".join([scene, *settings]))).replace(",", "_").replace("=", "").replace(" ", "")


def written(value: float | str | Medium | None) -> str:
    """A value of a parameter as a person writes it: "yes", "water", "none", "1.5"."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Medium):
        return next((name for name, medium in MEDIA.items() if medium == value), str(value))
    return "none" if value is None else str(value).removesuffix(".0")


def switched(name: str, value: object) -> bool:
    """Whether a value, such as "yes", "off" or True, is on; ValueError where it is neither."""
    words = ("true", "yes", "on", "1"), ("false", "no", "off", "0")
    word = str(value).lower()
    if word not in words[0] + words[1]:
        raise ValueError(f"{name} = {value!r} is neither on nor off.")
    return word in words[0]


def _checked(field, value):
    kind, name = field.metadata["kind"], field.name
    if value is None or (isinstance(value, str) and value.lower() in ("none", "auto") and field.default is None):
        if field.default is None or kind == "liquid":
            return None
        raise ValueError(f"{name} needs a value.")
    if kind in ("number", "integer"):
        return _number(field, value)
    if kind == "switch":
        return switched(name, value)
    if kind == "liquid":
        return None if str(value).lower() in ("none", "empty") else _medium(value)
    if kind == "index":
        return _index(field, value)
    choices = field.metadata["choices"]
    if (word := in_any_case(str(value), choices)) in choices:
        return word
    if kind == "choice":
        raise ValueError(unknown(name, str(value), choices))
    return _mesh_path(name, str(value), choices)


def _number(field, value):
    name, low, high = field.name, field.metadata["low"], field.metadata["high"]
    whole = field.metadata["kind"] == "integer"
    unit = f" {field.metadata['unit']}" if field.metadata.get("unit") else ""
    type_ = int if whole else float
    try:
        if isinstance(value, bool) or np.iscomplexobj(value):  # numpy's complex numbers would lose a part
            raise TypeError
        number = to_number(value, type_) if isinstance(value, str) else type_(value)
        if whole and not isinstance(value, str) and number != float(value):
            raise ValueError
    except (OverflowError, TypeError, ValueError):
        raise ValueError(f"{name} = {value!r} is not a {'whole ' if whole else ''}number.") from None
    if not math.isfinite(number) or not low <= number <= high:
        raise ValueError(f"{name} = {value} is out of range; it lies between {low:g} and {high:g}{unit}.")
    return number


def _index(field, value):
    if isinstance(value, Medium) or (isinstance(value, str) and not _is_number(value)):
        medium = _medium(value)
    elif np.iscomplexobj(value):
        medium = Medium(value)
    else:
        return _number(field, value)
    _number(field, medium.n)
    return medium


def _is_number(text):
    try:
        to_number(text)
    except ValueError:
        return False
    return True


def _medium(value):
    """The Medium that a person wrote; one of a file is called by the whole of its path."""
    text = str(value).strip()
    if text.lower().endswith(SUFFIXES):
        with contextlib.suppress(OSError, RuntimeError):  # a name that is too long, a person who has no home here
            path = Path(text).expanduser()
            text = str(path.resolve()) if path.is_file() else text
    return Medium.parse(text)


def _mesh_path(name, value, words):
    path = Path(value)
    allowed = f"give one of {', '.join(words)}, or a PLY, OBJ or STL file"
    if path.suffix.lower() not in (".ply", ".obj", ".stl"):
        raise ValueError(f"{name} = {value!r} is not understood; {allowed}.")
    try:
        path = path.expanduser()
        if path.is_file():
            return str(path.resolve())
    except (OSError, RuntimeError):  # a name that is too long, a person who has no home here
        pass
    raise ValueError(f"{name}: there is no file {value!r}; {allowed}.")
