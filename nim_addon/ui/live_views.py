# SPDX-License-Identifier: GPL-3.0-or-later
"""Live light paths in the 3D views: lines by the GPU, and what is to be read at the one under the mouse.

The mouse is followed by a gizmo that never says that it was hit, so that no event is taken from anybody.
"""

from __future__ import annotations

import functools
import math

import blf
import bpy
import gpu
from bpy.app.translations import pgettext_iface
from gpu_extras.batch import batch_for_shader

from . import boxes, light_view, live_lines, live_look, viewport

REACH = 8  # pixels, of the mouse
BEHIND = 0.55  # of the opacity of what lies behind or inside something
MINUS = "\N{MINUS SIGN}"
GROUPS = ("NIM_GGT_ray_reading", "NIM_GGT_light_handle")

_handlers = []
_mouse = None  # the region's address, and where in it
_reads = False  # whether something was to be read there


def start() -> None:
    """Draw into all 3D views from now on."""
    for function, when in ((_draw_lines, "POST_VIEW"), (_draw_words, "POST_PIXEL")):
        _handlers.append(bpy.types.SpaceView3D.draw_handler_add(function, (), "WINDOW", when))
    for group in GROUPS:
        bpy.context.window_manager.gizmo_group_type_ensure(group)
    live_look.redraw()


def stop() -> None:
    """Draw no more."""
    global _mouse, _reads
    if bpy.app.timers.is_registered(_look_there):
        bpy.app.timers.unregister(_look_there)
    for handler in _handlers:
        bpy.types.SpaceView3D.draw_handler_remove(handler, "WINDOW")
    _handlers.clear()
    _mouse, _reads = None, False
    for group in GROUPS:
        bpy.context.window_manager.gizmo_group_type_unlink_delayed(group)
    live_look.redraw()


# ---------------------------------------------------------------- lines


def _draw_lines():
    context = bpy.context
    if not context.space_data.overlay.show_overlays:
        return
    look = live_look.known(context.scene)
    if look is None or not len(look.lines.ends):
        return
    shader = _shader()
    if look.drawn is None:
        content, triangles = live_lines.quads(look.lines)
        look.drawn = batch_for_shader(shader, "TRIS", content, indices=triangles)
    shader.bind()
    shader.uniform_float("size", gpu.state.viewport_get()[2:])
    shader.uniform_float("scale", context.preferences.system.pixel_size)
    # wavelengths that go the same way make white
    gpu.state.blend_set("ADDITIVE" if any(one.wavelengths_nm for one in look.traced) else "ALPHA")
    gpu.state.depth_mask_set(False)
    for test, opacity in (("GREATER", BEHIND), ("LESS_EQUAL", 1.0)):
        gpu.state.depth_test_set(test)
        shader.uniform_float("opacity", opacity)
        look.drawn.draw(shader)
    gpu.state.depth_test_set("NONE")
    gpu.state.depth_mask_set(True)
    gpu.state.blend_set("NONE")


# Of Blender's own shader for lines, POLYLINE_SMOOTH_COLOR, a batch has one width, and up to 4.4 a stage makes the quads that is
# slow where a processor stands for a GPU. srgbTarget is Blender's: whether what is written is encoded afterwards.
VERTEX = """
vec4 ahead(vec4 from, vec4 to)
{
  /* where a line comes from behind the eye */
  float away = to.z - from.z + to.w - from.w;
  return (from.z < -from.w && away != 0.0) ? mix(from, to, (-from.z - from.w) / away) : from;
}

vec3 encoded(vec3 color)
{
  vec3 low = color * 12.92;
  vec3 high = 1.055 * pow(max(color, vec3(0.0)), vec3(1.0 / 2.4)) - 0.055;
  return mix(low, high, step(vec3(0.0031308), color));
}

void main()
{
  vec4 a = ModelViewProjectionMatrix * vec4(first, 1.0);
  vec4 b = ModelViewProjectionMatrix * vec4(second, 1.0);
  vec4 start = ahead(a, b);
  vec4 end = ahead(b, a);
  vec2 along = (end.xy / end.w - start.xy / start.w) * size;
  along = (along == vec2(0.0)) ? vec2(1.0, 0.0) : normalize(along);
  reach = (abs(place.y) * scale + 1.0) * 0.5;
  across = sign(place.y) * reach;
  gl_Position = (place.x < 0.5) ? start : end;
  gl_Position.xy += 2.0 * across * vec2(-along.y, along.x) / size * gl_Position.w;
  shade = vec4(srgbTarget ? color.rgb : encoded(color.rgb), color.a * opacity);
}
"""
FRAGMENT = """
void main()
{
  written = vec4(shade.rgb, shade.a * clamp(reach - abs(across), 0.0, 1.0));
}
"""


