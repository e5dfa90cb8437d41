# SPDX-License-Identifier: GPL-3.0-or-later
"""`nimray scenes`: the scenes and their parameters."""

from __future__ import annotations

import argparse
import dataclasses

from ..base import records
from . import blender
from .words import add_json, add_parser


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add the parser of the subcommand."""
    add_json(add_parser(commands, "scenes", run, "List the scenes and their parameters."))


def run(arguments: argparse.Namespace) -> None:
    """Print them."""
    blender.load()
    from ..scenes import SCENES

    listed = [
        {
            "name": scene_type.name,
            "shows": scene_type.shows,
            "parameters": [
                {
                    "key": field.name,
                    "description": field.metadata["description"],
                    "allowed": _allowed(field),
                    "default": _default(field),
                }
                for field in dataclasses.fields(scene_type.parameters)
            ],
        }
        for scene_type in SCENES.values()
    ]
    if arguments.json:
        print(records.text(listed))
        return
    for scene in listed:
        print(f"{scene['name']}: {scene['shows']}")
        for parameter in scene["parameters"]:
            about = f"({parameter['allowed']}; default {parameter['default']})"
            print(f"  {parameter['key']:<12} {parameter['description']} {about}")
        print()
    print("Render one with: nimray render SCENE --set KEY=VALUE ...")


def _allowed(field: dataclasses.Field) -> str:
    data = field.metadata
    if data["kind"] in ("number", "integer"):
        return f"{data['low']:g} to {data['high']:g}{' ' + data['unit'] if data.get('unit') else ''}"
    if data["kind"] == "index":
        return f"{data['low']:g} to {data['high']:g}, or a medium"
    if data["kind"] == "switch":
        return "yes or no"
    if data["kind"] == "liquid":
        return "none, an index, or a medium"
    if data["kind"] == "mesh":
        return ", ".join(data["choices"]) + ", or a PLY, OBJ or STL file"
    return ", ".join(data["choices"])


def _default(field: dataclasses.Field) -> str:
    value = field.default
    if isinstance(value, bool):
        return "yes" if value else "no"
    if value is None:
        return "none" if field.metadata["kind"] == "liquid" else "auto"
    return str(value)
