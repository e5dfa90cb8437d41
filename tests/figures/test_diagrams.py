# SPDX-License-Identifier: GPL-3.0-or-later
"""Ray diagrams: every claim holds and can fail, what is drawn is what was traced, and the files are whole."""

import errno
import math
import os
import sys

import numpy as np
import pytest

from nim_addon.base.files import whole
from nim_addon.figures import diagram_parts, diagram_paths, diagrams, drawing
from nim_addon.physics import Medium, deviation, interface
from nim_addon.physics.rays import Fate, Kind

FIGURES = {figure.number: figure for figure in diagrams.FIGURES}


@pytest.mark.parametrize("number", FIGURES)
def test_every_claim_holds(number):
    claims = FIGURES[number].measure({})
    assert claims
    for claim in claims:
        assert all(isinstance(value, int | float) for value in claim[1:4])
        assert claim.holds, claim.row()


@pytest.mark.parametrize("number", FIGURES)
def test_claims_fail_where_snell_has_lost_its_sign(number, monkeypatch):
    right = interface.refracted

    def refracted(d, normal, cos_i, n_i, n_t):
        return right(d, normal, cos_i, np.abs(n_i), np.abs(n_t))

    for module in ("interface", "rays"):
        monkeypatch.setattr(f"nim_addon.physics.{module}.refracted", refracted)
    claims = FIGURES[number].measure({})
    assert all(claim.holds for claim in claims if not claim.text.startswith("NIM"))
    assert sum(not claim.holds for claim in claims) >= 3


def test_claims_fail_where_too_much_is_reflected(monkeypatch):
    right = interface.reflectances

    def reflectances(*given):
        return tuple(R + 0.01 * (1 - R) for R in right(*given))

    for module in ("interface", "rays"):
        monkeypatch.setattr(f"nim_addon.physics.{module}.reflectances", reflectances)
    failing = [claim.text for claim in FIGURES["B.1"].measure({}) if not claim.holds]
    assert len(failing) == 2 and all("energy" in text for text in failing)


@pytest.mark.parametrize(("n", "focus"), [(1.5, 1.5), (2.0, 1.0), (-1.5, 0.3), (-1.0, 0.25)])
def test_focal_length_of_a_ball(n, focus):
    assert diagram_paths.focal_length(n) == pytest.approx(focus)
    paths = diagram_paths.sphere_paths(Medium(n), [1e-4], branches=False, bounces=2)
    point, d = paths.start[-1], paths.direction[-1]
    assert point[0] - point[1] * d[0] / d[1] == pytest.approx(focus, abs=1e-6)


def drawn(monkeypatch, scene, **options):
    """The axes and the Paths of a diagram, before it becomes a file."""
    pytest.importorskip("matplotlib")
    taken = {}
    draw_paths = diagram_parts.draw_paths

    def kept(ax, paths, **more):
        taken.update(ax=ax, paths=paths)
        draw_paths(ax, paths, **more)

    monkeypatch.setattr(diagram_parts, "draw_paths", kept)
    monkeypatch.setattr(diagrams, "save", lambda figure, title, *files: list(files))
    diagrams.diagram(scene, **options)
    return taken["ax"], taken["paths"]


def texts(ax):
    return [text.get_text() for text in (*ax.texts, *ax.get_legend().get_texts())]


@pytest.mark.parametrize(("n", "angle"), [(1.5, "40°"), (-1.5, "40°"), (1.33, "40°")])
def test_a_single_ray_has_its_angles(n, angle, monkeypatch):
    ax, _ = drawn(monkeypatch, "slab", n=n, rays=1)
    inner = round(math.degrees(math.asin(math.sin(math.radians(40)) / n)), 1)
    assert [text for text in texts(ax) if "theta" in text] == [
        f"$\\theta_i$ = {angle}",
        f"$\\theta_t$ = {str(inner).replace('-', '−')}°",  # noqa: RUF001
    ]


