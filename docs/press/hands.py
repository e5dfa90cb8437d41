# SPDX-License-Identifier: GPL-3.0-or-later
"""What a person does at the window, as steps of the story do it: press, drag, type, look."""

import os
import struct
import sys

import bpy
import lab
from bpy_extras.view3d_utils import location_3d_to_region_2d

MODULE = "bl_ext.user_default.nim_addon"
KEYS = {" ": "SPACE"}
noted = {}  # from one step to a later one
at_it = []  # what is not done yet of what was begun with soon() or drag()


def ours(name):
    """A module of the add-on; None before it is installed."""
    return sys.modules.get(f"{MODULE}.{name}")


def overheard(module, name):
    """Note from now on, by its name, what a function of a module gives."""
    function = getattr(module, name)

    def noting(*given):
        noted[name] = function(*given)
        return noted[name]

    setattr(module, name, noting)


def press(operator, space="VIEW_3D", region="WINDOW", **properties):
    """Press the button of an operator, in an area of that type."""
    area = lab.area(space)
    part = next(one for one in area.regions if one.type == region)
    group, _, name = operator.partition(".")
    with bpy.context.temp_override(window=lab.window(), area=area, region=part):
        done = getattr(getattr(bpy.ops, group), name)("INVOKE_DEFAULT", True, **properties)
    print(f"{operator}: {', '.join(done)}", flush=True)
    if "CANCELLED" in done:
        raise RuntimeError(f"{operator} was cancelled")


def soon(function):
    """Call it again and again until the screen, which is drawn in between, is ready for it."""

    def attempt():
        try:
            function()
        except (AttributeError, TypeError):
            return 0.2
        at_it.remove(function)

    at_it.append(function)
    bpy.app.timers.register(attempt, first_interval=0.3)


def drag(start, end):
    """Drag with the left button, as Blender is told of it bit by bit: after each the screen is drawn."""

    def parts():
        event("MOUSEMOVE", "NOTHING", at=start)
        yield
        event("LEFTMOUSE", at=start)
        for part in range(1, 13):
            event(
                "MOUSEMOVE", "NOTHING", at=tuple(int(a + (b - a) * part / 12) for a, b in zip(start, end, strict=True))
            )
            yield
        event("MOUSEMOVE", "NOTHING", at=end)
        yield
        event("LEFTMOUSE", "RELEASE", at=end)

    going = parts()

    def on():
        for _ in going:
            return 0.2
        at_it.remove(going)

    at_it.append(going)
    bpy.app.timers.register(on)


def sidebar(space, tab):
    """Open the sidebar of an area on a tab."""
    lab.area(space).spaces.active.show_region_ui = True

    def open_tab():
        region = next(one for one in lab.area(space).regions if one.type == "UI")
        if region.active_panel_category == "UNSUPPORTED":
            raise TypeError("not drawn yet")
        region.active_panel_category = tab

    soon(open_tab)


def scroll(turns, down=True):
    """Turn the wheel over the sidebar."""
    for _ in range(turns):
        press("view2d.scroll_down" if down else "view2d.scroll_up", region="UI")


def event(kind, value="PRESS", at=(500, 500), **more):
    """A key, or the mouse, as Blender is told of it."""
    lab.window().event_simulate(type=kind, value=value, x=at[0], y=at[1], **more)


def key(kind, at=(500, 500)):
    """Press a key and let it go."""
    event(kind, at=at)
    event(kind, "RELEASE", at=at)


def typed(text, at):
    """Type a text, with the mouse at a place."""
    for letter in text:
        event(KEYS.get(letter, letter.upper()), at=at, unicode=letter)
        event(KEYS.get(letter, letter.upper()), "RELEASE", at=at)


def all_done():
    """Whether no render in the background is under way."""
    return not ours("ui.jobs").job().running


def half_done():
    """Whether one is to be seen under way; or it was too quick."""
    job = ours("ui.jobs").job()
    return job.progress()[0] > 0.3 or not job.running


def settings():
    return lab.window().scene.nim_scenes


def shading(kind):
    view = lab.area("VIEW_3D").spaces.active
    view.shading.type = kind
    view.overlay.show_overlays = kind != "RENDERED"


def show(editor):
    """Turn the largest area into that editor."""
    areas = lab.window().screen.areas
    max(areas, key=lambda area: area.width * area.height).ui_type = editor


def material_tab():
    """Open the Material tab of the Properties editor."""
    soon(lambda: setattr(lab.area("PROPERTIES").spaces.active, "context", "MATERIAL"))


def select(name):
    scene = lab.window().scene
    layer = lab.window().view_layer
    for thing in scene.objects:
        thing.select_set(thing.name == name, view_layer=layer)
    layer.objects.active = scene.objects[name]


def pushed(what):
    """A step of the undo stack, as Blender makes one where a person changes a value."""
    bpy.ops.ed.undo_push(message=what)


def socket(name="Cube"):
    """n inside, of the interface that an object wears."""
    nodes = lab.window().scene.objects[name].active_material.node_tree.nodes
    return next(node.inputs["Index Inside"] for node in nodes if "Index Inside" in node.inputs)


def middle_of(space):
    area = lab.area(space)
    return area.x + area.width // 2, area.y + area.height // 2


def where(place):
    """Where a place of the scene is on the screen."""
    area = lab.area("VIEW_3D")
    region = next(one for one in area.regions if one.type == "WINDOW")
    at = location_3d_to_region_2d(region, area.spaces.active.region_3d, place)
    return int(at.x + region.x), int(at.y + region.y)


def pixels(place, across, down):
    """The pixels of the screen about a place of it, as bytes, and how many colours they have."""
    with open(os.environ["LAB_FB"], "rb") as file:
        content = file.read()
    head = struct.unpack(">25I", content[:100])  # of an X window dump
    height, line, first = head[5], head[12], head[0] + 12 * head[19]
    rows = [first + (height - 1 - y) * line for y in range(place[1] - down // 2, place[1] + down // 2)]
    rows = [content[row + 4 * (place[0] - across // 2) : row + 4 * (place[0] + across // 2)] for row in rows]
    return b"".join(rows), len({row[at : at + 4] for row in rows for at in range(0, len(row), 4)})


def unfolded(name):
    """Draw a panel that is folded at first open, in its place."""
    panel = getattr(bpy.types, name)
    content = {word: value for word, value in vars(panel).items() if word not in ("__dict__", "__weakref__", "bl_rna")}
    content |= {"bl_idname": f"{name}_open", "bl_options": set()}
    noted["panels"] = panel, type(f"{name}_open", panel.__bases__, content)
    bpy.utils.unregister_class(panel)
    bpy.utils.register_class(noted["panels"][1])


def folded_again():
    """Take that back."""
    panel, opened_one = noted.pop("panels")
    bpy.utils.unregister_class(opened_one)
    bpy.utils.register_class(panel)


def needs(holds, what):
    """Fail unless that holds."""
    if not holds:
        raise AssertionError(what)
