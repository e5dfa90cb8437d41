# SPDX-License-Identifier: GPL-3.0-or-later
"""The probe on the curve, held to the equations by hand, and the curve as CSV, to what `nimray fresnel` prints."""

import csv
import io
import math

import bpy
import numpy as np
import pytest

from nim_addon import command
from nim_addon.cycles.material import interface_material
from nim_addon.physics import Interface, Medium
from nim_addon.ui import curve, probe

# Media inside and outside, in the words of the command, and a wavelength.
PAIRS = (("-1.5", "air", 550), ("n=-1.33,mu=-10", "water", 550), ("gold", "air", 700), ("air", "n-bk7", 450))


def material_of(inside, outside="air"):
    material = interface_material("NIM", Medium.parse(inside), Medium.parse(outside), backend="nodes")
    bpy.data.objects["Cube"].data.materials[0] = material
    return material


def test_the_numbers_are_those_of_snell_and_fresnel(addon):
    """Of n = -1.5 in air at 45 degrees, where |Z| = 1 / 1.5, by the formulas as every book has them."""
    theta_t = math.asin(math.sin(math.radians(45)) / 1.5)
    sine, tangent = (f(math.radians(45) - theta_t) / f(math.radians(45) + theta_t) for f in (math.sin, math.tan))
    found = probe.probe(Interface(Medium(-1.5)), math.radians(45))
    assert found.R_s == pytest.approx(sine**2) and found.R_p == pytest.approx(tangent**2)
    assert pytest.approx((sine**2 + tangent**2) / 2) == found.R and pytest.approx(1 - found.R) == found.T
    assert found.theta_t == pytest.approx(-theta_t)
    right = probe.probe(Interface(Medium(-1.5)), math.pi / 2)
    assert (right.R, right.T) == (1, 0) and right.theta_t == pytest.approx(-math.asin(1 / 1.5))


def test_from_inside_all_is_reflected_beyond_the_critical_angle(addon):
    inside = Interface(Medium(-1.5)).reversed()
    critical = math.asin(1 / 1.5)
    below, beyond = (probe.probe(inside, critical + step) for step in (-1e-3, 1e-3))
    assert below.R < 0.95 and below.theta_t < math.radians(-86)
    assert (beyond.R, beyond.R_s, beyond.R_p, beyond.T) == (1, 1, 1, 0) and math.isnan(beyond.theta_t)


def test_the_panel_tells_them(addon, draw):
    settings = bpy.context.scene.nim_curve
    material = material_of("-1.5")
    assert settings.angle == pytest.approx(math.radians(45))
    layout = draw(material, 900)
    assert "R = 5.02 %, T = 95 %" in layout.text and "θ₂ = -28.13°, bent backwards" in layout.text
    assert {("prop", "angle"), ("prop", "side"), ("operator", "nim.copy_curve")} <= set(layout.drawn)
    settings.side = "INSIDE"
    assert "R = 100 %, T = 0 %" in draw(material, 900).text and "all is reflected" in draw(material, 900).text
    settings.angle = math.radians(30)
    assert "θ₂ = -48.59°" in draw(material, 900).text
    # 0.5 of the index outside: with loss, what is not reflected beyond 30 degrees is absorbed
    settings.side, settings.angle = "OUTSIDE", math.radians(40)
    text = draw(material_of("n=0.5,k=0.05"), 900).text
    assert "what is not reflected is absorbed" in text and "R = 100 %" not in text


def test_of_media_by_wavelength_they_are_of_that_wavelength(addon, draw):
    material, settings = material_of("n-sf11"), bpy.context.scene.nim_curve
    told = []
    for nm in (400, 700):
        settings.wavelength = nm
        n = Medium.parse("n-sf11").at(nm).n
        theta = math.degrees(math.asin(math.sin(math.radians(45)) / n))
        told.append(f"θ₂ = {theta:.2f}°")
        assert told[-1] in draw(material, 900).text
    assert told[0] != told[1]


@pytest.mark.parametrize("degrees, from_inside", ((20, False), (70, False), (30, True), (80, True)))
def test_the_mark_is_on_the_curve(addon, degrees, from_inside):
    interface, size = Interface(Medium(-1.5)), 600
    image = curve.picture(curve.Shown(interface, angle=math.radians(degrees), from_inside=from_inside), size)
    marked = np.all(np.abs(image[..., :3] - curve.PROBE_COLOR) < 0.01, axis=-1)
    columns = np.flatnonzero(marked.any(axis=0))
    left, right, bottom, top = 24, size - 8, 27, size - 18
    assert columns.mean() == pytest.approx(left + degrees / 90 * (right - left), abs=1)
    rows = np.flatnonzero(marked[:, columns[0]] | marked[:, columns[-1]])  # beside the line there is the dot alone
    side = interface.reversed() if from_inside else interface
    R = float(side.fresnel(math.cos(math.radians(degrees))).R)
    assert (rows.mean() - bottom) / (top - bottom) == pytest.approx(R, abs=0.005)
    plain = curve.picture(curve.Shown(interface), size)
    assert not np.all(np.abs(plain[..., :3] - curve.PROBE_COLOR) < 0.01, axis=-1).any(), "and leaves no trace"


@pytest.mark.parametrize("inside, outside, nm", PAIRS)
def test_the_copy_is_what_the_command_prints(addon, capsys, inside, outside, nm):
    settings = bpy.context.scene.nim_curve
    settings.wavelength = nm
    for side, words in (("OUTSIDE", (inside, outside)), ("INSIDE", (outside, inside))):
        settings.side = side
        shown = probe.shown_of(bpy.context.scene, Interface(Medium.parse(inside), Medium.parse(outside)))
        line = ["fresnel", "--inside", words[0], "--outside", words[1], "--csv", "--step", "1", "--wavelength", f"{nm}"]
        assert command.main(line) == 0
        assert probe.as_text(shown) == capsys.readouterr().out


@pytest.mark.parametrize("inside, outside", (("gold", "air"), ("air", "n-bk7")))
def test_over_the_wavelength_the_copy_has_the_columns_of_the_spectrum(addon, inside, outside):
    bpy.context.scene.nim_curve.over = "WAVELENGTH"
    interface = Interface(Medium.parse(inside), Medium.parse(outside))
    rows = list(csv.DictReader(io.StringIO(probe.as_text(probe.shown_of(bpy.context.scene, interface)))))
    nm, n, k, R = curve.spectrum(interface)
    for name, values in (("wavelength", nm), ("n", n), ("k", k), ("R", R)):
        assert [float(row[name]) for row in rows] == pytest.approx(values.tolist())


def test_the_button_says_what_it_copied_and_what_it_cannot(addon, press):
    material = material_of("-1.5")
    assert press("nim.copy_curve", material=material.name_full) == {"FINISHED"}
    with pytest.raises(RuntimeError, match="no NIM Interface material whose media are known"):
        press("nim.copy_curve", material="Nobody")
