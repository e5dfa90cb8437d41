# SPDX-License-Identifier: GPL-3.0-or-later
"""What the subcommands print that render nothing, and what they say where something is missing."""

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from nim_addon import command
from nim_addon.physics import Interface, Medium

ROOT = Path(__file__).parents[2]


def test_fresnel_prints_the_equations(capsys):
    assert command.main(["fresnel", "--inside", "n=-1.33,mu=-10", "--csv", "--step", "30"]) == 0
    rows = list(csv.DictReader(capsys.readouterr().out.splitlines()))
    assert [row["theta_i"] for row in rows] == ["0", "30", "60", "90"]
    expected = Interface(Medium(-1.33, -10)).fresnel(np.cos(np.radians([0, 30, 60]))).R
    assert np.allclose([float(row["R"]) for row in rows[:3]], expected, rtol=1e-12)
    assert float(rows[1]["theta_t"]) < 0
    assert command.main(["fresnel", "--inside", "air", "--outside", "water", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert abs(answer["critical_angle"] - 48.75) < 0.01
    assert answer["rows"][-1]["theta_t"] is None
    assert command.main(["fresnel", "--inside", "-1.33"]) == 0
    assert "bends backwards: yes" in capsys.readouterr().out


def test_scenes_lists_every_parameter(capsys):
    assert command.main(["scenes", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert {scene["name"] for scene in listed} == {
        "glass",
        "pool",
        "sphere",
        "sea",
        "drop",
        "prism",
        "lens",
        "ball",
        "window",
    }
    assert all(field["description"] and field["allowed"] for scene in listed for field in scene["parameters"])
    assert command.main(["scenes"]) == 0
    assert "companions" in capsys.readouterr().out


def test_doctor_finds_nothing_wrong_here(capsys):
    assert command.main(["doctor", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["osl"] is True
    assert facts["problems"] == []


@pytest.mark.parametrize("module", ("numpy", "bpy"))
@pytest.mark.parametrize("line", ("scenes", "info x.exr", "doctor", "render sphere"))
def test_a_python_that_lacks_something_is_told_so_in_a_sentence(nimray, module, line, tmp_path):
    text = f"raise ModuleNotFoundError(\"No module named '{module}'\", name='{module}')"
    (tmp_path / f"{module}.py").write_text(text)
    done = nimray(*line.split(), where=tmp_path, instead=tmp_path)
    said = done.stdout + done.stderr
    assert done.returncode == 1
    assert "Traceback" not in said
    assert {"numpy": "python3 build.py ...", "bpy": "run: python -m pip install bpy"}[module] in said
    if (module, line) != ("bpy", "doctor"):  # which has more to say
        assert (done.stdout, done.stderr.count("\n")) == ("", 1)


def test_physics_commands_do_not_wait_for_blender():
    script = "import sys; from nim_addon.command import main; main(['fresnel', '--inside', '-1']); sys.exit('bpy' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script], env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True
    )
    assert done.returncode == 0


def test_help_shows_how(capsys):
    with pytest.raises(SystemExit) as stopped:
        command.main(["render", "--help"])
    assert stopped.value.code == 0
    text = capsys.readouterr().out
    assert "nimray render pool --set liquid=nim mu=-10 view=window" in text
