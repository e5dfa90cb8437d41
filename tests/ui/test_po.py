# SPDX-License-Identifier: GPL-3.0-or-later
"""The .po files of the translations: read as gettext's own tools read them, or refused in one sentence."""

import gettext
import shutil
import subprocess

import pytest

from nim_addon.ui import po, translations

FILES = sorted(translations.LOCALE.glob("*.po"))
HEAD = 'msgid ""\nmsgstr ""\n"Content-Type: text/plain; charset=UTF-8\\n"\n'

SAMPLE = (
    HEAD
    + """
# of a translator
#. of a programmer
#: a/place.py:3
#, python-brace-format
msgid "{n} rays"
msgstr "{n} rayos"

msgctxt "Operator"
msgid "Bake"
msgstr "Capturar"

msgid "Bake"
msgstr "Captura"
msgid ""
"a \\"word\\", a tab\\t, "
"a back\\\\slash and\\n"
"a second line"
msgstr "una "
"palabra"

msgid "not yet"
msgstr ""

#, fuzzy
msgid "perhaps"
msgstr "quizás"

#~ msgid "gone"
#~ msgstr "ido"
"""
)


@pytest.fixture
def written(tmp_path):
    """written(text) -> the path of a .po file that holds it."""

    def write(text):
        file = tmp_path / "es.po"
        file.write_text(text, encoding="utf-8")
        return file

    return write


def test_all_that_a_file_may_hold_is_read(written):
    assert po.read(written(SAMPLE)) == {
        (None, "{n} rays"): "{n} rayos",
        ("Operator", "Bake"): "Capturar",
        (None, "Bake"): "Captura",
        (None, 'a "word", a tab\t, a back\\slash and\na second line'): "una palabra",
    }
    assert po.read(written(HEAD)) == {} == po.read(written(""))
    assert po.read(written(SAMPLE.replace("\n", "\r\n"))) == po.read(written(SAMPLE))


WRONG = {
    "no quotes": "msgid word\nmsgstr palabra\n",
    "no translation": 'msgid "word"\n\nmsgid "another"\nmsgstr "otra"\n',
    "turned round": 'msgstr "palabra"\nmsgid "word"\n',
    "an unknown keyword": 'msgword "word"\nmsgstr "palabra"\n',
    "an open quote": 'msgid "word\nmsgstr "palabra"\n',
    "an unknown escape": 'msgid "wo\\qrd"\nmsgstr "palabra"\n',
    "a plural": 'msgid "word"\nmsgid_plural "words"\nmsgstr[0] "palabra"\nmsgstr[1] "palabras"\n',
    "twice": 'msgid "word"\nmsgstr "palabra"\n\nmsgid "word"\nmsgstr "vocablo"\n',
    "something at the end": 'msgid "word"\nmsgstr "palabra"\nend\n',
}


@pytest.mark.parametrize("text", WRONG.values(), ids=WRONG)
def test_what_cannot_be_read_is_said_in_one_sentence(written, one_sentence, text):
    with pytest.raises(ValueError) as raised:
        po.read(written(HEAD + "\n" + text))
    one_sentence(str(raised.value), "es.po")


@pytest.mark.skipif(not shutil.which("msgfmt"), reason="there is no gettext here, of which msgfmt is a part")
@pytest.mark.parametrize("file", [None, *FILES], ids=lambda file: file.stem if file else "sample")
def test_gettext_reads_the_same(written, tmp_path, file):
    file = file or written(SAMPLE)
    done = subprocess.run(["msgfmt", "-c", "-o", tmp_path / "it.mo", file], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    with open(tmp_path / "it.mo", "rb") as compiled:
        theirs = gettext.GNUTranslations(compiled)
    ours = po.read(file)
    assert ours
    for (context, text), translation in ours.items():
        assert (theirs.pgettext(context, text) if context else theirs.gettext(text)) == translation
