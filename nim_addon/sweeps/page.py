# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of a sweep: one file that shows its pictures by sliders, and a curve of what was measured; it needs no network."""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from pathlib import Path

from ..base.files import whole

FILE = "index.html"

_PAGE = """<!DOCTYPE html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>@TITLE@</title>
<style>
body { font: 16px/1.4 system-ui, sans-serif; margin: 2rem auto; max-width: 60rem; padding: 0 1rem; color: #222; background: #fafafa }
img { max-width: 100%; min-width: 20rem; display: block; background: #ddd; image-rendering: auto }
label { display: grid; grid-template-columns: 10rem 1fr 8rem; gap: 1rem; align-items: center; margin: .4rem 0 }
output { font-variant-numeric: tabular-nums }
table { border-collapse: collapse; margin-top: 1rem }
td { padding: .1rem 1rem .1rem 0; vertical-align: top }
td:first-child { color: #666 }
svg { width: 100%; height: 12rem; margin-top: 1rem; background: #fff; border: 1px solid #ddd }
@media (prefers-color-scheme: dark) { body { color: #ddd; background: #1c1c1c } svg { background: #262626; border-color: #444 } }
</style>
<h1>@TITLE@</h1>
<div id="axes"></div>
<p id="missing" hidden>There is no picture for these values.</p>
<img id="picture" alt="">
<div id="curves"></div>
<table id="facts"></table>
<script type="application/json" id="data">@DATA@</script>
<script>
"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const axes = document.getElementById("axes"), picture = document.getElementById("picture");
const places = data.axes.map(() => 0);
const found = new Map(data.rows.map(row => [JSON.stringify(row.at), row]));
data.axes.forEach(([name, values], number) => {
  const label = axes.appendChild(document.createElement("label"));
  label.append(name);
  const slider = label.appendChild(document.createElement("input"));
  slider.type = "range"; slider.min = 0; slider.max = values.length - 1; slider.value = 0; slider.name = name;
  const shown = label.appendChild(document.createElement("output"));
  slider.addEventListener("input", () => { places[number] = +slider.value; show(); });
  slider.shown = () => { shown.textContent = values[places[number]] || "as it is"; };
});
function show() {
  axes.querySelectorAll("input").forEach(slider => slider.shown());
  const row = found.get(JSON.stringify(places));
  document.getElementById("missing").hidden = !!row;
  picture.hidden = !row;
  const facts = document.getElementById("facts");
  facts.replaceChildren();
  if (row) {
    picture.src = row.picture;
    picture.alt = data.axes.map(([name, values], number) => name + " = " + values[places[number]]).join(", ");
    for (const [name, value] of Object.entries(row.facts)) {
      const line = facts.insertRow();
      line.insertCell().textContent = name;
      line.insertCell().textContent = value;
    }
  }
  curves();
}
function curves() {
  const into = document.getElementById("curves");
  into.replaceChildren();
  const along = data.axes.reduce((best, [, values], number) => values.length > data.axes[best][1].length ? number : best, 0);
  for (const name of data.measured) {
    const points = [];
    data.axes[along][1].forEach((text, place) => {
      const at = places.slice(); at[along] = place;
      const row = found.get(JSON.stringify(at)), x = Number(text), y = row && row.facts[name];
      if (typeof y === "number" && !Number.isNaN(x)) points.push([x, y, place === places[along]]);
    });
    if (points.length < 2) continue;
    const xs = points.map(p => p[0]), ys = points.map(p => p[1]);
    const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const put = ([x, y]) => [60 + 720 * (x - x0) / (x1 - x0 || 1), 150 - 120 * (y - y0) / (y1 - y0 || 1)];
    const say = number => String(Number(number.toPrecision(4)));
    const draw = (kind, set, text) => {
      const made = document.createElementNS("http://www.w3.org/2000/svg", kind);
      Object.entries(set).forEach(([key, value]) => made.setAttribute(key, value));
      if (text !== undefined) made.textContent = text;
      return made;
    };
    const svg = draw("svg", {viewBox: "0 0 800 190"});
    svg.append(draw("polyline", {points: points.map(p => put(p).join()).join(" "), fill: "none", stroke: "#c60", "stroke-width": 2}));
    for (const point of points) {
      const [cx, cy] = put(point);
      svg.append(draw("circle", {cx, cy, r: point[2] ? 7 : 3, fill: "#c60"}));
    }
    const write = (x, y, anchor, text) => svg.append(draw("text", {x, y, "text-anchor": anchor, fill: "currentColor", "font-size": 14}, text));
    write(54, 34, "end", say(y1)); write(54, 154, "end", say(y0)); write(60, 176, "middle", say(x0)); write(780, 176, "middle", say(x1));
    write(420, 186, "middle", data.axes[along][0]); write(60, 16, "start", name);
    into.append(svg);
  }
}
show();
</script>
</html>
"""


def write(
    folder: str | Path, title: str, lines: Sequence[dict], keys: Sequence[str], measured: Sequence[str] = ()
) -> Path:
    """Write index.html; returns the file.

    lines:    of the table, as table.rows() gives them
    keys:     what was varied, each of which gets a slider
    measured: the quantities among the columns, which get curves
    """
    axes = [(key, list(dict.fromkeys(line.get(key, "") for line in lines))) for key in keys]
    shown = ("key", "seconds", "host", "nimray", "blender", "backend", *measured)
    rows = [
        {
            "at": [values.index(line.get(key, "")) for key, values in axes],
            "picture": str(Path(line["file"]).with_suffix(".png").as_posix()),
            "facts": {name: line[name] for name in shown if line.get(name) is not None},
        }
        for line in lines
    ]
    # no text of the data may end its element
    data = json.dumps({"axes": axes, "rows": rows, "measured": list(measured)}).replace("<", "\\u003c")
    text = _PAGE.replace("@TITLE@", html.escape(title)).replace("@DATA@", data)
    return whole(Path(folder).expanduser() / FILE, lambda part: part.write_text(text, encoding="utf-8"))