@functools.cache
def _shader():
    """Draws live_lines.Quads."""
    between = gpu.types.GPUStageInterfaceInfo("nim_light_path")
    between.smooth("VEC4", "shade")
    between.no_perspective("FLOAT", "across")
    between.flat("FLOAT", "reach")
    told = gpu.types.GPUShaderCreateInfo()
    told.push_constant("MAT4", "ModelViewProjectionMatrix")
    told.push_constant("VEC2", "size")
    told.push_constant("FLOAT", "scale")
    told.push_constant("FLOAT", "opacity")
    told.push_constant("BOOL", "srgbTarget")
    for number, (name, kind) in enumerate(
        (("first", "VEC3"), ("second", "VEC3"), ("color", "VEC4"), ("place", "VEC2"))
    ):
        told.vertex_in(number, kind, name)
    told.vertex_out(between)
    told.fragment_out(0, "VEC4", "written")
    told.vertex_source(VERTEX)
    told.fragment_source(FRAGMENT)
    return gpu.shader.create_from_info(told)


# ---------------------------------------------------------------- words


def pointed_at(scene: bpy.types.Scene, region: bpy.types.Region, place: tuple[float, float]) -> tuple | None:
    """Which Traced the line at a place of a view is of, and which of its segments; None where there is none."""
    look = live_look.LOOKS.last(scene)
    if look is None:
        return None
    scale = bpy.context.preferences.system.pixel_size
    size = region.width, region.height
    line = live_lines.nearest(look.lines, region.data.perspective_matrix, size, place, REACH * scale)
    return None if line is None else tuple(look.lines.source[line].tolist())


def _draw_words():
    context = bpy.context
    if not context.space_data.overlay.show_overlays:
        return
    scale = context.preferences.system.ui_scale
    said = live_look.sentence(context.scene) or light_view.sentence(context)
    if said:
        blf.size(0, boxes.SIZE * scale)
        blf.enable(0, blf.SHADOW)
        blf.shadow(0, 5, 0.0, 0.0, 0.0, 1.0)
        blf.color(0, 1.0, 0.8, 0.4, 1.0)
        # above the note of ui.viewport, and where that is seldom more than a line
        above = boxes.height(viewport.note(context) or [""], scale) + (viewport.MARGIN + 4) * scale
        blf.position(0, viewport.room(context)[0] + boxes.EDGE * scale, above, 0)
        blf.draw(0, said)
        blf.disable(0, blf.SHADOW)
    if _mouse and _mouse[0] == context.region.as_pointer():
        found = pointed_at(context.scene, context.region, _mouse[1])
        if found:
            traced = live_look.LOOKS.last(context.scene).traced
            lines = words(live_lines.reading(traced[found[0]], found[1]))
            _draw_at(lines, _mouse[1], scale)


def _draw_at(lines, place, scale):
    """Draw lines of text to the right of a place and below it."""
    away = 1.5 * boxes.SIZE * scale
    boxes.draw(lines, place[0] + away, place[1] - away - boxes.height(lines, scale), (1.0, 1.0, 1.0, 1.0), scale)


def words(reading: live_lines.Reading) -> list[str]:
    """What is read, in lines."""
    found = [f"n = {reading.n:.4g}"]
    if reading.n_t is not None:
        found = [f"nᵢ = {reading.n:.4g},  nₜ = {reading.n_t:.4g}"]
        ahead = _degrees(reading.theta_t) if reading.theta_t is not None else pgettext_iface("total reflection")
        found += [f"θᵢ = {_degrees(reading.theta_i)},  θₜ = {ahead}", f"R = {100 * reading.R:.1f} %"]
    energy = pgettext_iface("energy {share:.1f} %, {nm:.0f} nm")
    found.append(energy.format(share=100 * reading.energy, nm=reading.wavelength_nm))
    return [line.replace("-", MINUS) for line in found]


def _degrees(angle):
    return f"{round(math.degrees(angle), 1) + 0.0:.1f}°"  # of what is nearly 0 no sign


def point(context: bpy.types.Context, place: tuple[float, float]) -> None:
    """Note where the mouse is, for a gizmo: what is to be read there is looked for afterwards, as ui.deferred says why."""
    global _mouse
    _mouse = context.region.as_pointer(), place
    if not bpy.app.timers.is_registered(_look_there):
        bpy.app.timers.register(_look_there)


def _look_there():
    """A timer: have the view at the mouse drawn anew where there is something to be read, or was."""
    global _reads
    for window in bpy.context.window_manager.windows:
        for region in (region for area in window.screen.areas if area.type == "VIEW_3D" for region in area.regions):
            if _mouse and region.as_pointer() == _mouse[0]:
                before, _reads = _reads, pointed_at(window.scene, region, _mouse[1]) is not None
                if before or _reads:
                    region.tag_redraw()
