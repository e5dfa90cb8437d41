# SPDX-License-Identifier: GPL-3.0-or-later
"""Making figures: files that appear whole, runs that go on where they stopped, claims that fail, and the page."""

import dataclasses
import json
import re
from html.parser import HTMLParser

import numpy as np
import OpenImageIO as oiio
import pytest

from nim_addon import command
from nim_addon.cycles import render
from nim_addon.cycles.images import read_metadata
from nim_addon.figures import index, registry, run
from nim_addon.figures.claims import Claim
from nim_addon.figures.recipes import Figure, Recipe, in_order
from nim_addon.renders import changes
from nim_addon.renders.request import Request


def dark(scene):
    scene.world = None


def recipes():
    tiny = ((24, 16), 2)
    return (
        Recipe("one", "sphere", ("n=1.5",), draft=tiny, caption="n = 1.5"),
        Recipe("two", "sphere", ("n=-1.5",), draft=tiny, final=((32, 24), 3), caption="n = -1.5"),
        Recipe("dark", "sphere", draft=tiny, change=dark, seeds=2, shown=False),
    )


CLAIMS = [Claim("a sky gives light", 1, 1, 0), Claim("none < without", 0, 0, 0)]


def measure(images):
    measured = float(images["one"].pixels.mean() > 0), float(images["dark"].pixels.max())
    return [claim._replace(measured=number) for claim, number in zip(CLAIMS, measured, strict=True)]


FIGURE = Figure("9.9", "A figure & its test", "two <spheres>", ("light comes from the sky",), recipes(), measure)


@pytest.fixture
def rendered(monkeypatch):
    """The names of the images that are rendered."""
    names = []
    original = render.render
    monkeypatch.setattr(
        render,
        "render",
        lambda scene, folder, name, **more: names.append(name) or original(scene, folder, name, **more),
    )
    return names


@pytest.fixture
def only_this(monkeypatch):
    monkeypatch.setattr(registry, "FIGURES", {"9.9": FIGURE})


def pixels(file):
    return oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT)


def test_a_figure_is_made_and_a_killed_run_goes_on(tmp_path, empty_file, rendered):
    record = run.make(FIGURE, tmp_path)
    assert rendered == ["one", "two", "dark.0", "dark.1"]
    assert record["holds"] and [claim["measured"] for claim in record["claims"]] == [1, 0]
    assert record == json.loads((tmp_path / "figure-9.9.json").read_text())
    assert {file.name for file in tmp_path.iterdir()} == {"9.9", "figure-9.9.png", "figure-9.9.json", "index.html"}
    assert {file.name for file in (tmp_path / "9.9").iterdir()} == {
        "one.exr",
        "one.png",
        "two.exr",
        "two.png",
        "measured",
    }
    assert pixels(tmp_path / "figure-9.9.png").shape == (16, 24 + 2 + 24, 3)

    # nothing is missing; then one is cut off, as by a full disk, and one has no PNG
    rendered.clear()
    run.make(FIGURE, tmp_path)
    assert rendered == []
    cut = tmp_path / "9.9" / "two.exr"
    cut.write_bytes(cut.read_bytes()[:-500])
    (tmp_path / "9.9" / "measured" / "dark.1.png").unlink()
    run.make(FIGURE, tmp_path)
    assert rendered == ["two", "dark.1"]

    # another quality is another image where the recipe says so
    rendered.clear()
    run.make(FIGURE, tmp_path, "final")
    assert rendered == ["two"]
    assert pixels(cut).shape == (24, 32, 3)