@pytest.mark.parametrize("n", [1.5, -1.5])
def test_a_prism_bends_by_snells_law(n, monkeypatch):
    _, paths = drawn(monkeypatch, "prism", n=n, rays=1)
    out = paths.direction[diagram_paths.transmitted_way(paths, 0)[-1]]
    turned = math.degrees(math.atan2(out[1], out[0]))
    assert turned == pytest.approx(20 - math.degrees(math.asin(n * math.sin(math.radians(20)))), abs=1e-9)


@pytest.mark.parametrize("medium, side", [("n-bk7", -1), ("nim-mirror", 1), ("nim-causal", 1)])
def test_a_prism_sorts_white_light_by_the_closed_form(medium, side, monkeypatch):
    ax, _ = drawn(monkeypatch, "prism", inside=Medium.parse(medium), spectrum=True)
    n, apex = Medium.parse(medium).n, deviation.apex_for(Medium.parse(medium).n)
    incidence = deviation.incidence_for(n, apex)
    seen = 0
    for wavelength in diagram_parts.SPECTRUM:
        turned = float(deviation.prism(Medium.parse(medium).at(wavelength).n, apex, incidence))
        slope = math.tan(incidence - apex / 2 - turned)
        colour = diagram_parts.line_colour(wavelength)
        lines = [part for part in ax.collections if np.allclose(part.get_colors()[0][:3], colour, atol=1e-6)]
        ends = np.concatenate([np.reshape(part.get_segments(), (-1, 2, 2)) for part in lines])
        out = ends[(ends[:, 0, 0] > 0) & (ends[:, 1, 0] > 1)]  # from the second face to the right
        slopes = (out[:, 1, 1] - out[:, 0, 1]) / (out[:, 1, 0] - out[:, 0, 0])
        seen += np.any(np.abs(slopes - slope) < 1e-9)
        assert np.sign(turned) == -side
    assert seen >= (len(diagram_parts.SPECTRUM) if medium != "nim-causal" else 7)  # some of it leaves the view above


def test_white_light_is_black_until_a_surface_sorts_it(monkeypatch):
    ax, paths = drawn(monkeypatch, "prism", spectrum=True)
    white = [part for part in ax.collections if np.allclose(part.get_colors()[0][:3], 0x1A / 255, atol=1e-6)]
    assert sum(len(part.get_segments()) for part in white) == 2  # that arrives, and that is mirrored at once
    coloured = [line for part in ax.collections if part not in white for line in part.get_segments()]
    arrives = paths.end[0, :2]
    assert len(coloured) > 2 * len(diagram_parts.SPECTRUM)
    assert not any(np.allclose(line[1], arrives) for line in coloured)


@pytest.mark.parametrize("scene", diagrams.SCENES)
def test_the_key_of_a_spectrum_lies_within_the_picture(scene, monkeypatch):
    ax, _ = drawn(monkeypatch, scene, spectrum=True)
    figure = ax.get_figure()
    (key,) = figure.legends
    figure.draw_without_rendering()
    box = key.get_window_extent()
    assert 0 <= box.x0 < box.x1 <= figure.bbox.width
    names = [text.get_text() for text in key.get_texts()]
    assert names == ["white", "400", "450", "500", "550", "600", "650", "700 nm", "reflected"]
    for first, second in zip(key.get_texts(), key.get_texts()[1:], strict=False):
        assert first.get_window_extent().x1 < second.get_window_extent().x0


def test_colours_of_lines_keep_their_order_and_show_on_white():
    hues = [diagram_parts.line_colour(wavelength) for wavelength in (450, 530, 630)]
    assert [int(np.argmax(hue)) for hue in hues] == [2, 1, 0]
    for wavelength in diagram_parts.SPECTRUM:
        linear = ((np.array(diagram_parts.line_colour(wavelength)) + 0.055) / 1.055) ** 2.4
        assert linear @ (0.2126, 0.7152, 0.0722) < 0.45


