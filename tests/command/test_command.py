# SPDX-License-Identifier: GPL-3.0-or-later
"""The command, run as a person runs it."""

import argparse
import csv
import importlib.util
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from nim_addon import cli
from nim_addon.base import signals
from nim_addon.cycles import material
from nim_addon.cycles.render import read_metadata
from nim_addon.physics import Interface, Medium
from nim_addon.scenes import scene_type

ROOT = Path(__file__).parents[2]
SMALL = ("--size", "32x24", "--samples", "4")

spec = importlib.util.spec_from_file_location("build", ROOT / "build.py")
build = importlib.util.module_from_spec(spec)
spec.loader.exec_module(build)


def nimray(*words, where=None, instead=None, temporary=None, **more):
    """Run the command; `instead` is a folder of modules that stand in for installed ones, `temporary` that of the system."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, filter(None, (instead, ROOT))))}
    if temporary:
        environment["TMPDIR"] = str(temporary)
    return subprocess.run(
        [sys.executable, "-m", "nim_addon", *map(str, words)],
        capture_output=True,
        text=True,
        cwd=where,
        env=environment,
        timeout=120,
        **more,
    )


def pixels(path):
    return oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT)


def test_render_info_again(tmp_path):
    done = nimray("render", "sphere", "--set", "n=-1.33", "companions=yes", "--seed", 7, *SMALL, where=tmp_path)
    assert done.returncode == 0, done.stderr
    first = tmp_path / "renders" / "sphere_n--1.33_companions-yes.exr"
    assert done.stdout.split() == [
        str(first.relative_to(tmp_path)),
        str(first.with_suffix(".png").relative_to(tmp_path)),
    ]
    assert done.stderr == ""  # piped: no progress, and nothing of Blender's own

    info = json.loads(nimray("info", first, "--json").stdout)
    assert info["scene"] == "sphere"
    assert info["parameters"] == {"n": -1.33, "mu": -1.0, "companions": True, "sun_angle": 16.0}
    assert (info["size"], info["samples"], info["seed"], info["denoise"]) == ([32, 24], 4, 7, False)

    again = nimray("render", "--again", first, "--out", tmp_path / "b", "--quiet")
    assert (again.returncode, again.stdout, again.stderr) == (0, "", "")
    second = tmp_path / "b" / f"{first.stem}_again.exr"
    # the same paths, but for float rounding in the order of sums
    assert np.median(np.abs(pixels(first) - pixels(second))) < 1e-6
    assert json.loads(nimray("info", second, "--json").stdout) == info


def test_caustics_traced_from_the_sun(tmp_path):
    """Under water a sun of half a degree gives nothing by chance: traced, its light is on the walls, and recorded."""
    setting = ("--set", "sky=sunny", "sun_angle=0.53", "view=window", "waves=0.05", "--size", "48x36", "--samples", "4")
    walls = {}
    for way, *more in (("traced", "--photons", "400000"), ("path",)):
        done = nimray("render", "pool", *setting, "--caustics", way, *more, "--out", tmp_path, "--name", way)
        assert done.returncode == 0, done.stderr
        picture = pixels(tmp_path / f"{way}.exr")
        walls[way] = np.median(np.concatenate([picture[-6:], picture[:4]])[..., 1])
    info = json.loads(nimray("info", tmp_path / "traced.exr", "--json").stdout)
    assert (info["caustics"], info["photons"]) == ("traced", 400000)
    assert walls["traced"] > 1.3 * walls["path"]


def test_frames_make_a_sequence_and_what_is_there_stays(tmp_path, capsys):
    """The waves move, the noise differs, a run that stopped goes on where it was, and any frame can be made again."""
    line = ["render", "sea", "--set", "time=1", "--frames", "11-12", "--fps", "20", "--seed", "5"]
    line += [*SMALL, "--out", str(tmp_path), "--name", "w"]
    done = nimray(*line, "--progress")
    assert (done.returncode, done.stderr) == (0, "")
    *said, last = map(json.loads, done.stdout.splitlines())
    assert last["files"] == [
        str(tmp_path / f"w_{frame:04}.{suffix}") for frame in (11, 12) for suffix in ("exr", "png")
    ]
    assert {(one["frame"], one["frames"], one["total"]) for one in said} == {(11, 2, 8), (12, 2, 8)}
    assert said[0]["done"] == 0 and said[-1]["done"] == 8

    first, second = (tmp_path / f"w_{frame:04}.exr" for frame in (11, 12))
    records = [read_metadata(file) for file in (first, second)]
    assert [(record["parameters"]["time"], record["seed"]) for record in records] == [(1.5, 16), (1.55, 17)]
    kept, former = first.stat().st_mtime_ns, pixels(second)
    second.with_suffix(".png").write_bytes(second.with_suffix(".png").read_bytes()[:1000])  # cut off
    assert cli.main(line) == 0
    printed = capsys.readouterr()
    assert printed.err == f"nimray: {first} is there already.\n"
    assert printed.out.split() == last["files"]
    assert first.stat().st_mtime_ns == kept
    assert np.median(np.abs(pixels(second) - former)) < 1e-6

    assert cli.main(["render", "--again", str(second), "--out", str(tmp_path), "--name", "again", "--quiet"]) == 0
    assert np.median(np.abs(pixels(tmp_path / "again.exr") - former)) < 1e-6
    assert sorted(path.name for path in tmp_path.iterdir() if path.suffix == ".exr") == [
        "again.exr",
        "w_0011.exr",
        "w_0012.exr",
    ]


@pytest.mark.parametrize("how", (signal.SIGINT, signal.SIGTERM))
def test_ctrl_c_or_a_kill_stops_at_once_and_leaves_nothing(how, tmp_path):
    run = subprocess.Popen(
        [sys.executable, "-m", "nim_addon", "render", "sphere", "--samples", "100000", "--out", str(tmp_path)],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 60
    while not list(tmp_path.glob(".sphere.*.part")) and time.monotonic() < deadline:
        time.sleep(0.1)
    time.sleep(1.5)
    run.send_signal(how)
    out, err = run.communicate(timeout=20)
    assert run.returncode == 128 + how
    assert out == ""
    assert err == "nimray: stopped.\n"
    assert not list(tmp_path.iterdir())


def standing_in(folder, module, how):
    """Make a module that, as it is imported, sends a signal to its own process and holds on to any exception."""
    (folder / f"{module}.py").write_text(f"""