def test_other_code_renders_again_and_another_version_is_kept(
    tmp_path, empty_file, rendered, monkeypatch, one_sentence
):
    figure = Figure("9.9", "", "", (), recipes()[:1])
    run.make(figure, tmp_path)
    monkeypatch.setattr(changes, "code_mark", lambda **how: "other")
    run.make(figure, tmp_path)
    assert rendered == ["one", "one"]
    monkeypatch.setattr(run, "VERSION", "9.0")
    with pytest.raises(OSError) as caught:
        run.make(figure, tmp_path)
    one_sentence(caught.value, "nimray 0.1.0", "name another folder")
    (tmp_path / "figure-9.9.json").unlink()  # as after a run that was killed
    before = {file: file.read_bytes() for file in tmp_path.rglob("*.*") if file.is_file()}
    with pytest.raises(OSError) as caught:
        run.make(figure, tmp_path)
    one_sentence(caught.value, "one.exr", "name another folder")
    assert {file: file.read_bytes() for file in tmp_path.rglob("*.*") if file.is_file()} == before


def contents(folder):
    return {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()}


def refused(tmp_path, rendered, one_sentence, *words, figure=FIGURE):
    """A draft is refused in one sentence, nothing is rendered, and all is as it was."""
    before = contents(tmp_path)
    rendered.clear()
    with pytest.raises(OSError) as caught:
        run.make(figure, tmp_path)
    one_sentence(caught.value, "name another folder", *words)
    assert rendered == [] and contents(tmp_path) == before


def test_a_draft_never_replaces_a_final(tmp_path, empty_file, rendered, one_sentence):
    run.make(FIGURE, tmp_path, "final")
    refused(tmp_path, rendered, one_sentence, "holds figure 9.9 at final quality", "--quality final")
    run.make(FIGURE, tmp_path, "final")
    assert rendered == []

    # a final run that was killed, over nothing and over a draft
    record = tmp_path / "figure-9.9.json"
    record.unlink()
    refused(tmp_path, rendered, one_sentence, "final")
    two = [tmp_path / "9.9" / f"two.{suffix}" for suffix in ("exr", "png")]
    kept = [file.read_bytes() for file in two]
    for file in two:
        file.unlink()
    run.make(FIGURE, tmp_path)
    for file, data in zip(two, kept, strict=True):
        file.write_bytes(data)
    refused(tmp_path, rendered, one_sentence, "final")

    # the sheet alone is worth keeping; and what is the same at both qualities is no loss
    record.write_text(json.dumps(json.loads(record.read_text()) | {"quality": "final"}))
    for file in two:
        file.unlink()
    refused(tmp_path, rendered, one_sentence, "final")
    run.make(dataclasses.replace(FIGURE, recipes=recipes()[:1], measure=lambda images: []), tmp_path)


@pytest.mark.parametrize("text", ["<title>My site</title>", "", None])
def test_a_page_of_another_is_kept(text, tmp_path, rendered, one_sentence):
    page = tmp_path / "index.html"
    page.mkdir() if text is None else page.write_text(text)
    refused(tmp_path, rendered, one_sentence, "index.html")


WHOLE = {
    "nimray": run.VERSION,
    "blender": "4.5.0",
    "figure": "9.8",
    "title": "",
    "shows": "",
    "must_hold": [],
    "quality": "draft",
    "picture": "9.8.svg",
    "parts": [],
    "holds": True,
    "claims": [],
}


@pytest.mark.parametrize(
    "text",
    [
        json.dumps(WHOLE)[:-9],
        "",
        "[]",
        "{}",
        '{"nimray": 1}',
        json.dumps({"nimray": run.VERSION}),
        json.dumps(WHOLE | {"claims": [{}]}),
        json.dumps(WHOLE | {"figure": "mine"}),
    ],
)
def test_what_is_no_record_is_named(text, tmp_path, empty_file, rendered, one_sentence):
    file = tmp_path / "figure-9.8.json"
    file.write_text(text)
    refused(tmp_path, rendered, one_sentence, "figure-9.8.json is not a whole record of a figure; delete it")
    with pytest.raises(ValueError, match="not a whole record"):
        index.write(tmp_path)

    # the figure's own is made anew
    file.rename(tmp_path / "figure-9.9.json")
    run.make(dataclasses.replace(FIGURE, recipes=recipes()[:1], measure=lambda images: []), tmp_path)
    assert index.read(tmp_path / "figure-9.9.json")["figure"] == "9.9"