@pytest.mark.parametrize(
    "options, words",
    [
        ({"spectrum": True, "n": -1.5}, ("has no spectrum", "n-bk7")),
        ({"spectrum": True, "inside": Medium(-1.5)}, ("has no spectrum", "n-bk7")),
        ({"inside": Medium(-1.5), "mu": -1}, ("given once",)),
        ({"spectrum": True, "inside": Medium.parse("silver")}, ("silver is a mirror at 400 nm",)),
        ({"inside": Medium.parse("gold")}, ("gold is a mirror at 550 nm",)),
        ({"inside": Medium(-1.5 + 0.1j)}, ("is a mirror at 550 nm",)),
    ],
)
def test_what_has_no_spectrum_is_one_sentence(options, words, tmp_path, one_sentence):
    pytest.importorskip("matplotlib")
    with pytest.raises(ValueError) as raised:
        diagrams.diagram("prism", file=tmp_path / "x.svg", **options)
    one_sentence(raised.value, *words)
    assert not list(tmp_path.iterdir())


def test_a_slab_of_index_minus_one_is_veselagos_lens(monkeypatch):
    _, paths = drawn(monkeypatch, "slab", n=-1, rays=9)
    for depth, image in ((1, 0.5), (2, 1.5)):
        here = paths.depth == depth
        start, d = paths.start[here], paths.direction[here]
        np.testing.assert_allclose(start[:, 1] + (image - start[:, 0]) * d[:, 1] / d[:, 0], 0, atol=1e-8)
        np.testing.assert_allclose(paths.energy[here], 1)


def test_lines_weigh_what_their_energy_is_and_stay_in_the_view(monkeypatch):
    ax, paths = drawn(monkeypatch, "sphere", n=-1.5, rays=5)
    widths = np.concatenate([lines.get_linewidths() for lines in ax.collections])
    segments = np.concatenate([np.array(lines.get_segments()) for lines in ax.collections])
    assert len(widths) == len(segments) == len(paths.energy)
    assert widths.max() == pytest.approx(1.8)
    np.testing.assert_allclose(np.sort(np.square(widths / 1.8)), np.sort(paths.energy))
    assert np.all(segments >= (ax.get_xlim()[0] - 1e-9, ax.get_ylim()[0] - 1e-9))
    assert np.all(segments <= (ax.get_xlim()[1] + 1e-9, ax.get_ylim()[1] + 1e-9))


@pytest.mark.parametrize("scene", diagrams.SCENES)
def test_lines_thin_where_light_is_absorbed(scene, monkeypatch):
    if scene not in ("sphere", "slab", "pool", "prism"):
        pytest.skip("draws no medium of one's own")
    ax, paths = drawn(monkeypatch, scene, inside=Medium.parse("n=-1.5,length=0.7"), rays=3)
    lossy = paths.arriving < paths.energy
    widths = np.concatenate([lines.get_linewidths() for lines in ax.collections])
    segments = np.concatenate([np.array(lines.get_segments()) for lines in ax.collections])
    assert lossy.any() and len(widths) >= 24 * lossy.sum() / 2
    # each piece has the weight of the light in its middle, by Beer and Lambert from where its segment starts
    fades = 0
    for start, end, energy in zip(paths.start[lossy], paths.end[lossy], paths.energy[lossy], strict=True):
        middle = segments.mean(axis=1)
        way = (end - start)[:2]
        along = (middle - start[:2]) @ way / (way @ way)
        on = (np.linalg.norm(middle - start[:2] - along[:, None] * way, axis=1) < 1e-9) & (along > 0) & (along < 1)
        wanted = 1.8 * np.sqrt(energy * np.exp(-along * np.linalg.norm(end - start) / 0.7))
        fades += int((np.abs(widths - wanted) < 1e-3)[on].sum())
    assert fades >= 0.9 * np.sum(len(widths) - np.sum(~lossy))
    assert any("1/e in 0.7 m" in text for text in texts(ax))


