# SPDX-License-Identifier: GPL-3.0-or-later
"""Text over a view or a picture, on dark ground of its own: whatever lies below it, it is read."""

import blf

SIZE = 12  # of the letters, in Blender's units
LINE, EDGE = 1.4 * SIZE, 0.5 * SIZE
GROUND = (0.05, 0.05, 0.05, 0.8)


def broken(text: str, width: float, scale: float) -> list[str]:
    """The lines of a text that are no wider than `width`, in pixels, where no one word is; scale: of the user interface."""
    blf.size(0, SIZE * scale)
    lines = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and blf.dimensions(0, longer)[0] <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines


def draw(lines: list[str], left: float, bottom: float, color: tuple[float, float, float, float], scale: float) -> None:
    """Draw lines of text on dark ground whose lower left corner is there, in pixels of the region that is being drawn."""
    # only where something is drawn: a Blender without a window has no gpu
    import gpu
    from gpu_extras.batch import batch_for_shader

    line, edge = LINE * scale, EDGE * scale
    blf.size(0, SIZE * scale)
    right = left + max(blf.dimensions(0, text)[0] for text in lines) + 2 * edge
    top = bottom + height(lines, scale)
    corners = {"pos": [(left, bottom), (right, bottom), (left, top), (right, top)]}
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    gpu.state.blend_set("ALPHA")
    shader.uniform_float("color", GROUND)
    batch_for_shader(shader, "TRI_STRIP", corners).draw(shader)
    gpu.state.blend_set("NONE")
    blf.color(0, *color)
    for number, text in enumerate(lines, start=1):
        blf.position(0, left + edge, top - number * line, 0)
        blf.draw(0, text)


def height(lines: list[str], scale: float) -> float:
    """Of the ground below these lines, in pixels."""
    return (len(lines) * LINE + EDGE) * scale
