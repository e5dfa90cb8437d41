# SPDX-License-Identifier: GPL-3.0-or-later
"""What the pictures of a sweep show together: table, contact sheet, page and film."""

import csv
import json
import re
import shutil
import subprocess

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest

from nim_addon.cycles.render import pixels_of
from nim_addon.sweeps import film, page, plan, results, run, sheet, table
from nim_addon.sweeps.plan import Task

COLORS = {"-2": (1.0, 0.0, 0.0), "-1": (0.0, 1.0, 0.0), "1": (0.0, 0.0, 1.0), "2": (1.0, 1.0, 0.0)}


@pytest.fixture
def done(spheres, tmp_path):
    """Four tasks that are done, each of a colour."""
    tasks = spheres(*COLORS)
    for task in tasks:
        exr = results.image_of(tmp_path, task)
        exr.parent.mkdir(parents=True, exist_ok=True)
        for file, form in ((exr, oiio.FLOAT), (exr.with_suffix(".png"), oiio.UINT8)):
            image = oiio.ImageBuf(oiio.ImageSpec(24, 18, 3, form))
            oiio.ImageBufAlgo.fill(image, COLORS[task.values["n"]])
            image.write(str(file))
        results.finish(tmp_path, task, results.Made(1.5, "here", "4.5.0", "nodes"))
    return tasks


