#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""For people: set up, render, test, make the scenes, the extension, the pages, a release. Standard library only.

  python3 build.py render sphere       any nimray command: render, compare, sweep, figures, rays, scenes, verify...
  python3 build.py test                run the tests (more words go to pytest)
  python3 build.py lint                check the style, by ruff, and the types, by pyright
  python3 build.py blends [sea...]     write blend_scenes/*.blend, the asset library (some minutes) and the groups of nodes that
                                       are shipped, or only what is named: glass, pool, sphere, sea, drop, prism, lens, ball,
                                       window; or assets, or closures
  python3 build.py package             build and validate dist/nim_addon-X.Y.Z.zip with Blender's own tool
  python3 build.py docs [--out DIR]    make the pages of docs/ as HTML, in dist/docs/ or DIR
  python3 build.py bench [glass|peers] print how fast it is, beside Blender's own Glass BSDF, Mitsuba 3 and POV-Ray
  python3 build.py bench waits         what a person waits for: a panel redrawn, a scene built, the command's first word
  python3 build.py bench scale         what scenes of 5 million triangles, or of 1,000 objects, cost
  python3 build.py bench laws          graded balls and windows of lenslets beside Glass, and beside shells of our interface
  python3 build.py bench caustics      the same of caustics, beside path tracing and Mitsuba 3 (hours; some minutes: --quick)
  python3 build.py bench spectrum      the same of media that disperse, beside stacks of wavelengths, Mitsuba 3 and LuxCore
  python3 build.py release X.Y.Z       give what is here that version, and the changelog too; check all; build the extension
  python3 build.py lock                write anew which packages --locked installs, the newest that fit, for all Blenders
  python3 build.py setup               make the environment only; every other command does so when needed

--blender 5.0 before or after the command picks another Blender: 4.2, 4.5 (the default) and 5.0 run on Python 3.11, 5.2
on 3.13. --system-packages, for root on Debian or Ubuntu, brings the shared libraries that Blender lacks on a bare server.
--locked makes the environment of exactly the packages that .ci/lock-*.txt name, for Linux on x86-64, as CI does.
"""

import datetime
import functools
import hashlib
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent
# The Python that each Blender's module is built for.
PYTHON = {"4.2": (3, 11), "4.5": (3, 11), "5.0": (3, 11), "5.2": (3, 13)}
DEFAULT = "4.5"
TESTED = ("figures", "many", "test", "docs")  # the extras that the tests need
NIMRAY = ("render", "compare", "sweep", "figures", "rays", "scenes", "verify", "fresnel", "doctor", "info")


def main(words):
    """Run one command; returns the exit code."""
    blender = DEFAULT
    if "--blender" in words:
        at = words.index("--blender")
        blender = words[at + 1] if at + 1 < len(words) else ""
        if blender not in PYTHON:
            return complain(f"--blender {blender or '(nothing)'}: choose one of {', '.join(PYTHON)}.")
        words = words[:at] + words[at + 2 :]
    bring, locked = "--system-packages" in words, "--locked" in words
    words = [word for word in words if word not in ("--system-packages", "--locked")]
    if not words or words[0] in ("-h", "--help", "help"):
        print(__doc__.strip())
        return 0 if words else 2
    command, rest = words[0], words[1:]
    known = {f.__name__: f for f in (setup, test, lint, blends, package, docs, bench, release, lock)}
    if command not in known and command not in NIMRAY:
        return complain(f"there is no command {command!r}; the ones that exist are {', '.join([*known, *NIMRAY])}.")
    try:
        if bring:
            install([])  # so that a refusal comes first
        python = environment(blender, bring, locked)
        if command in NIMRAY and not bring:  # most need no more than numpy, the others say themselves what they lack
            return nimray(python, command, *rest)
        if command != "docs":  # which needs no Blender
            complete(python, bring)
        return nimray(python, command, *rest) if command in NIMRAY else known[command](python, rest)
    except SetupError as error:
        return complain(str(error), error.code)
    except KeyboardInterrupt:
        return complain("stopped.", 130)


def complain(sentence, code=2):
    """Say what is wrong; returns the exit code."""
    print(f"build.py: {sentence}", file=sys.stderr)
    return code


def run(python, *words, where=ROOT):
    """Run the environment's Python; returns its exit code. `where` None stays in the caller's folder."""
    child = subprocess.Popen([str(python), *map(str, words)], cwd=where, env=settings())
    try:
        code = child.wait()
    except KeyboardInterrupt:  # the child has the same Ctrl-C, and ends once it has cleared away what it began
        child.wait()
        raise
    return code if code >= 0 else 128 - code


def nimray(python, *words):
    """Become the command, so that Ctrl-C and a kill reach it; on Windows, which cannot, run it: returns its exit code."""
    words = ("-m", "nim_addon", *words)
    if os.name == "nt":
        return run(python, *words, where=None)
    sys.stdout.flush()
    os.execve(python, [str(python), *words], settings())


def settings():
    """The environment variables of what is run: it finds the project."""
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}


# ------------------------------------------------------------------------------------------------ the environment


class SetupError(Exception):
    """The environment cannot be made; the text says why and what to do, and `code` is the exit code."""

    def __init__(self, text, code=1):
        super().__init__(text)
        self.code = code


def environment(blender, bring=False, locked=False):
    """The Python of .venv (of .venv-5.0 and so on for another Blender than 4.5), made when missing or stale.

    bring:  whether to install what the system's Python lacks to make one
    locked: whether it must be of exactly the packages that lock() wrote down
    """
    folder = ROOT / (".venv" if blender == DEFAULT else f".venv-{blender}")
    finder = functools.partial(maker, PYTHON[blender], bring)
    what = f"with Blender {blender} (once, about 400 MB)"
    return environment_in(folder, packages(blender), finder, what, locked_packages(blender) if locked else None)


def packages(blender, groups=TESTED):
    """What an environment with that Blender is asked to have."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = [f"bpy=={blender}.*" if need.startswith("bpy") else need for need in project["dependencies"]]
    return wanted + [need for group in groups for need in project["optional-dependencies"][group]]


def locked_packages(blender):
    """The file of the packages that CI installs for that Blender, each with its version and hash."""
    return ROOT / ".ci" / f"lock-{blender}.txt"


def environment_in(folder, wanted, finder, what, locked=None):
    """The Python of an environment with the packages `wanted`; `finder` finds the Python to make it with, if need be.

    locked: a file with all the packages to be installed, in the place of the newest that fit; any will do if None
    """
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    stamp = folder / "made-from"
    # a copied or moved environment is stale too: its scripts name the old place
    marks = [hashlib.sha256(repr((wanted, str(folder))).encode()).hexdigest()]
    marks += [hashlib.sha256(locked.read_bytes()).hexdigest()] if locked else []
    if python.exists() and stamp.exists() and stamp.read_text().split()[: len(marks)] == marks:
        return python
    print(f"build.py: making {folder.name} {what}", file=sys.stderr, flush=True)
    shutil.rmtree(folder, ignore_errors=True)
    which = ["--no-deps", "--require-hashes", "--requirement", locked] if locked else wanted
    steps = (
        [finder(), "-m", "venv", folder],
        [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *which],
    )
    for step in steps:
        done = subprocess.run(
            [str(word) for word in step], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        if done.returncode:
            shutil.rmtree(folder, ignore_errors=True)
            raise SetupError(f"the environment could not be made: {last_line(done.stderr)}")
    stamp.write_text("\n".join(marks))
    return python


def maker(version, bring):
    """A Python of that version that can make environments, which Debian sells apart."""
    python = interpreter(version)
    if subprocess.run([python, "-c", "import ensurepip"], stderr=subprocess.DEVNULL).returncode:
        package = "python{}.{}-venv".format(*version)
        if not bring:
            how = (
                f"run: apt-get update && {part('nim_addon/base/libraries.py').APT} {package}"
                if debian()
                else f"install its package {package}."
            )
            raise SetupError(f"{python} cannot make environments; {how}{again()}")
        install([package])
    return python


def interpreter(version):
    """A Python of that version: this one if it fits, else the first found that runs and says that it is one."""
    if sys.version_info[:2] == version:
        return getattr(sys, "_base_executable", None) or sys.executable  # this one may be of the environment that goes
    name = "python{}.{}".format(*version)
    failed = None
    for words in candidates(name):
        try:
            done = subprocess.run([*words, "-c", ASK], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        except OSError:
            continue
        found, _, path = done.stdout.strip().partition(" ")
        if done.returncode == 0 and found == "{}.{}".format(*version):
            return path
        failed = failed or words[0]
    instead = f"{failed} does not run" if failed else "there is none on the PATH, nor where pyenv and others put theirs"
    raise SetupError(f"this Blender needs {name}, and {instead}; install it, with pyenv for example.", NO_PYTHON)


# What a Python is asked: its version, and its own file, which a shim on the PATH (pyenv's) is not.
ASK = "import sys; print('%d.%d' % sys.version_info[:2], sys.executable)"
NO_PYTHON = 3  # the exit code where there is no Python for a Blender


def candidates(name):
    """What may be the Python of that name, such as python3.13: lists of words to run it by, the likeliest first."""
    number = name.removeprefix("python")
    folders = [Path(folder) for folder in os.environ.get("PATH", "").split(os.pathsep) if folder]
    pyenv = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv", "versions")
    folders += sorted((found / "bin" for found in pyenv.glob(f"{number}*")), reverse=True)
    folders += sorted(Path.home().glob(f".local/share/uv/python/cpython-{number}*/bin"), reverse=True)
    folders += [Path("/usr/local/bin"), Path("/usr/bin"), Path("/opt/homebrew/bin"), *Path("/opt").glob("*/bin")]
    yield from ([str(folder / name)] for folder in dict.fromkeys(folders) if (folder / name).exists())
    if os.name == "nt":
        yield ["py", f"-{number}"]


