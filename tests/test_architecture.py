# SPDX-License-Identifier: GPL-3.0-or-later
"""The house of ARCHITECTURE.md: which room may import which, that nothing imports in a circle, and how long things are."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# Each room may import those before it; command and ui are imported by nim_addon/__init__.py and __main__.py alone.
ROOMS = ("base", "physics", "cycles", "caustics", "checks", "scenes", "renders", "figures", "sweeps")
TOPS = ("command", "ui")
LONGEST_FUNCTION, LONGEST_MODULE = 60, 450
# Longer functions, {file: names}: the flat list of a node tree or of a parser, which gains nothing by being cut.
FLAT = {"nim_addon/cycles/closures/interface.py": ["_twin"]}


def modules():
    """{name within nim_addon, such as "physics.rays", "" of the package itself: (file, what it is parsed to)}."""
    found = {}
    for file in sorted((ROOT / "nim_addon").rglob("*.py")):
        parts = file.relative_to(ROOT / "nim_addon").with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        found[name] = file, ast.parse(file.read_text(encoding="utf-8"))
    return found


MODULES = modules()


def imported(name):
    """The modules of nim_addon that one of them imports anywhere in it, within functions too."""
    file, tree = MODULES[name]
    package = name.split(".") if file.name == "__init__.py" and name else name.split(".")[:-1]
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = package[: len(package) - node.level + 1] + (node.module.split(".") if node.module else [])
            for alias in node.names:
                whole = ".".join([*base, alias.name])
                yield whole if whole in MODULES else ".".join(base)


GRAPH = {name: set(imported(name)) - {name} for name in MODULES}


def room(name):
    return name.split(".")[0]


def test_every_folder_is_a_room_and_the_paper_knows_each():
    folders = {room(name) for name in MODULES if "." in name}
    assert folders == {*ROOMS, *TOPS}
    paper = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    table = paper[paper.index("| room |") : paper.index("Beside them")]
    rows = re.findall(r"^\| `(\w+)` \| (.*?) \|", table, re.MULTILINE)
    assert [room for room, _ in rows] == [*ROOMS, *TOPS]
    told = [f"{room}.{name}" for room, text in rows for name in re.findall(r"`(\w+)`", text)]
    assert not set(told) - set(MODULES), "a row names modules of its room"


def test_imports_go_one_way():
    wrong = [
        f"{name} imports {other}"
        for name, others in GRAPH.items()
        for other in sorted(others)
        if room(name) in ROOMS
        and room(other) != room(name)
        and (room(other) not in ROOMS or ROOMS.index(room(other)) > ROOMS.index(room(name)))
    ]
    assert not wrong


def test_only_the_package_itself_imports_the_command_and_the_user_interface():
    importers = {room(name) for name, others in GRAPH.items() for other in others if room(other) in TOPS}
    assert importers <= {"", "__main__", *TOPS}
    crossing = [(name, other) for name in GRAPH for other in GRAPH[name] if {room(name), room(other)} == set(TOPS)]
    assert not crossing


def test_nothing_imports_in_a_circle():
    left = dict(GRAPH)
    while free := [name for name, others in left.items() if not others & left.keys()]:
        for name in free:
            del left[name]
    assert not left, "what imports each other in a circle, or what does so"


@pytest.mark.parametrize("name", [name for name in MODULES if room(name) in ("base", "physics")])
def test_physics_and_base_know_nothing_of_blender(name):
    nodes = list(ast.walk(MODULES[name][1]))
    names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    names |= {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom) and not node.level}
    assert not names & {"bpy", "bmesh", "mathutils", "gpu"}


def sources():
    """The Python files of this repository."""
    folders = ("nim_addon", "tests", "bench", "blend_scenes", "docs", "tools")
    return [*ROOT.glob("*.py"), *(file for folder in folders for file in sorted((ROOT / folder).rglob("*.py")))]


def is_private(name):
    return name.startswith("_") and not name.startswith("__")


def private(tree):
    """The underscored names that a parsed file takes of modules of ours that it imports."""
    ours = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.level or (node.module or "").startswith("nim_addon")):
            ours |= {alias.asname or alias.name for alias in node.names}
            yield from (alias.name for alias in node.names if is_private(alias.name))
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in ours:
            of_module = node.value.id.islower()  # rather than of a class
            yield from [f"{node.value.id}.{node.attr}"] if of_module and is_private(node.attr) else []


def test_nobody_takes_the_private_names_of_another():
    taken = {
        str(file.relative_to(ROOT)): sorted(names)
        for file in sources()
        if (names := set(private(ast.parse(file.read_text(encoding="utf-8")))))
    }
    assert not taken


def test_functions_and_modules_are_short():
    long = []
    for file in sources():
        path, text = file.relative_to(ROOT).as_posix(), file.read_text(encoding="utf-8")
        if text.count("\n") > LONGEST_MODULE:
            long.append(f"{path}: {text.count(chr(10))} lines")
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef) and node.name not in FLAT.get(path, ()):
                lines = node.end_lineno - node.lineno + 1
                if lines > LONGEST_FUNCTION:
                    long.append(f"{path}: {node.name}, {lines} lines")
    assert not long
