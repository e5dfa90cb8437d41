# SPDX-License-Identifier: GPL-3.0-or-later
"""Who publishes the extension, written into its manifest. Standard library only."""

import json
import re
import sys
import tomllib

FILE = "tools/publisher.toml"


def signed(manifest, root):
    """The text of a manifest with the maintainer and the website that FILE of the repository names, where it does.

    A maintainer must stand there, so that of the text stays where FILE names none; one sentence on standard error says so.
    """
    publisher = tomllib.loads((root / FILE).read_text(encoding="utf-8"))
    filled = {name: value.strip() for name, value in publisher.items() if value.strip()}
    if missing := [name for name in ("maintainer", "website") if name not in filled]:
        print(f"build.py: not to be published yet: {FILE} names no {' and no '.join(missing)}.", file=sys.stderr)
    former = re.search(r"^maintainer = .*\n", manifest, re.MULTILINE)
    lines = "" if "maintainer" in filled else former[0]
    lines += "".join(f"{name} = {json.dumps(value, ensure_ascii=False)}\n" for name, value in filled.items())
    return manifest[: former.start()] + lines + manifest[former.end() :]