import os, time
try:
    os.kill(os.getpid(), {how:d})
    time.sleep(20)
except BaseException:
    pass
""")


@pytest.mark.parametrize("how", (signal.SIGINT, signal.SIGTERM))
@pytest.mark.parametrize("module", ("numpy", "bpy"))
def test_ctrl_c_or_a_kill_stops_what_still_loads(module, how, tmp_path):
    """Their imports swallow exceptions: the render went on to its end."""
    standing_in(tmp_path, module, how)
    done = nimray("render", "sphere", where=tmp_path, instead=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (128 + how, "", "nimray: stopped.\n")


@pytest.mark.parametrize("how", (signal.SIGINT, signal.SIGTERM))
@pytest.mark.parametrize(
    ("command", "where"), (("figures 5.8 --out new", "new/5.8"), ("rays sphere --out new/a.svg", "new"))
)
def test_ctrl_c_or_a_kill_leaves_nothing_of_a_drawing(command, where, how, tmp_path):
    work = tmp_path / "work"
    work.mkdir()
    (tmp_path / "sitecustomize.py").write_text(f"""
import os, signal, sys, time
class Late:
    # the last thing that a drawing is written with
    def find_spec(self, name, path, target=None):
        if name == "matplotlib.backends.backend_svg":
            os.kill(os.getpid(), {how:d})
            time.sleep(20)
sys.meta_path.insert(0, Late())
""")
    done = nimray(*command.split(), where=work, instead=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (128 + how, "", "nimray: stopped.\n")
    assert not list((work / where).rglob("*"))


@pytest.mark.parametrize(
    ("command", "module", "how"),
    (
        ("scenes", None, 0),
        ("scenes", "nim_addon.scenes", signal.SIGHUP),
        ("scenes", "nim_addon.scenes", signal.SIGKILL),
        ("verify", "nim_addon.cycles.verify", signal.SIGINT),
    ),
)
def test_nothing_stays_in_the_temporary_folder(command, module, how, tmp_path):
    """Blender makes a folder there, which it takes away only where it ends by itself."""
    (tmp_path / "tmp").mkdir()
    if module:
        (tmp_path / "sitecustomize.py").write_text(f"""
import os, sys, time
class Late:
    def find_spec(self, name, path, target=None):
        if name == {module!r}:
            os.kill(os.getpid(), {how:d})
            time.sleep(20)
