# SPDX-License-Identifier: GPL-3.0-or-later
"""What the extension's zip is made of: the files that git knows, and who publishes it. Standard library only."""

import json
import re
import shutil
import subprocess
import sys
import tomllib

PUBLISHER = "tools/publisher.toml"


class Refusal(Exception):
    """There can be no such zip; the text says why."""


def stage(root, folder):
    """Lay the extension's files into a new folder: those that git knows, as they are, and the manifest with its publisher.

    root: folder of the repository
    Raises Refusal, one sentence, where git is not there or a file is not.
    """
    places = {"nim_addon": folder, "osl": folder / "osl", "LICENSE": folder}
    for name in known_to_git(root, places):
        room, _, rest = name.partition("/")
        target = places[room] / (rest or room)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(root / name, target)
    manifest = folder / "blender_manifest.toml"
    text = manifest.read_text(encoding="utf-8")
    manifest.write_text(_signed(text, root), encoding="utf-8", newline="\n")


def known_to_git(root, names):
    """The files under those names that git knows; what else lies there and is not ignored is named, and left out."""

    def listed(*options):
        # whoever runs this may not be who owns the folder, as in a container
        words = ["git", "-c", f"safe.directory={root.as_posix()}", "ls-files", "-z", *options, "--", *names]
        try:
            done = subprocess.run(words, cwd=root, capture_output=True, encoding="utf-8")
        except OSError as error:
            raise Refusal(f"only what git knows is packed, and git does not start: {error}.") from None
        if done.returncode:
            raise Refusal(f"only what git knows is packed, and git says: {done.stderr.strip()}.")
        return [name for name in done.stdout.split("\0") if name]

    known = listed()
    if gone := [name for name in known if not (root / name).is_file()]:
        raise Refusal(f"{gone[0]} is known to git and is not there: git rm it, or bring it back.")
    for name in listed("--others", "--exclude-standard"):
        print(f"build.py: {name} is left out: git does not know it.", file=sys.stderr)
    return known


def _signed(manifest, root):
    """The text of a manifest with the maintainer and the website that PUBLISHER of the repository names, where it does.

    A maintainer must stand there, so that of the text stays where PUBLISHER names none; one sentence on standard error says so.
    """
    publisher = tomllib.loads((root / PUBLISHER).read_text(encoding="utf-8"))
    filled = {name: value.strip() for name, value in publisher.items() if value.strip()}
    if missing := [name for name in ("maintainer", "website") if name not in filled]:
        print(f"build.py: not to be published yet: {PUBLISHER} names no {' and no '.join(missing)}.", file=sys.stderr)
    former = re.search(r"^maintainer = .*\n", manifest, re.MULTILINE)
    lines = "" if "maintainer" in filled else former[0]
    lines += "".join(f"{name} = {json.dumps(value, ensure_ascii=False)}\n" for name, value in filled.items())
    return manifest[: former.start()] + lines + manifest[former.end() :]
