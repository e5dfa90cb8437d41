# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of a folder of figures: whatever its records hold, it leads nowhere else, and runs nothing."""

import html.parser
import json

import pytest

from nim_addon import __version__ as VERSION
from nim_addon.figures import index

CLAIM = {"text": "it holds", "predicted": 1.0, "measured": float("nan"), "allowed": 0.1, "unit": "m", "holds": False}
RECORD = {
    "nimray": VERSION,
    "blender": "4.5.0",
    "figure": "9.9",
    "title": "Title",
    "shows": "Shows.",
    "must_hold": ["it holds"],
    "quality": "draft",
    "picture": "figure-9.9.png",
    "parts": [["caption", "9.9/a b.png"]],
    "holds": False,
    "claims": [CLAIM],
}
EVIL = "\"'><script>alert(1)</script>&"


class Page(html.parser.HTMLParser):
    """What a browser would find in a page."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.links = [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, tuple(sorted(name for name, _ in attributes))))
        self.links += [value for name, value in attributes if name in ("href", "src")]


def page(folder, **changes):
    (folder / "figure-9.9.json").write_text(json.dumps({**RECORD, **changes}))
    return Page(index.write(folder).read_text())


def test_what_a_record_says_is_shown_and_never_acted_upon(tmp_path):
    plain = page(tmp_path)
    assert "9.9/a%20b.png" in plain.links
    texts = dict.fromkeys(("title", "shows", "quality", "blender", "picture"), EVIL)
    claim = {**CLAIM, "text": EVIL, "unit": EVIL}
    evil = page(tmp_path, **texts, must_hold=[EVIL], parts=[[EVIL, EVIL]], claims=[claim])
    assert evil.tags == plain.tags


@pytest.mark.parametrize(
    "link", ("javascript:alert(1)", "data:text/html,x", "https:a.example", "JavaScript&colon;x", "?a#b")
)
def test_a_link_leads_to_a_file_of_the_folder(link, tmp_path):
    found = set(page(tmp_path, picture=link, parts=[["a", link]]).links)
    assert not any(one.partition("/")[0].count(":") or "?" in one for one in found)


WRONG = {
    "figure": [None, 5, "", '".1', "a.1", "1.x", "5.", ".5", "5.1\n", "AB.1", "999.1", "\u0665.\u0661"],
    "picture": [None, 5, [], "/etc/passwd", "//evil.example/x", "../x.png", "a/../../x.png"],
    "parts": [None, 5, [["a"]], [["a", "/x"]], [[5, "x"]], "ab"],
    "claims": [None, [{}], [{**CLAIM, "predicted": "1"}], [{**CLAIM, "allowed": None}], ["x"]],
    "must_hold": [None, [5], 5],
    "title": [None, 5, []],
    "nimray": [None, 5, []],
}


@pytest.mark.parametrize("key", WRONG)
def test_a_record_of_wrong_types_is_named_in_a_sentence(key, tmp_path, one_sentence):
    for value in WRONG[key]:
        with pytest.raises(ValueError) as caught:
            page(tmp_path, **{key: value})
        one_sentence(caught.value, "figure-9.9.json", "is not a whole record")
    assert not (tmp_path / "index.html").exists()


@pytest.mark.parametrize("text", ("[" * 100000, '{"nimray": ' * 3000, "", "[]", "5", "\x00"))
def test_what_is_no_record_is_named_in_a_sentence(text, tmp_path, one_sentence):
    (tmp_path / "figure-9.9.json").write_text(text)
    with pytest.raises(ValueError) as caught:
        index.write(tmp_path)
    one_sentence(caught.value, "figure-9.9.json", "is not a whole record")