def test_a_whole_record_is_shown(tmp_path):
    (tmp_path / "figure-9.8.json").write_text(json.dumps(WHOLE))
    assert "figure-9.8.json" in index.write(tmp_path).read_text()


def test_what_a_change_may_call_is_part_of_its_record(tmp_path, empty_file, rendered, monkeypatch):
    figure = Figure("9.9", "", "", (), recipes()[1:])
    (tmp_path / "figures").mkdir()
    helper = tmp_path / "figures" / "helper.py"
    monkeypatch.setattr(changes, "FOLDER", tmp_path)
    for text in ("a", "a", "b"):
        helper.write_text(text)
        changes.code_mark.cache_clear()
        run.make(figure, tmp_path / "out")
    changes.code_mark.cache_clear()
    # an image that nothing is changed for stays
    assert rendered == ["two", "dark.0", "dark.1", "dark.0", "dark.1"]


def test_the_exr_keeps_the_noise_that_the_png_has_not(tmp_path, empty_file):
    import _cycles

    if not _cycles.with_openimagedenoise:
        pytest.skip("this Blender was built without OpenImageDenoise")
    figure = Figure("9.9", "", "", (), (Recipe("noisy", "sphere", draft=((64, 48), 2)),))
    run.make(figure, tmp_path)
    rough = [
        np.abs(np.diff(pixels(tmp_path / "9.9" / f"noisy.{kind}")[..., :3], axis=0)).mean() for kind in ("exr", "png")
    ]
    assert read_metadata(tmp_path / "9.9" / "noisy.exr")["denoise"]
    assert rough[0] > 1.5 * rough[1]
    assert oiio.ImageBuf(str(tmp_path / "9.9" / "noisy.exr")).spec().channelnames == ("R", "G", "B")


def test_a_figure_that_is_drawn(tmp_path):
    def draw(folder):
        (folder / "curve.svg").write_text("<svg/>")
        (folder / "curve.csv").write_text("0")
        return [folder / "curve.svg", folder / "curve.csv"]

    figure = Figure("A.9", "A curve", "a curve", (), measure=lambda images: [Claim("it is 1", 1, 1, 0)], draw=draw)
    record = run.make(figure, tmp_path)
    assert record["picture"] == "A.9/curve.svg"
    assert {file.name for file in (tmp_path / "A.9").iterdir()} == {"curve.svg", "curve.csv"}


def test_a_drawing_that_cannot_be_written_names_its_folder(tmp_path, one_sentence):
    def draw(folder):
        raise OSError(f"cannot write into {folder}: No space left on device; name another folder.")

    with pytest.raises(OSError) as raised:
        run.make(Figure("A.9", "", "", (), draw=draw), tmp_path)
    assert f"into {tmp_path / 'A.9'}: No space" in one_sentence(raised.value)


def test_the_page(tmp_path, empty_file):
    class Page(HTMLParser):
        def __init__(self):
            super().__init__()
            self.links, self.images, self.text = [], [], ""

        def handle_starttag(self, tag, attributes):
            found = dict(attributes)
            assert tag != "script"
            self.links += [found["href"]] if tag == "a" else []
            self.images += [found] if tag == "img" else []

        def handle_data(self, data):
            self.text += data

    run.make(dataclasses.replace(FIGURE, recipes=recipes()[:1], measure=lambda images: CLAIMS), tmp_path)
    page = Page()
    page.feed((tmp_path / "index.html").read_text())
    assert [image["alt"] for image in page.images] == ["two <spheres>"]
    assert "A figure & its test" in page.text and "none < without" in page.text and "all 2 claims hold" in page.text
    for link in [*page.links, *(image["src"] for image in page.images)]:
        assert link == "#figure-9.9" or (tmp_path / link).is_file(), link