def test_media_are_named_with_index_and_permeability(monkeypatch):
    for options, name in (
        ({"n": 1.33}, "water, $n$ = 1.33"),
        ({"n": -1.33, "mu": -10}, "NIM, $n$ = −1.33, $\\mu$ = −10"),  # noqa: RUF001
        ({"n": 1.7}, "medium, $n$ = 1.7"),
    ):
        ax, _ = drawn(monkeypatch, "pool", **options)
        assert {"air, $n$ = 1", name, "window to 48.75°"} - {"window to 48.75°"} <= set(texts(ax))
        assert ("window to 48.75°" in texts(ax)) == (options["n"] in (1.33, -1.33))


@pytest.mark.parametrize("n", [1.33, -1.33])
@pytest.mark.parametrize("rays", range(1, 8))
def test_a_few_rays_meet_the_surface_in_the_picture_and_refract(rays, n, monkeypatch):
    ax, paths = drawn(monkeypatch, "pool", n=n, rays=rays)
    meets = paths.end[paths.kind == Kind.INCIDENT]
    np.testing.assert_allclose(meets[:, 1], 0, atol=1e-9)
    assert np.all(np.abs(meets[:, 0]) < ax.get_xlim()[1])
    assert np.sum(paths.kind == Kind.TRANSMITTED) >= min(rays, 3) - (rays == 4)


@pytest.mark.parametrize("rays", [1, 21])
@pytest.mark.parametrize(("n", "mu"), [(None, None), (-1.3333, -12.5), (-1.31415e-5, -1.23456e-5)])
@pytest.mark.parametrize("scene", diagrams.SCENES)
def test_no_name_covers_the_title(scene, n, mu, rays, monkeypatch):
    ax, _ = drawn(monkeypatch, scene, n=n, mu=mu, rays=rays)
    figure = ax.get_figure()
    figure.draw_without_rendering()
    title = diagrams.SCENES[scene].title if rays > 1 else diagrams.SCENES[scene].title_of_one
    (head,) = [part for part in ax.get_children() if getattr(part, "get_text", str)() == title]
    head, media = head.get_window_extent(), ax.get_legend().get_window_extent()
    assert not head.overlaps(media)
    for box in (head, media):
        assert box.x0 >= 0 and box.x1 <= figure.bbox.x1 and ax.bbox.y1 <= box.y0 and box.y1 <= figure.bbox.y1
    # a line of its own only where it needs one
    assert (head.y0 > media.y1) == (head.width + media.width + 12 > ax.bbox.width)


def test_a_permeability_sends_more_back(monkeypatch):
    shares = []
    for mu in (-1, -10, -25):
        _, paths = drawn(monkeypatch, "pool", n=-1.33, mu=mu, rays=1)
        shares.append(paths.energy[(paths.kind == Kind.REFLECTED) & (paths.fate == Fate.LANDED)].sum())
    assert shares[0] < 0.05 and shares[1] > 0.5 and shares[2] > 0.75


@pytest.mark.parametrize("suffix", ["svg", "pdf"])
def test_files_are_the_same_each_time(suffix, tmp_path):
    pytest.importorskip("matplotlib")
    file, again = (diagrams.diagram("prism", rays=3, file=tmp_path / f"{name}.{suffix}") for name in "ab")
    assert file.read_bytes() == again.read_bytes() and len(file.read_bytes()) > 5000
    assert sorted(tmp_path.iterdir()) == [file, again]


def test_a_figure_is_two_files_that_say_what_they_are(tmp_path):
    pytest.importorskip("matplotlib")
    svg, png = FIGURES["5.8"].draw(tmp_path)
    assert (svg.name, png.name) == ("figure-5.8.svg", "figure-5.8.png")
    text = svg.read_text()
    assert "<!-- transmitted -->" in text and "<!-- window to 48.75° -->" in text  # words beside their outlines
    assert "<title>Figure 5.8: Rays from a point" in text and "date" not in text
    assert png.read_bytes()[:4] == b"\x89PNG"