sys.meta_path.insert(0, Late())
""")
    done = nimray(command, where=tmp_path, instead=tmp_path, temporary=tmp_path / "tmp")
    if how == signal.SIGKILL:  # the next run takes it away
        assert list((tmp_path / "tmp").iterdir())
        done, how = nimray(command, temporary=tmp_path / "tmp"), 0
    assert done.returncode == (128 + how if how else 0)
    assert not list((tmp_path / "tmp").iterdir())


def test_a_second_import_of_blender_makes_no_folder(monkeypatch, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(signals, "_watched", lambda: None)
    with signals.importing():
        assert not list(tmp_path.iterdir())


def test_ctrl_c_while_python_learns_of_signals_stops_too(tmp_path):
    (tmp_path / "sitecustomize.py").write_text("""
import os, sys
class Early:
    def find_spec(self, name, path, target=None):
        if name == "enum":  # of the module signal
            os.kill(os.getpid(), 2)
sys.meta_path.insert(0, Early())
""")
    done = nimray("scenes", where=tmp_path, instead=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "nimray: stopped.\n")


def test_a_signal_after_the_work_is_done_is_none(tmp_path):
    """What Python takes down at its end runs without handlers: Ctrl-C then ended `rays` with -2."""
    (tmp_path / "sitecustomize.py").write_text("""
import os, signal, sys
class Last:
    def __del__(self, kill=os.kill, pid=os.getpid(), number=signal.SIGINT):
        kill(pid, number)