def read(file):
    with open(file, newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def test_the_table_has_a_line_for_each(done, spheres, tmp_path):
    files, versions = run.collect([*done, *spheres(-3)], tmp_path, ["mean", "red"])
    assert versions == ["Blender 4.5.0 (Blender's own nodes)"]
    lines = read(tmp_path / "table.csv")
    assert [line["n"] for line in lines] == list(COLORS)  # what is not done has none
    assert [float(line["red"]) for line in lines] == [1, 0, 0, 1]
    assert [round(float(line["mean"]), 6) for line in lines] == [0.333333, 0.333333, 0.333333, 0.666667]
    assert (tmp_path / lines[0]["file"]).is_file() and lines[0]["host"] == "here"
    assert {"table.csv", "sheet.png", "index.html"} <= {file.name for file in files}


def test_the_table_as_parquet(done, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    table.write(tmp_path, table.rows(tmp_path, done))
    assert parquet.read_table(tmp_path / "table.parquet").column("n").to_pylist() == list(COLORS)


def test_the_sheet_has_captions_under_the_pictures(done, tmp_path):
    assert sheet.columns_of(done) == 2
    pixels = oiio.ImageBuf(str(sheet.write(tmp_path, done))).get_pixels(oiio.UINT8)
    height, width = pixels.shape[:2]
    for place, color in enumerate(COLORS.values()):
        row, column = divmod(place, 2)
        assert pixels[row * height // 2 + 60, column * width // 2 + 60].tolist() == [round(255 * c) for c in color]
    below = pixels[245:265, :200].mean(axis=2)  # a caption is dark on white
    assert below.max() == 255 and below.min() < 80


def test_the_sheet_is_level_however_long_its_captions_are(spheres, tmp_path):
    (task,) = spheres(-1)
    tasks = [Task(task.request, {"n": n}) for n in ("-1.5", "n=-1.5, " * 9)]  # not done: dark
    pixels = oiio.ImageBuf(str(sheet.write(tmp_path, tasks))).get_pixels(oiio.UINT8)
    assert not pixels[:240, : sheet.WIDTH].any() and not pixels[:240, -sheet.WIDTH :].any()
    assert pixels[240:, -3:].min() > 250  # the longest is not cut off


def test_the_sheet_of_too_many_has_some_from_all_along(done, tmp_path, monkeypatch):
    monkeypatch.setattr(sheet, "MOST", 2)
    pixels = oiio.ImageBuf(str(sheet.write(tmp_path, done))).get_pixels(oiio.UINT8)
    assert 2 * sheet.WIDTH <= pixels.shape[1] < 3 * sheet.WIDTH
    for place, color in ((0, (255, 0, 0)), (1, (0, 0, 255))):  # the first and the third
        assert tuple(pixels[60, place * pixels.shape[1] // 2 + 60]) == color


def test_columns_are_the_values_of_what_runs_fastest(spheres):
    (task,) = spheres(-1)
    tasks = [Task(task.request, {"n": n, "mu": mu}) for n in "ab" for mu in "cde"]
    assert sheet.columns_of(tasks) == 3 and sheet.columns_of(tasks[:5]) == 3 and sheet.columns_of(tasks[:1]) == 1
    long = [Task(task.request, {"n": n, "seed": str(seed)}) for n in "ab" for seed in range(200)]
    assert sheet.columns_of(long) == 20  # a row of 200 would be no picture


@pytest.mark.parametrize("suffix", film.FORMS)
def test_the_film_has_the_pictures_as_frames(done, tmp_path, suffix):
    pictures = [results.image_of(tmp_path, task).with_suffix(".png") for task in done]
    scenes = len(bpy.data.scenes)
    file = film.write(tmp_path / f"film{suffix}", pictures, 12)
    assert len(bpy.data.scenes) == scenes
    clip = bpy.data.movieclips.load(str(file))
    assert (tuple(clip.size), clip.frame_duration, clip.fps) == ((24, 18), 4, 12)
    bpy.data.movieclips.remove(clip)


def test_a_film_of_another_kind_is_refused():
    with pytest.raises(ValueError, match=r"name it .mp4, .webm or .mkv"):
        film.check("sweep.gif", (24, 18))
    with pytest.raises(ValueError, match="cannot name a file"):
        film.check("swe\nep.mp4", (24, 18))
    for size in ((24, 15), (15, 24)):
        with pytest.raises(ValueError, match="16 x 16 are the least"):
            film.check("sweep.mp4", size)
    film.check("sweep.mp4", (16, 16))


def frames_of(file, size, count):
    """The frames of a film, arrays (H, W, 3)."""
    scene = bpy.data.scenes.new("Film")
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.view_settings.view_transform = "Raw"
    editor = scene.sequence_editor_create()
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    strips.new_movie("film", str(file), channel=1, frame_start=1)
    found = []
    for frame in range(1, count + 1):
        scene.frame_set(frame)
        with bpy.context.temp_override(scene=scene):  # else it is rendered at the frame of the scene that is shown
            found.append(pixels_of(scene)[..., :3])
    bpy.data.scenes.remove(scene)
    return found


def test_the_frames_of_a_film_are_in_order(done, tmp_path):
    pictures = [results.image_of(tmp_path, task).with_suffix(".png") for task in done]
    assert len({picture.parent for picture in pictures}) > 1
    file = film.write(tmp_path / "film.mkv", pictures, 24)  # without loss
    for found, color in zip(frames_of(file, (24, 18), 4), COLORS.values(), strict=True):
        assert np.abs(found.mean(axis=(0, 1)) - color).max() < 0.02


def test_a_film_of_pictures_of_other_sizes_and_of_one_that_is_missing(tmp_path):
    """It has the size of the first, made even; a smaller one lies in the middle, a larger one is cut, what is none is magenta."""
    handlers = len(bpy.app.handlers.render_pre)
    sizes, pictures = [(33, 25), (17, 17), None, (65, 49)], []
    for number, size in enumerate(sizes):
        pictures.append(tmp_path / f"{number}.png")
        if size:
            image = oiio.ImageBuf(oiio.ImageSpec(*size, 3, oiio.UINT8))
            oiio.ImageBufAlgo.fill(image, (1.0, 0.0, 0.0))
            image.write(str(pictures[-1]))
    file = film.write(tmp_path / "film.mkv", pictures, 24)
    clip = bpy.data.movieclips.load(str(file))
    assert tuple(clip.size) == (32, 24)
    bpy.data.movieclips.remove(clip)
    first, small, none, large = frames_of(file, (32, 24), 4)
    for whole in (first, large):
        assert whole.shape == (24, 32, 3) and whole[..., 0].min() > 0.95 and whole[..., 1:].max() < 0.05
    assert none[12, 16, 0] > 0.3 and none[12, 16, 2] > 0.3 and none[..., 1].max() < 0.05
    assert len(bpy.app.handlers.render_pre) == handlers
    assert small[6:18, 10:22, 0].min() > 0.95 and max(small[:2].max(), small[:, :6].max(), small[:, -6:].max()) < 0.05


def test_a_film_that_blender_does_not_write_is_said(tmp_path):
    picture = tmp_path / "small.png"
    oiio.ImageBuf(oiio.ImageSpec(8, 6, 3, oiio.UINT8)).write(str(picture))
    with pytest.raises(RuntimeError, match=r"^Blender did not write the film: Image too small\.$"):
        film.write(tmp_path / "film.mp4", [picture], 24)
    assert [file.name for file in tmp_path.iterdir()] == ["small.png"]


# ------------------------------------------------------------------------------------------------ the page


def test_the_page_holds_the_data_whatever_it_says(done, tmp_path):
    lines = table.rows(tmp_path, done, ["mean"])
    lines[0]["host"] = "</script><b>"
    text = page.write(tmp_path, "sphere by <n>", lines, ["n"], ["mean"]).read_text()
    assert text.count("</script>") == 2 and "<title>sphere by &lt;n&gt;</title>" in text
    data = json.loads(re.search(r'id="data">(.*?)</script>', text)[1])
    assert data["axes"] == [["n", list(COLORS)]] and data["facts"]["host"][:2] == ["</script><b>", "here"]
    assert (data["facts"]["backend"], data["facts"]["mean"]) == ("nodes", [0.333333, 0.333333, 0.333333, 0.666667])
    assert "http" not in text.replace("http://www.w3.org/2000/svg", "")  # no network


def seen(file, address="", script=""):
    """What a browser makes of a page, once a script has run in it: its document as text."""
    copy = file.with_name("tried.html")
    copy.write_text(file.read_text().replace("</html>", f"<script>{script}</script></html>"))
    words = ["chromium", "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={file.parent / 'browser'}"]
    done = subprocess.run(
        [*words, "--dump-dom", f"{copy.as_uri()}{address}"], capture_output=True, text=True, timeout=120
    )
    return done.stdout


def shown(dom):
    """What the picture of a page is called, and its file."""
    return re.search(r'<img id="picture" alt="([^"]*)" src="([^"]*)"', dom).groups()


def slide(**values):
    """A script that moves sliders to places."""
    return "".join(
        f'{{ const s = document.querySelector("input[name={name}]"); s.value = {place};'
        ' for (const told of ["input", "change"]) s.dispatchEvent(new Event(told)); }'
        for name, place in values.items()
    )


@pytest.mark.skipif(not shutil.which("chromium"), reason="needs a browser, chromium")
def test_the_page_in_a_browser(done, tmp_path):
    """Its sliders show the picture of the values that they stand at, and so does its address."""
    lines = table.rows(tmp_path, done, ["red"])
    lines[1]["red"] = None  # what could not be measured
    file = page.write(tmp_path, "sphere by n", lines, ["n"], ["red"])
    files = [results.image_of(tmp_path, task).relative_to(tmp_path).with_suffix(".png").as_posix() for task in done]
    first = seen(file)
    assert shown(first) == ("n = -2", files[0]) and "<td>red</td><td>1</td>" in first
    second = seen(file, "#n=-1")
    assert shown(second) == ("n = -1", files[1]) and "<td>host</td><td>here</td>" in second
    assert "<td>red</td>" not in second and second.count("<circle") == 3
    told = "document.title = location.hash + document.querySelector('g circle').getAttribute('cx');"
    dom = seen(file, "", slide(n=3) + told)
    assert shown(dom) == ("n = 2", files[3]) and "<title>#n=2780</title>" in dom  # the mark is at the curve's end
    assert dom.count("<circle") == 4 and dom.count("<polyline") == 1
    missing = seen(file, "#n=1", "found.clear(); show();")
    assert '<p id="missing">' in missing


@pytest.mark.skipif(not shutil.which("chromium"), reason="needs a browser, chromium")
def test_a_page_of_many_pictures_in_a_browser(tmp_path):
    """A point of a grid has its own picture, facts and curve, and a curve of many points is few of them."""
    lines = [
        {
            "n": str(n),
            "mu": str(mu),
            "file": f"images/{n}-{mu}.exr",
            "seconds": n + mu / 4,
            "red": 1.0 * (n == 777) + mu,
        }
        for n in range(5000)
        for mu in range(2)
        if (n, mu) != (3, 1)
    ]
    file = page.write(tmp_path, "sphere by n, mu", lines, ["n", "mu"], ["red"])
    dom = seen(file, "", slide(n=1234, mu=1))
    assert shown(dom) == ("n = 1234, mu = 1", "images/1234-1.png") and "<td>seconds</td><td>1234.25</td>" in dom
    ((points,), (label,)) = re.findall(r'points="([^"]*)"', dom), re.findall(r'x="54" y="34"[^>]*>([^<]*)', dom)
    heights = {point.split(",")[1] for point in points.split()}
    assert len(points.split()) <= 1600 and heights == {"30", "150"} and label == "2"  # the one that differs is in it
    assert '<p id="missing">' in seen(file, "#n=3&mu=1")


def test_a_plan_in_two_versions_of_blender_is_named(done, tmp_path):
    results.finish(tmp_path, done[0], results.Made(1.0, "there", "5.0.1", "osl"))
    assert run.collect(done, tmp_path, [])[1] == ["Blender 4.5.0 (Blender's own nodes)", "Blender 5.0.1 (OSL)"]


def test_pictures_in_parts_are_shown_once(done):
    assert plan.pictures([*plan.split(done[0], 2), done[1]]) == done[:2]