def test_the_command(tmp_path, empty_file, only_this, capsys, monkeypatch):
    assert command.main(["figures"]) == 0
    assert capsys.readouterr().out.startswith("9.9: A figure & its test\n  - light comes from the sky\n")
    assert command.main(["figures", "9.9", "--out", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert "holds  a sky gives light" in out and re.search(r"^PASS figure 9.9, 2 claims, \d+ s: ", out, re.MULTILINE)

    assert command.main(["render", "--again", str(tmp_path / "9.9" / "one.exr")]) == 2
    assert "part of a figure" in capsys.readouterr().err

    failing = dataclasses.replace(FIGURE, measure=lambda images: [Claim("the light is white", 1, 0.5, 0.1)])
    monkeypatch.setattr(registry, "FIGURES", {"9.9": failing})
    assert command.main(["figures", "--all", "--out", str(tmp_path), "--quiet"]) == 1
    out = capsys.readouterr().out
    assert "FAILS  the light is white: predicted 1, measured 0.5" in out and "FAIL: 1 of figure 9.9" in out
    assert command.main(["figures", "--all", "--out", str(tmp_path), "--json"]) == 1
    (record,) = json.loads(capsys.readouterr().out)
    assert record["claims"][0]["holds"] is False and "FAILS" not in (tmp_path / "index.html").read_text()
    assert "1 of 1 claims fail" in (tmp_path / "index.html").read_text()


def test_what_is_refused(tmp_path, only_this, capsys):
    assert command.main(["figures", "9.8", "--out", str(tmp_path)]) == 2
    assert "there is no figure '9.8'; did you mean 9.9?" in capsys.readouterr().err
    assert command.main(["figures", "9.9", "--all"]) == 2
    assert command.main(["figures", "9.9", "--quality", "best"]) == 2
    (tmp_path / "file").write_text("")
    assert command.main(["figures", "9.9", "--out", str(tmp_path / "file")]) == 1
    assert "name another folder" in capsys.readouterr().err
    assert command.main(["figures", "9.9", "--out", ""]) == 2
    assert "--out is empty; name" in capsys.readouterr().err


def test_a_folder_where_the_picture_or_the_record_would_be_is_seen_before_the_work(tmp_path, only_this, capsys):
    for suffix in (".png", ".json"):
        (tmp_path / f"figure-9.9{suffix}").mkdir()
        assert command.main(["figures", "9.9", "--out", str(tmp_path)]) == 1
        assert f"figure-9.9{suffix} is a folder" in capsys.readouterr().err
        assert [file.name for file in tmp_path.iterdir()] == [f"figure-9.9{suffix}"]
        (tmp_path / f"figure-9.9{suffix}").rmdir()


def test_the_registry():
    numbers = list(registry.FIGURES)
    assert numbers == sorted(numbers, key=in_order) and in_order("5.10") > in_order("5.9")
    for number, figure in registry.FIGURES.items():
        assert figure.number == number and figure.title and figure.shows.endswith(".") and figure.must_hold
        names = [recipe.name for recipe in figure.recipes]
        assert len(set(names)) == len(names)
        assert any(recipe.shown for recipe in figure.recipes) or figure.draw
        shown = [recipe.frame("final")[0][0] for recipe in figure.recipes if recipe.shown]
        assert figure.draw or sum(sorted(shown)[-(figure.columns or len(shown)) :]) >= 1280


def test_an_index_of_nothing(tmp_path):
    assert "0 figures" in index.write(tmp_path).read_text()


def test_what_a_figure_renders_can_be_asked_for_elsewhere():
    """As JSON: also what its recipes change is known by name, each by one of its own."""
    changed = {}
    for figure in registry.FIGURES.values():
        for recipe in figure.recipes:
            request = run.request_of(recipe, "final")
            assert Request.from_record(json.loads(json.dumps(request.record()))) == request
            if recipe.change:
                assert changed.setdefault(request.change, recipe.change) == recipe.change
                assert changes.change_of(request.change) == recipe.change
    assert changed
