# SPDX-License-Identifier: GPL-3.0-or-later
"""`nimray figures`: figures of the thesis, rendered, and what it claims, measured in them."""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Iterable
from pathlib import Path

from ..base import records
from ..base.text import counted, in_any_case
from . import blender, words
from .report import FAILURE, Bar, at_terminal
from .words import UsageError


def add_to(commands: argparse._SubParsersAction) -> None:
    """Add the parser of the subcommand."""
    parser = words.add_parser(
        commands,
        "figures",
        run,
        "Render figures of the thesis and measure in them what it claims; without a number, list them.",
        "examples:\n"
        "  nimray figures\n"
        "  nimray figures 5.4 5.6 --out figures\n"
        "  nimray figures --all --quality final --out figures\n\n"
        "DIR/index.html shows each figure beside its claims. What is there already, and was made of the same, is not\n"
        "rendered again. Exit code 1 if a claim fails.",
    )
    parser.add_argument("numbers", nargs="*", metavar="NUMBER", help="of the figure, such as 5.4")
    parser.add_argument("--all", action="store_true", help="every figure")
    parser.add_argument(
        "--out", type=words.folder, default="figures", metavar="DIR", help="folder to write to (figures)"
    )
    parser.add_argument(
        "--quality", choices=("draft", "final"), default="draft", help="draft (minutes) or final (large, clean)"
    )
    words.add_backend(parser)
    form = parser.add_mutually_exclusive_group()
    words.add_json(form)
    form.add_argument("--quiet", action="store_true", help="print the verdicts only")


def run(arguments: argparse.Namespace) -> int:
    """Make the figures, or list them; returns the exit code, FAILURE where a claim does not hold."""
    blender.load()
    from ..figures.registry import FIGURES, figure

    if arguments.all and arguments.numbers:
        raise UsageError("give either numbers of figures, or --all.")
    # each once, however often it is named
    numbers = dict.fromkeys(in_any_case(number, FIGURES) for number in arguments.numbers)
    try:
        chosen = list(FIGURES.values()) if arguments.all else [figure(number) for number in numbers]
    except ValueError as error:
        raise UsageError(str(error)) from None
    if not chosen:
        _list(FIGURES.values(), arguments.json)
        return 0
    from ..figures.run import make

    def showing(name: str, samples: int) -> contextlib.AbstractContextManager:
        return Bar(name) if at_terminal(arguments) else contextlib.nullcontext()

    done = []
    for recipe in chosen:
        record = make(recipe, arguments.out, arguments.quality, backend=arguments.backend, showing=showing)
        done.append(record)
        if not arguments.json:
            _print(record, arguments)
    if arguments.json:
        print(records.text(done))
    failed = [record["figure"] for record in done if not record["holds"]]
    if len(done) > 1 and not arguments.json:
        verdict = f"FAIL: figures {', '.join(failed)}" if failed else f"PASS: {len(done)} figures"
        print(f"{verdict}; see {Path(arguments.out) / 'index.html'}")
    return FAILURE if failed else 0


def _list(figures: Iterable, as_json: bool) -> None:
    if as_json:
        listed = [
            {"figure": figure.number, "title": figure.title, "shows": figure.shows, "must_hold": figure.must_hold}
            for figure in figures
        ]
        print(records.text(listed))
        return
    for figure in figures:
        print(f"{figure.number}: {figure.title}")
        for sentence in figure.must_hold:
            print(f"  - {sentence}")
    print("\nRender and measure with: nimray figures NUMBER ... --out DIR, or --all.")


def _print(record: dict, arguments: argparse.Namespace) -> None:
    from ..figures.claims import Claim

    if not arguments.quiet:
        print(f"{record['figure']} {record['title']}")
    for claim in record["claims"]:
        if not (arguments.quiet and claim["holds"]):
            print("  " + Claim(*(claim[field] for field in Claim._fields)).row())
    failed = sum(not claim["holds"] for claim in record["claims"])
    verdict = f"FAIL: {failed} of" if failed else "PASS"
    where = Path(arguments.out) / record["picture"]
    print(
        f"{verdict} figure {record['figure']}, {counted(len(record['claims']), 'claim')}, {record['seconds']:.0f} s: {where}",
        flush=True,
    )