def complete(python, bring):
    """See that this environment's Blender finds the shared libraries it needs of the system; if `bring`, install them."""
    module = next(python.parent.parent.glob("lib/python*/site-packages/bpy/__init__*.so"), None)
    if sys.platform != "linux" or module is None:
        return
    libraries = part("nim_addon/base/libraries.py")
    names = libraries.missing_for(module)
    if names and bring:
        install(libraries.of_debian(names))
        names = libraries.missing_for(module)
    if names:
        raise SetupError(libraries.sentence(names) + again())


def debian():
    """Whether this system installs packages as Debian does, and we may."""
    return shutil.which("apt-get") is not None and os.geteuid() == 0


def again():
    """What a person who lacks packages may do instead, where that is so."""
    return " (or add --system-packages here)" if debian() else ""


def install(packages):
    """Install packages of Debian as root; SetupError where that cannot be."""
    if not debian():
        raise SetupError(
            "--system-packages is for root on Debian or Ubuntu; leave it out to be told what is missing.", 2
        )
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    steps = (["update"], ["install", "-y", "--no-install-recommends", *packages])
    for step in steps if packages else ():
        words = ["apt-get", "-qq", *step]
        done = subprocess.run(words, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        if done.returncode:
            raise SetupError(f"{' '.join(words)} failed: {last_line(done.stderr)}")


def part(path):
    """A module of this repository that needs nothing but the standard library."""
    spec = importlib.util.spec_from_file_location(Path(path).stem, ROOT / path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def last_line(text):
    """The last line of what a program said."""
    return ([line.strip() for line in text.splitlines() if line.strip()] or ["no reason given"])[-1]


# ------------------------------------------------------------------------------------------------ the commands


def setup(python, rest):
    """Only make the environment."""
    print(f"build.py: {python.parent.parent.name} is ready")
    return 0


def test(python, rest):
    """Run pytest."""
    return run(python, "-m", "pytest", *rest)


def lint(python, rest):
    """Check the style and the types, by what is installed at the first time."""
    if run(python, "-c", "import importlib.util as u, sys; sys.exit(u.find_spec('basedpyright') is None)"):
        print("build.py: installing what checks types (once, about 90 MB)", file=sys.stderr, flush=True)
        wanted = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]["lint"]
        if code := run(python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *wanted):
            return code
    return max(
        run(python, "-m", *words) for words in (("ruff", "check"), ("ruff", "format", "--check"), ("basedpyright",))
    )


def blends(python, rest):
    """Write blend_scenes/*.blend, and the assets that the extension brings along; or only what is named."""
    others = {"closures": "make_closures.py", "assets": "make_assets.py"}
    if rest and rest[0] not in others:
        return run(python, "blend_scenes/make.py", *rest)
    makers = [others[rest[0]]] if rest else ["make_closures.py", "make.py", "make_assets.py"]
    return max(run(python, f"blend_scenes/{name}", *rest[1:]) for name in makers)


def package(python, rest):
    """Build and validate the extension's zip."""
    finder = (
        "import bpy, glob; print(glob.glob(bpy.utils.system_resource('SCRIPTS') + '/addons*/bl_pkg/cli/*_ext.py')[0])"
    )
    # the last line: a Blender may have something to say of its own before
    tool = subprocess.run([str(python), "-c", finder], stdout=subprocess.PIPE, text=True).stdout.strip().split("\n")[-1]
    if not tool.endswith(".py"):
        return complain("this Blender has no extension tool.", 1)
    packing, target = part("tools/packing.py"), ROOT / "dist"
    target.mkdir(exist_ok=True)
    # built beside and renamed: two of these at once do not meet, and one that is stopped leaves no half zip
    with tempfile.TemporaryDirectory(prefix=".package-", dir=target) as work:
        staged, built = Path(work, "nim_addon"), Path(work, "built")
        try:
            packing.stage(ROOT, staged)
        except packing.Refusal as error:
            return complain(str(error), 1)
        built.mkdir()
        code = pages(python, staged / "docs") or run(python, "tools/light_pages.py", staged / "docs")
        code = code or run(python, tool, "validate", staged)
        code = code or run(python, tool, "build", "--source-dir", staged, "--output-dir", built)
        for file in () if code else built.iterdir():
            os.replace(file, target / file.name)
            print(target / file.name)
    return code


def docs(python, rest):
    """Make the pages of docs/ as HTML; a warning, such as a link that leads nowhere, is an error."""
    usual = target = ROOT / "dist" / "docs"
    if rest:
        if len(rest) != 2 or rest[0] != "--out":
            return complain(f"docs {' '.join(rest)}: it takes nothing but --out DIR.")
        target = Path(rest[1]).absolute()
    with tempfile.TemporaryDirectory() as work:
        made = Path(work, "html")
        if code := pages(python, made):
            return code
        if target == usual:  # what is no page any more goes; another folder may hold what is not ours
            shutil.rmtree(target, ignore_errors=True)
        try:
            shutil.copytree(made, target, dirs_exist_ok=True)
        except OSError as error:
            return complain(f"{target} cannot be written: {error}", 1)
    print(target / "index.html")
    return 0


def pages(python, folder):
    """Make the pages in a new folder; returns the exit code."""
    with tempfile.TemporaryDirectory() as work:
        code = run(python, "-m", "sphinx", "-b", "html", "-W", "--keep-going", "-q", "-d", work, ROOT / "docs", folder)
    for file in folder.glob(".buildinfo*"):  # what helps only the next run
        file.unlink()
    return code


def bench(python, rest):
    """Print the benchmarks: `glass`, our material beside Blender's, and `peers`, beside Mitsuba and POV-Ray, or only
    what is named: one of them, `waits`, what a person waits for, `scale`, what large scenes cost, `laws`, other closures
    beside Glass, `spectrum`, media that disperse beside Mitsuba and LuxCore, `sweep`, many renders here and by Dask, or
    `caustics`, which takes long; and `kills`, which ends parts of sweeps at random moments."""
    named = ("glass", "peers", "waits", "scale", "laws", "caustics", "spectrum", "sweep", "kills")
    chosen = [rest[0]] if rest and rest[0] in named else ["glass", "peers"]
    words = rest[1:] if rest[:1] == chosen else rest
    return max(run(python, f"bench/{name}.py", *words) for name in chosen)


def release(python, rest):
    """Give what is here a new version, check it all, and build the extension; what fails leaves the files as they were."""
    if len(rest) != 1:
        return complain("release takes the new version, such as 0.2.0.")
    tool = part("tools/release.py")
    try:
        former = tool.write(ROOT, rest[0], datetime.date.today())
    except tool.Refusal as error:
        return complain(str(error))
    code = 1  # also where it is stopped
    try:
        code = lint(python, []) or test(python, []) or package(python, [])
    finally:
        if code:
            tool.restore(former)
    if code:
        return complain(f"{rest[0]} is no release: see above; the files are as they were.", code)
    print(f"Now: git commit --all --message 'Version {rest[0]}' && git tag v{rest[0]}")
    return 0


def lock(python, rest):
    """Write down for each Blender the newest packages that fit together, with the hashes of what is installed of them."""
    words = ("-m", "pip", "install", "--dry-run", "--ignore-installed", "--quiet", "--report", "-")
    for blender in PYTHON:
        # style and types are checked in one of them
        groups = (*TESTED, "lint") if blender == DEFAULT else TESTED
        words_of_it = [str(environment(blender)), *words, *packages(blender, groups)]
        found = subprocess.run(words_of_it, stdout=subprocess.PIPE, text=True)
        if found.returncode:
            return complain(f"no packages fit together for Blender {blender}.", 1)
        lines = []
        for entry in json.loads(found.stdout)["install"]:
            package, archive = entry["metadata"], entry["download_info"]["archive_info"]
            lines.append(f"{package['name']}=={package['version']} --hash=sha256:{archive['hashes']['sha256']}\n")
        head = f"# By python3 build.py lock: what CI installs for Blender {blender}, on Linux on x86-64.\n"
        locked_packages(blender).write_text(head + "".join(sorted(lines, key=str.lower)))
        print(locked_packages(blender).relative_to(ROOT))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
