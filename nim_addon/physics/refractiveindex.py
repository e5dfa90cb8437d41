# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of the refractiveindex.info database: n and k as a formula or a table, read without a library for YAML.

The database, its format and its formulas: M. N. Polyanskiy, "Refractiveindex.info database of optical constants",
Scientific Data 11, 94 (2024). Of YAML only what those files have is read: DATA, a list of blocks with a type each.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .dispersion import Dispersion
from .spectra import Formula, Range, Spectrum, Table

SUFFIXES = (".yml", ".yaml")
# A file that is larger is a mistake: the largest of the database has 1 MB.
MOST_BYTES = 20_000_000
_COLUMNS = {"tabulated n": "n", "tabulated k": "k", "tabulated nk": "nk"}


def load(path: str | Path, name: str | None = None) -> Dispersion:
    """The medium of a file, called by its path unless a `name` is given.

    Raises ValueError, in one sentence, as curves() does, for gain, and for formulas and tables that do not hold 550 nm.
    """
    name = name or str(path)
    parts, source = curves(path, name)
    return Dispersion(n=parts["n"], k=parts.get("k", 0.0), name=name, source=source)


def curves(path: str | Path, name: str) -> tuple[dict[str, Spectrum], str]:
    """n, and k where it is there, of a file that sentences call `name`, and its references as plain text.

    Raises ValueError for a file that is not there or is none of these, that has no n, and for numbers that are not
    finite or that no medium has.
    """
    data, source = _sections(_text(Path(path)), name)
    parts: dict[str, Spectrum] = {}
    for block in _blocks(data, name):
        for key, spectrum in _spectra(block, name):
            if key in parts:
                raise ValueError(f"{name} gives {key} twice.")
            parts[key] = spectrum
    if "n" not in parts:
        raise ValueError(f"{name} gives no n, only {', '.join(parts) or 'nothing'}; a medium needs it.")
    return parts, source


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > MOST_BYTES:
            raise ValueError(
                f"{path} is larger than {MOST_BYTES // 1_000_000} MB, and no file of refractiveindex.info."
            )
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise ValueError(f"there is no file {str(path)!r}.") from None
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {(error.strerror or str(error)).rstrip('.')}.") from None
    except UnicodeDecodeError:
        raise ValueError(f"{path} is no text, and so no file of refractiveindex.info.") from None


def _sections(text: str, name: str) -> tuple[list[str], str]:
    """The lines of DATA, and the references as plain text."""
    sections, lines = {}, []
    for line in text.splitlines():
        if match := re.match(r"([A-Z_]+):", line):
            lines = sections.setdefault(match[1], [])
        elif line.strip() and not line.startswith("#"):
            lines.append(line)
    if not sections.get("DATA"):
        raise ValueError(f"{name} is no file of refractiveindex.info: it has no DATA.")
    references = re.sub(r"<[^>]*>", "", " ".join(map(str.strip, sections.get("REFERENCES", []))))
    return sections["DATA"], re.sub(r"\s+", " ", references).strip()


def _blocks(lines: list[str], name: str) -> Iterator[dict[str, list[str]]]:
    """The blocks of DATA: {key: its value, and the lines below it}."""
    block: dict[str, list[str]] = {}
    values: list[str] = []
    for line in lines:
        match = re.fullmatch(r"\s*(-?)\s*([a-z_]+)\s*:\s*(.*)", line)
        if match and match[1]:
            if block:
                yield block
            block = {}
        elif not block:
            raise ValueError(f"{name} is no file of refractiveindex.info: its DATA is no list of blocks with a type.")
        if match:
            value = match[3].strip().strip("'\"")
            values = block[match[2]] = [] if value in ("", "|") else [value]
        else:
            values.append(line)
    yield block


def _spectra(block: dict[str, list[str]], name: str) -> Iterator[tuple[str, Spectrum]]:
    """("n" or "k", the function) of a block."""
    (type_,) = block.get("type", [])[:1] or [""]
    if type_ in _COLUMNS:
        keys = _COLUMNS[type_]
        rows = _rows(block.get("data", []), 1 + len(keys), f"{type_!r} of {name}")
        for key, values in zip(keys, rows.T[1:], strict=True):
            if key == "k" and (values < 0).any():
                where = rows[values < 0][0, 0] * 1000
                raise ValueError(f"{name} has k below 0 at {where:g} nm: such a medium gives light (gain).")
            try:
                yield key, Table(np.round(rows.T[0] * 1000, 9), values)
            except ValueError as error:
                raise ValueError(f"{type_!r} of {name} is not understood: {error}") from None
        return
    match = re.fullmatch(r"formula (\d+)", type_)
    if not match:
        raise ValueError(
            f"{name} has a block of type {type_!r}; those understood are {', '.join(_COLUMNS)} and formula 1 to 9."
        )
    (coefficients,) = _rows(block.get("coefficients", []), 0, f"the coefficients of {name}")
    try:
        yield "n", Formula(int(match[1]), tuple(coefficients.tolist()), _range(block, name))
    except ValueError as error:
        raise ValueError(f"{type_!r} of {name} is not understood: {error}") from None


def _range(block: dict[str, list[str]], name: str) -> Range:
    """The wavelengths of a formula, nanometres."""
    lines = block.get("wavelength_range") or block.get("range", [])  # as older files call it
    ((least, most),) = _rows(lines, 2, f"the range of wavelengths of {name}") * 1000
    return round(float(least), 9), round(float(most), 9)


def _rows(lines: list[str], columns: int, what: str) -> NDArray:
    """Numbers (N, columns), of one row of any length if columns is 0."""
    rows = []
    for line in lines if columns else [" ".join(lines)]:
        try:
            row = [float(word) for word in line.split("#")[0].split()]
        except ValueError:
            row = []
        if not row or (columns and len(row) != columns) or not np.isfinite(row).all():
            count = f"{columns} finite numbers" if columns else "finite numbers"
            raise ValueError(f"{what} has a row that is not {count}: {line.strip()!r}.")
        rows.append(row)
    if not rows:
        raise ValueError(f"{what} is empty.")
    return np.array(rows)