sys.last = Last()
""")
    done = nimray("rays", "slab", "--out", tmp_path / "slab.svg", where=tmp_path, instead=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")


REFUSED = [
    ("render sphere --photons 100", "--caustics traced"),
    ("render pool --caustics traced", "no light to trace"),
    ("render pool --photons 100", "--caustics traced"),
    ("render pool --set sky=sunny --caustics traced --photons 0", "out of range"),
    ("render", "name a scene"),
    ("render spere", "did you mean sphere?"),
    ("render sphere --set n=0", "n = 0 refracts nothing"),
    ("render sphere --set n=nan", "out of range"),
    ("render sphere --set n=round", "not a number"),
    ("render sphere --set n=-1.5 mu=1", "a negative index needs mu below 0"),
    ("render sphere --set index=2", "there is no parameter 'index'"),
    ("render sphere --set n", "write key=value"),
    ("render glass --set liquid=watr", "did you mean water?"),
    ("render glass --set view=sid", "did you mean side?"),
    ("render glass --set figures=/nowhere/bunny.ply", "there is no file"),
    ("render pool --set sky=dark", "there is no sky 'dark'"),
    ("render sphere --samples 0", "--samples 0 is out of range"),
    ("render sphere --samples -3", "--samples -3 is out of range"),
    ("render sphere --samples many", "not a whole number"),
    ("render sphere --size 0x10", "out of range"),
    ("render sphere --size 99999x10", "out of range"),
    ("render sphere --size big", "write it like 800x600"),
    ("render sphere --seed x", "not a whole number"),
    ("render sphere --name a/b", "cannot name a file"),
    ("render sphere --size 0%", "--size 0% is out of range; it lies between 1% and 100%"),
    ("render sphere --size 150%", "--size 150% is out of range"),
    ("render sphere --name " + 300 * "a", "300 letters is too long"),
    ("render sphere n=1.5", "n=1.5; parameters come after --set. Try `nimray render --help`"),
    ("compare pool --vary liquid=water,nim --samples 4 mu=-2", "after --set. Try `nimray compare --help`"),
    ("figures 5.8 --qualty final", "--qualty final. Try `nimray figures --help`"),
    ("rays sphere --angles", "--angles. Try `nimray rays --help`"),
    ("rays sphere n=1.5", "arguments: n=1.5. Try `nimray rays --help`"),
    ("--quiet scenes", "arguments: --quiet. Try `nimray --help`"),
    ("figures a.9", "did you mean A."),
    ("render SPERE", "did you mean sphere?"),
    ("render sphere --size half%", "not a whole number"),
    ("render sphere --quiet --progress", "not allowed with"),
    ("render pool --frames 48-1", "write it like 1-48"),
    ("render pool --frames x", "'x' is not a range"),
    ("render pool --frames 1-2-3", "is not a range"),
    ("render pool --frames 1-", "is not a range"),
    ("render pool --frames 0-3", "between 1 and 9999"),
    ("render pool --frames 1-10000", "between 1 and 9999"),
    ("render sphere --frames 1-2", "nothing moves in the sphere"),
    ("render glass --frames 1", "nothing moves in the glass"),
    ("render pool --frames 1-2 --fps 0", "between 0.01 and 1000"),
    ("render pool --frames 1-2 --fps nan", "between 0.01 and 1000"),
    ("render pool --fps 24", "--frames"),
    ("render pool --set time=3600 --frames 1-2", "time = 3600.04"),
    ("render pool --set waves=0.25 --frames 12", "wash over the deck"),
    ("render --again x.exr --frames 1-2", "without --frames"),
    ("compare", "required"),
    ("compare spere", "did you mean sphere?"),
    ("compare glass --vary liquid", "write KEY=A,B,C"),
    ("compare glass --vary liquid=nim", "at least two values"),
    ("compare glass --vary liquid=water,watr", "liquid=watr: there is no medium 'watr'"),
    ("compare glass --vary liquid=water,water", "the same value twice"),
    ("compare pool --set mu=-10", "liquid=none: mu = -10 needs a liquid"),
    ("compare sphere --vary n=1.5,1.50", "the same value twice"),
    ("compare glass --vary liquid=nim,n=-1.33", "the same value twice"),
    ("compare sphere --vary n=1,-1.33,mu=3", "n=-1.33 mu=3: mu = 3 does not go with"),
    ("render --again nothing.exr", "there is no file"),
    ("render sphere --again x.exr", "without SCENE"),
    ("fresnel --inside glas", "did you mean glass?"),
    ("fresnel --inside n=-1.33,mu=10", "a negative index needs mu below 0"),
    ("fresnel --inside 0", "n = 0"),
    ("fresnel --inside inf", "not finite"),
    ("fresnel --inside 1e-300", "n = 1e-300 is out of range"),
    ("fresnel --inside n=1e200,mu=1e-200", "n = 1e+200 is out of range"),
    ("rays sphere --n 1e300", "n = 1e+300 is out of range"),
    ("fresnel --inside -inf", "not finite"),
    ("fresnel --inside -1.5x", "'-1.5x' is not a number"),
    ("render sphere --size -3x4", "write it like 800x600"),
    ("rays sphere --n -x", "expected one argument"),
    ("fresnel", "required"),
    ("fresnel --inside 1_5", "'1_5' is not a number"),
    ("render sphere --samples 1_0", "'1_0' is not a whole number"),
    ("render pool --set seed=1_0", "'1_0' is not a whole number"),
    ("render glass --set figures=~nosuchuser/x.ply", "there is no file"),
    (f"render glass --set figures={'a' * 300}.ply", "there is no file"),
    (f"render sphere --set n=1.{'0' * 300}", "give --name"),
    (f"compare sphere --vary n=1.5,1.{'0' * 300}", "give --name"),
    ("render sphere --name a\x1b[31mb", "'a\\x1b[31mb' cannot name a file"),
    ("render sphere --name a\u202eb", "'a\\u202eb' cannot name a file"),
    ("render sphere --name a\x7f", "cannot name a file"),
    ("render sphere --name a.", "cannot name a file"),
    ("render \x1b[31msphere", "no scene '\\x1b[31msphere'"),
    ("verify \x1b[31m", "unrecognized arguments: \\x1b[31m"),
    ("info nothing.exr", "there is no file"),
    ("refract", "invalid choice"),
    ("", "required"),
]


@pytest.mark.parametrize(("line", "says"), REFUSED, ids=[line or "nothing" for line, _ in REFUSED])
def test_bad_input_gets_one_sentence_and_exit_code_2(line, says, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(line.split()) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert says in printed.err
    assert printed.err.startswith("nimray: ")
    assert printed.err.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ("a\nb", "a\tb", "a\rb", " ", "a ", " a", ""))
def test_a_name_that_breaks_lines_or_ends_unseen_is_refused(name, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["render", "sphere", f"--name={name}"]) == 2
    assert (
        capsys.readouterr().err
        == f"nimray: --name {name!r} cannot name a file; use letters, digits, dots and dashes.\n"
    )


@pytest.mark.parametrize("command", ("render sphere", "compare sphere", "figures 5.8", "rays sphere"))
def test_an_empty_place_to_write_to_is_a_usage_error(command, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main([*command.split(), "--out", ""]) == 2
    assert "--out is empty" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_sentence_about_thousands_of_letters_is_short(capsys):
    assert cli.main(["fresnel", "--inside", "n=" + "1" * 5000]) == 2
    assert len(capsys.readouterr().err) < 700


@pytest.mark.parametrize("number", ("-1.5", "-1.5e0", "-15e-1", "\N{MINUS SIGN}1.5", "-1.50"))
def test_a_number_below_0_is_no_option(number, capsys, tmp_path):
    assert cli.main(["fresnel", "--inside", number, "--outside", "-1."]) == 0
    assert "from n=-1 into n=-1.5" in capsys.readouterr().out
    file = tmp_path / "a.svg"
    assert cli.main(["rays", "sphere", "--n", number, "--mu", "-.1e1", "--out", str(file)]) == 0
    assert "n=-1.5" in file.read_text()


def test_a_folder_where_the_comparison_would_be_is_seen_before_the_work(capsys, tmp_path):
    (tmp_path / "c.png").mkdir()
    assert cli.main(["compare", "sphere", "--name", "c", "--out", str(tmp_path), *SMALL]) == 1
    assert "c.png is a folder" in capsys.readouterr().err
    assert [file.name for file in tmp_path.iterdir()] == ["c.png"]


def test_commas_part_the_values_that_are_compared_but_for_the_one_before_mu():
    varied = [
        cli._varied(scene_type(name), words)
        for name, words in (
            ("glass", ["liquid=none,n=-1.33,mu=-10,nim", "view=top"]),
            ("sphere", ["n=1,-1.33,mu=-10"]),
        )
    ]
    assert varied == [
        [["liquid=none"], ["liquid=n=-1.33,mu=-10"], ["liquid=nim"], ["view=top"]],
        [["n=1"], ["n=-1.33", "mu=-10"]],
    ]


def test_names_are_known_in_any_case_and_a_figure_is_made_once(capsys, monkeypatch, tmp_path):
    from nim_addon.figures import run

    made = []

    def make(figure, *_, **__):
        made.append(figure.number)
        return {"figure": figure.number, "holds": True}

    monkeypatch.setattr(run, "make", make)
    assert cli.main(["figures", "5.8", "a.1", "5.8", "A.1", "--json", "--out", str(tmp_path)]) == 0
    assert made == ["5.8", "A.1"]
    assert cli.main(["render", "Sphere", *SMALL, "--out", str(tmp_path), "--quiet"]) == 0
    assert (tmp_path / "sphere.exr").is_file()
    assert cli.main(["rays", "Slab", "--out", str(tmp_path / "slab.svg")]) == 0


def test_size_may_be_a_part_of_the_scenes_own():
    assert cli._size("25%")((720, 480)) == (180, 120)
    assert cli._size("64x48")((720, 480)) == (64, 48)


def test_an_unwritable_folder_fails_with_exit_code_1(capsys, tmp_path):
    (tmp_path / "file").write_text("")
    assert cli.main(["render", "sphere", *SMALL, "--out", str(tmp_path / "file" / "below")]) == 1
    assert "cannot write into" in capsys.readouterr().err


@pytest.mark.parametrize("command", (["render", "sphere", "--backend", "osl"], ["verify", "--backend", "osl"]))
def test_a_blender_without_osl_is_told_so(command, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(material, "osl_available", lambda: False)
    assert cli.main(command) == 1
    assert "was built without OSL" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_blender_without_osl_renders_with_its_own_nodes(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(material, "osl_available", lambda: False)
    assert cli.main(["render", "sphere", *SMALL, "--out", str(tmp_path), "--name", "one", "--quiet"]) == 0
    assert cli.main(["info", str(tmp_path / "one.exr"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["backend"] == "nodes"
    assert cli.main(["doctor"]) == 0
    assert "Blender's own nodes" in capsys.readouterr().out


def test_a_blender_without_a_denoiser_is_told_so(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(cli, "_can_denoise", lambda: False)
    assert cli.main(["render", "sphere", *SMALL, "--denoise", "--out", str(tmp_path / "new")]) == 1
    assert "without OpenImageDenoise" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_blender_older_than_the_closure_is_told_so(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(cli, "OLDEST_BLENDER", (99, 0, 0))
    assert cli.main(["render", "sphere", "--out", str(tmp_path)]) == 1
    assert "is too old" in capsys.readouterr().err


def test_fresnel_prints_the_equations(capsys):
    assert cli.main(["fresnel", "--inside", "n=-1.33,mu=-10", "--csv", "--step", "30"]) == 0
    rows = list(csv.DictReader(capsys.readouterr().out.splitlines()))
    assert [row["theta_i"] for row in rows] == ["0", "30", "60", "90"]
    expected = Interface(Medium(-1.33, -10)).fresnel(np.cos(np.radians([0, 30, 60]))).R
    assert np.allclose([float(row["R"]) for row in rows[:3]], expected, rtol=1e-12)
    assert float(rows[1]["theta_t"]) < 0
    assert cli.main(["fresnel", "--inside", "air", "--outside", "water", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert abs(answer["critical_angle"] - 48.75) < 0.01
    assert answer["rows"][-1]["theta_t"] is None
    assert cli.main(["fresnel", "--inside", "-1.33"]) == 0
    assert "bends backwards: yes" in capsys.readouterr().out


def test_scenes_lists_every_parameter(capsys):
    assert cli.main(["scenes", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert {scene["name"] for scene in listed} == {"glass", "pool", "sphere", "sea"}
    assert all(one["description"] and one["allowed"] for scene in listed for one in scene["parameters"])
    assert cli.main(["scenes"]) == 0
    assert "companions" in capsys.readouterr().out


def test_doctor_finds_nothing_wrong_here(capsys):
    assert cli.main(["doctor", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["osl"] is True
    assert facts["problems"] == []


@pytest.mark.parametrize("module", ("numpy", "bpy"))
@pytest.mark.parametrize("command", ("scenes", "info x.exr", "doctor", "render sphere"))
def test_a_python_that_lacks_something_is_told_so_in_a_sentence(module, command, tmp_path):
    text = f"raise ModuleNotFoundError(\"No module named '{module}'\", name='{module}')"
    (tmp_path / f"{module}.py").write_text(text)
    done = nimray(*command.split(), where=tmp_path, instead=tmp_path)
    said = done.stdout + done.stderr
    assert done.returncode == 1
    assert "Traceback" not in said
    assert {"numpy": "python3 build.py ...", "bpy": "run: python -m pip install bpy"}[module] in said
    if (module, command) != ("bpy", "doctor"):  # which has more to say
        assert (done.stdout, done.stderr.count("\n")) == ("", 1)


def test_build_runs_every_command_of_nimray():
    (commands,) = (action for action in cli._parser()._actions if isinstance(action, argparse._SubParsersAction))
    assert set(build.NIMRAY) == set(commands.choices)


# build.py without the making of an environment
BUILD = """
import importlib.util, pathlib, sys
spec = importlib.util.spec_from_file_location("build", {file!r})
build = importlib.util.module_from_spec(spec)
spec.loader.exec_module(build)
build.environment = lambda *_: pathlib.Path(sys.executable)
sys.exit(build.main(sys.argv[1:]))
"""
# a command that takes its time to clear away
SLOW = """
import pathlib, signal, sys, time
home = pathlib.Path(__file__).parent
def clear(number, _):
    time.sleep(1)
    (home / "cleared").touch()
    sys.exit(128 + number)
