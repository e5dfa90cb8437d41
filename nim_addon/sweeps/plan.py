# SPDX-License-Identifier: GPL-3.0-or-later
"""The plan of a sweep: its tasks, each a render by itself, and the file that holds them, a line of JSON for each.

The file is all that whoever carries the plan out needs. It may be written, or changed, by hand: what a task is called comes
from what it renders, so that a line that was changed is another task, and one that was not is the same.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ..base import records
from ..base.files import whole
from ..base.text import counted, in_any_case
from ..figures import quantities  # whose probes a plan may have
from ..renders.asked import known
from ..renders.request import Request, digest
from ..scenes import SCENES, scene_type
from . import PLAN

# What of a render may be varied beside its scene's own parameters, and what each value is read as.
OPTIONS = {
    "samples": int,
    "seed": int,
    "photons": int,
    "frame": int,
    "wavelength": float,
    "backend": str,
    "caustics": str,
}


@dataclass(frozen=True)
class Task:
    """One render of a sweep, or a part of its samples.

    request: what is rendered
    values:  what is varied, as texts by its names
    part:    (first, count) of the request's samples; None: all of them
    probe:   whether it is only measured, and no picture of the sweep
    blender: version that the plan is for; None: the one that is here
    """

    request: Request
    values: Mapping[str, str] = field(default_factory=dict, hash=False)
    part: tuple[int, int] | None = None
    probe: bool = False
    blender: str | None = field(default=None, compare=False)

    @functools.cached_property
    def image(self) -> str:
        """What its image is called, in all its parts: a hash of all that decides the pixels but for the Blender."""
        content = self.request.content()
        del content["blender"]  # of which machines may have others, as will be said
        return digest(content)[:32]

    @property
    def key(self) -> str:
        """What it is called."""
        return f"{self.image}-{self.part[0]}-{self.part[1]}" if self.part else self.image

    @property
    def title(self) -> str:
        """What it shows, for a person."""
        name = ", ".join(f"{name} = {value}" for name, value in self.values.items()) or self.request.name
        part = f", samples {self.part[0] + 1} to {sum(self.part)}" if self.part else ""
        return f"{name}{part}{' (probe)' * self.probe}"

    def record(self) -> dict:
        """A dict of JSON-ready values that of() takes back."""
        part = {"part": list(self.part)} if self.part else {}
        probe = {"probe": True} if self.probe else {}
        request = self.request.record()
        if self.blender:
            request["blender"] = self.blender
        return {"key": self.key, "values": dict(self.values), **part, **probe, "request": request}

    @classmethod
    def of(cls, record: Mapping[str, object], source: str = "the task") -> Task:
        """The task of a record(); ValueError, one sentence that names the source, for what is none."""
        request, values, part = (record.get(name) for name in ("request", "values", "part"))
        if not isinstance(request, dict) or not isinstance(values, dict):
            raise ValueError(f"{source} is no task; it has values and a request, both tables.")
        if strange := set(record) - {"key", "values", "part", "probe", "request"}:
            raise ValueError(f"{source} has {', '.join(sorted(strange))}, which no task has.")
        asked = Request.from_record(request, source)
        texts = {name: str(value) for name, value in values.items()}
        try:
            "".join([*texts, *texts.values()]).encode()
        except UnicodeError:
            raise ValueError(f"{source} has values that are no Unicode; write others.") from None
        probe, blender = bool(record.get("probe", False)), str(request["blender"])
        return cls(asked, texts, _part(part, asked, source), probe, blender)


def _part(part, request, source):
    if part is None:
        return None
    whole_numbers = isinstance(part, list) and len(part) == 2 and all(type(number) is int for number in part)
    if not whole_numbers or not 0 <= part[0] < part[0] + part[1] <= known(request.samples):
        raise ValueError(
            f"{source} has part = {part!r}; give the first sample, from 0, and how many, within {request.samples}."
        )
    return tuple(part)


# ------------------------------------------------------------------------------------------------ made of points


def task_at(point: Mapping[str, str], base: Callable[[Mapping[str, str]], Request]) -> Task:
    """The task of a point of a sweep; ValueError, one sentence, where it is none.

    base: the request for a point's values of the scene's own parameters; what else it has are OPTIONS of the render
    """
    varied = {}
    for key in OPTIONS.keys() & point.keys():
        try:
            varied[key] = OPTIONS[key](point[key])
        except ValueError:
            raise ValueError(f"{key} = {point[key]!r} is not a {'whole ' * (OPTIONS[key] is int)}number.") from None
    request = base({key: value for key, value in point.items() if key not in OPTIONS})
    return Task(dataclasses.replace(request, **varied), point)


def settings_of(scene: str, values: Mapping[str, str]) -> dict[str, str]:
    """The settings of a scene for the values of a point: n, and mu where it is none of its own, are those of its liquid."""
    fields = dataclasses.fields(scene_type(in_any_case(scene, SCENES)).parameters)
    names = {field.name for field in fields}
    liquids = [field.name for field in fields if field.metadata["kind"] == "liquid"]
    settings = dict(values)
    if "n" in settings and "n" not in names and len(liquids) == 1:
        own = f",mu={settings.pop('mu')}" if "mu" in settings and "mu" not in names else ""
        settings[liquids[0]] = f"n={settings.pop('n')}{own}"
    return settings


def split(task: Task, parts: int) -> list[Task]:
    """The task as so many parts of its samples, as equal as can be.

    One that is spectral has all wavelengths in each of them. Raises ValueError, one sentence, where it has fewer samples.
    """
    samples = known(task.request.samples)
    if not 1 <= parts <= samples:
        raise ValueError(
            f"--split {parts} parts {counted(samples, 'sample')}; give a whole number from 1 to {samples}."
        )
    ends = [samples * place // parts for place in range(parts + 1)]
    request = dataclasses.replace(task.request, spectral_passes=1) if task.request.spectral else task.request
    return [Task(request, task.values, (first, end - first)) for first, end in itertools.pairwise(ends)]


def pictures(tasks: Iterable[Task]) -> list[Task]:
    """The pictures of a plan, each once, whatever it is parted into, without what is only measured."""
    return list({task.image: Task(task.request, task.values) for task in tasks if not task.probe}.values())


def probes(tasks: Iterable[Task], names: Iterable[str]) -> list[Task]:
    """What is to be rendered beside the pictures of a plan for quantities of those names, each once.

    Raises ValueError, one sentence, for a name of none, and for one that a picture does not have.
    """
    found = {}
    for picture in pictures(tasks):
        for name in names:
            request = quantities.quantity(name).probe(picture.request)
            if request is not picture.request:
                task = Task(request, picture.values, probe=True)
                found[task.image] = task
    return list(found.values())


# ------------------------------------------------------------------------------------------------ its file


def write(folder: str | Path, tasks: Iterable[Task]) -> Path:
    """Write the plan of these tasks to a folder; returns the file. What it replaces is kept as plan.former.jsonl."""
    file = Path(folder).expanduser() / PLAN
    text = "".join(json.dumps(task.record()) + "\n" for task in tasks)

    def save(part: Path) -> None:
        part.write_text(text, encoding="utf-8")

    if file.is_file():
        former = file.read_bytes()
        if former == text.encode():
            return file
        whole(file.with_name("plan.former.jsonl"), lambda part: part.write_bytes(former))
    return whole(file, save)


def lines(file: str | Path) -> Iterator[tuple[str, str]]:
    """The lines of a plan's file that are not empty, each with what sentences call it; OSError where it cannot be read."""
    name = Path(file).name
    with open(file, encoding="utf-8-sig") as stream:  # as some editors mark it
        try:
            for number, line in enumerate(stream, 1):
                if line.strip():
                    yield f"line {number} of {name}", line
        except UnicodeDecodeError:
            raise ValueError(f"{name} is no plan: it is not text in UTF-8.") from None


def read(file: str | Path) -> list[Task]:
    """The tasks of a plan's file.

    Raises OSError where it cannot be read, ValueError, one sentence that names the line, for what is none, and for a
    plan that is empty or has a task twice.
    """
    tasks = [task_of(line, source) for source, line in lines(file)]
    check(tasks, Path(file).name)
    return tasks


def task_of(line: str, source: str) -> Task:
    """The task of a line of a plan; ValueError, one sentence that names the source, for what is none."""
    try:
        record = records.parse(line)
    except ValueError:
        raise ValueError(f"{source} is no task: it is no table in JSON.") from None
    return Task.of(record, source)


def check(tasks: Sequence[Task], source: str = "the plan") -> None:
    """Raise ValueError, one sentence, for a plan that is empty, or has a task twice."""
    if not tasks:
        raise ValueError(f"{source} is empty; there is nothing to render.")
    seen: dict[str, int] = {}
    for place, task in enumerate(tasks, 1):
        if (first := seen.setdefault(task.key, place)) != place:
            raise ValueError(f"{source} has the same render twice, as tasks {first} and {place} ({task.title}).")
