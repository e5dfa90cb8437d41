# SPDX-License-Identifier: GPL-3.0-or-later
"""`nimray info`: what made an image."""

from __future__ import annotations

import argparse

from ..base import records
from ..base.text import printable
from . import blender
from .words import UsageError, add_json, add_parser


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add the parser of the subcommand."""
    parser = add_parser(commands, "info", run, "Show what made an image.")
    parser.add_argument("file", metavar="FILE", help="an EXR or PNG written by nimray")
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    """Print the record that an image carries."""
    blender.load()
    from ..cycles.images import read_metadata

    try:
        record = read_metadata(arguments.file)
    except (ValueError, FileNotFoundError) as error:
        raise UsageError(str(error)) from None
    if arguments.json:
        print(records.text(record))
        return
    for key, value in record.items():
        if isinstance(value, dict):
            value = ", ".join(f"{k}={'none' if v is None else v}" for k, v in value.items())
        elif isinstance(value, list):
            value = (" x " if key == "size" else ", ").join(map(str, value))
        print(printable(f"{key:<12} {value}"))
