# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads gettext's .po files, in which translators' tools keep the texts of a language: as much of them as is used here."""

import json
import re
from pathlib import Path

TEXT = r'((?:"[^"\\\n]*(?:\\.[^"\\\n]*)*"\n+)+)'
ENTRY = re.compile(rf"((?:#.*\n|\n)*)(?:msgctxt {TEXT})?msgid {TEXT}msgstr {TEXT}")
BETWEEN = re.compile(r'"\n+"')  # a text may go over several lines, each of them in quotes


def read(file: Path) -> dict[tuple[str | None, str], str]:
    """The translations of a .po file: {(context or None, text): translation}, without those still empty or fuzzy.

    ValueError, one sentence, where the file is none, or is beyond this reader, as plurals are, or has a text twice.
    """
    source = file.read_text(encoding="utf-8") + "\n"
    texts, at = {}, 0
    try:
        while entry := ENTRY.match(source, at):
            comments, *given = entry.groups()
            context, text, translation = (part and json.loads(BETWEEN.sub("", part)) for part in given)
            if (context, text) in texts:
                raise ValueError
            fuzzy = re.search("^#,.*fuzzy", comments, re.MULTILINE)
            texts[context, text] = "" if fuzzy else translation
            at = entry.end()
        if not re.fullmatch(r"(#.*\n|\n)*", source[at:]):
            raise ValueError
    except ValueError:
        line = source.count("\n", 0, at) + 1
        raise ValueError(f"{file.name}: the entry after line {line} cannot be read, or is there twice.") from None
    texts.pop((None, ""), None)  # the head of the file
    return {key: translation for key, translation in texts.items() if translation}