for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, clear)
(home / "begun").touch()
time.sleep(20)
"""


@pytest.mark.parametrize(
    ("command", "module", "how"),
    (("render", "numpy", signal.SIGINT), ("render", "numpy", signal.SIGTERM), ("test", "pytest", signal.SIGINT)),
)
def test_ctrl_c_or_a_kill_of_build_lets_the_command_clear_away(command, module, how, tmp_path):
    (tmp_path / f"{module}.py").write_text(SLOW)
    run = subprocess.Popen(
        [sys.executable, "-c", BUILD.format(file=str(ROOT / "build.py")), command],
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        start_new_session=True,
    )
    deadline = time.monotonic() + 20
    while not (tmp_path / "begun").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    # Ctrl-C reaches all of them, a kill only the one
    (os.killpg if how == signal.SIGINT else os.kill)(run.pid, how)
    assert run.wait(20) == 128 + how
    assert (tmp_path / "cleared").exists()


def test_build_of_a_scene_that_does_not_exist_is_a_usage_error():
    done = subprocess.run(
        [sys.executable, "-c", BUILD.format(file=str(ROOT / "build.py")), "blends", "spere"],
        env=os.environ.copy(),  # without what Blender itself has set, of which 5.2 would have its child speak
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2 and done.stdout == ""
    assert re.fullmatch(r"make.py: there is no scene 'spere'; did you mean sphere\? The .*\.\n", done.stderr)


def test_physics_commands_do_not_wait_for_blender():
    script = "import sys; from nim_addon import cli; cli.main(['fresnel', '--inside', 'nim']); sys.exit('bpy' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script], env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True
    )
    assert done.returncode == 0


def test_help_shows_how(capsys):
    with pytest.raises(SystemExit) as stopped:
        cli.main(["render", "--help"])
    assert stopped.value.code == 0
    text = capsys.readouterr().out
    assert "nimray render pool --set liquid=nim mu=-10 view=window" in text
