# SPDX-License-Identifier: GPL-3.0-or-later
"""What the subcommands that render share: a request with their options, its render, and how it is refused."""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from ..base.text import printable
from .report import Output, note
from .words import UsageError

if TYPE_CHECKING:
    from ..renders.request import Rendered, Request, Session


def with_options(request: Request, arguments: argparse.Namespace) -> Request:
    """A request with the options of add_options() that were given; ValueError for what no render has."""
    keys = ("samples", "seed", "backend", "denoise", "caustics", "photons", "spectral", "spectral_passes", "wavelength")
    given = {key: getattr(arguments, key) for key in keys if getattr(arguments, key) is not None}
    if arguments.size:
        given["size"] = arguments.size(request.size or request.decided().size)
    if given.get("caustics") == "path":
        given.setdefault("photons", None)
    if {"samples", "spectral"} & given.keys():
        given.setdefault("spectral_passes", None)  # of an image that is repeated: as suits what is other now
    if given.get("spectral"):
        given.setdefault("wavelength", None)
    return dataclasses.replace(request, **given)


def carry_out(
    request: Request,
    folder: str,
    name: str,
    output: Output,
    *,
    keep: bool = False,
    blend: bool = False,
    made_with: str | None = None,
    before: Callable[[Session], None] | None = None,
) -> Rendered:
    """Render a request, of an image that was `made_with` that Blender; `keep` and `blend` as Session.render() has them.

    before: what looks at its session, a renders.session.Session, before it is rendered
    """
    from bpy.app import version_string

    from ..renders.session import Session

    def showing(name, samples):
        if made_with not in (None, version_string) and not output.quiet:
            note(f"made with Blender {printable(made_with)}, repeated with {version_string}.")
        return output.showing(name, samples)

    with refused(), Session(request) as session:
        if before:
            before(session)
        rendered = session.render(folder, name, keep=keep, blend=blend, showing=showing, tracing=output.tracing)
    if rendered.was_there and not output.quiet:
        note(f"{rendered.exr} is there already.")
    return rendered


@contextlib.contextmanager
def refused() -> Iterator[None]:
    """Say in the words of the command what makes no sense in a request."""
    from ..renders.request import NoPhotons, NotTraced

    try:
        yield
    except NoPhotons:
        raise UsageError("--photons goes with --caustics traced.") from None
    except NotTraced as error:
        raise UsageError(f"--caustics traced: {error}") from None
    except ValueError as error:
        raise UsageError(str(error)) from None