@pytest.mark.parametrize("rays", [1, 2, 101])
@pytest.mark.parametrize(
    ("scene", "n"), [("sphere", -4.1), ("sphere", 0.7), ("pool", -0.7), ("slab", 1.0), ("prism", -9)]
)
def test_unusual_media_are_drawn(scene, n, rays, monkeypatch):
    ax, paths = drawn(monkeypatch, scene, n=n, rays=rays)
    assert len(paths.lost) == rays and ax.collections


@pytest.mark.parametrize("scene", diagrams.SCENES)
@pytest.mark.parametrize(("n", "mu"), [(-1.5, -600), (400, 1), (-1.5, -1e-3)])
def test_what_lets_no_light_in_is_drawn(scene, n, mu, monkeypatch):
    for rays in (1, 2):
        _, paths = drawn(monkeypatch, scene, n=n, mu=mu, rays=rays)
        assert Kind.REFLECTED in paths.kind


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"scene": "mirror"}, ("mirror", "sphere, pool, slab, prism, drop, lens, lamp")),
        ({"rays": 0}, ("rays = 0", "1 to 101")),
        ({"rays": 102}, ("rays = 102", "1 to 101")),
        ({"rays": 2.5}, ("rays = 2.5", "1 to 101")),
        ({"rays": "many"}, ("rays = many",)),
        ({"n": 0}, ("n = 0",)),
        ({"n": -1.5, "mu": 2}, ("mu = 2",)),
        ({"n": 1.5 + 0.01j}, ("n=1.5+0.01j is a mirror at 550 nm", "k below 0.001")),
        ({"file": "x.jpg"}, ("x.jpg", ".svg, .png, .pdf", "rays.svg")),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_a_sentence(options, words, tmp_path, one_sentence):
    file = tmp_path / options.get("file", "x.svg")
    with pytest.raises(ValueError) as raised:
        diagrams.diagram(**{"scene": "sphere"} | options | {"file": file})
    if "mu" not in options and options.get("n") != 0:  # Medium's own words
        one_sentence(raised.value, *words)
    assert words[0] in str(raised.value) and not list(tmp_path.iterdir())


def test_where_nothing_can_be_written_the_folder_is_named(tmp_path, one_sentence):
    pytest.importorskip("matplotlib")
    (tmp_path / "afile").write_text("kept")
    (tmp_path / "d.svg").mkdir()
    for name, words in {
        "afile/x.svg": (f"cannot write into {tmp_path / 'afile'}", "name another folder"),
        "afile/below/x.svg": ("afile/below: Not a directory", "name another folder"),
        "d.svg": ("d.svg is a folder", "name a file in it"),
    }.items():
        with pytest.raises(OSError) as raised:
            diagrams.diagram("slab", file=tmp_path / name)
        assert "part" not in one_sentence(raised.value, *words)

    def full(part):
        part.write_text("half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(part))

    with pytest.raises(OSError) as raised:
        whole(tmp_path / "x.svg", full)
    assert "part" not in one_sentence(raised.value, f"into {tmp_path}: No space left on device", "name another folder")
    assert sorted(file.name for file in tmp_path.rglob("*")) == ["afile", "d.svg"]


def test_a_tilde_is_the_home(tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    assert diagrams.diagram("slab", file="~/x.svg") == tmp_path / "x.svg"


def test_a_folder_is_no_name_of_a_drawing(one_sentence):
    for file in (".", "..", "/"):
        with pytest.raises(ValueError) as raised:
            drawing.known_suffix(file)
        assert one_sentence(raised.value).startswith(f"{file!r} ends in none of")


def test_without_matplotlib_it_says_so(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(RuntimeError, match=r"matplotlib is missing.*pip install matplotlib"):
        diagrams.diagram("sphere", file=tmp_path / "x.svg")
    assert not list(tmp_path.iterdir())
