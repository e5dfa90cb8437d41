# SPDX-License-Identifier: GPL-3.0-or-later
"""Caustics of a small sun: photons, traced from the light, baked into what shines on the surfaces where they landed.

A surface that gets caustics is replaced by a copy that also shines with them; the light's own part of it, through
interfaces, is then left out of the path tracing, so that nothing is counted twice.
"""

import bpy
import mathutils
import numpy as np

from . import photons

OWNER = "nim_caustics"
COLLECTION = "NIM Caustics"
UV, LOW, HIGH = "NIM Caustics", "nim_window_low", "nim_window_high"
# Least share of all landed power for which a chart gets a part of a texture.
LEAST = 1e-4
PADDING = 4  # texels around a window
DISKS = 6  # lamps for a Gaussian sun
ENOUGH = 16  # photons that make a kernel wide enough
RADII = (0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64)  # of kernels, in texels


class Window:
    """The part of a chart where photons land, and where it lies in its texture.

    low:   (2,) corner in metres; cells (width, height) texels of side `texel`, metres; at: (2,) place in the texture
    """

    def __init__(self, low, high, texel):
        self.low, self.texel = np.asarray(low) - PADDING * texel, texel
        self.cells = np.ceil((np.asarray(high) - low) / texel).astype(int) + 2 * PADDING
        self.at = None


def bake(scene, suns, *, texels=2048, side=1024, passes=32, seed=0, backend="auto", progress=None):
    """Trace the caustics of `suns` (a list of photons.Sun) and put them into `scene`; returns the shares of power.

    suns:    lights that nothing else in the scene stands for where light has been scattered: lamps are made for what they
             shine on straight
    texels:  edge of the texture of an object; side, passes: side x side photons of each sun in each pass
    Returns a dict: power that landed by way of interfaces, as Cycles counts light (_squeeze), by the name of the object.
    Raises as photons.Tracer does, and ValueError for media that it does not know or that are more than two.
    """
    clear(scene)
    with photons.Tracer(scene, backend) as tracer:
        squeeze = _squeeze(tracer.interfaces)
        windows, textures = _layout(tracer, suns, texels, side // 2, seed)
        total = len(suns) * passes
        for number, sun in enumerate(suns):
            told = progress and (lambda done, _, n=number: progress(n * passes + done, total))
            batches = tracer.trace(sun, side, passes, seed=seed + 1 + number, progress=told)
            for index, landed in enumerate(batches):
                _splat(landed, tracer, windows, textures, index % 2, np.where(landed.inside, squeeze, 1.0) / passes)
        power = {name: float(texture.flux.sum()) for name, texture in textures.items()}
        baked = []
        for name, texture in textures.items():
            mine = {chart: window for chart, window in windows.items() if tracer.charts[chart].thing == name}
            copies = list(tracer.copies(name, mine, UV, LOW, HIGH, texels))
            baked.append((name, copies, _irradiance(texture, mine, tracer)))
    collection = bpy.data.collections.new(COLLECTION)
    collection[OWNER] = True
    scene.collection.children.link(collection)
    for name, copies, irradiance in baked:
        _replace(scene, collection, name, copies, irradiance)
    for sun in suns:
        _lamps(collection, sun)
    return power


def _squeeze(interfaces):
    """Cycles' share of the light that is let into a medium: it takes radiance as the same on both sides of an interface.

    Really it grows by (n_t / n_i)^2. Where eye and light are in one medium this cancels over a whole path, of which the
    photons are only a part: what lands within a medium is divided by it. interfaces: physics.Interface by material
    """
    unknown = [name for name, interface in interfaces.items() if interface is None]
    if unknown:
        raise ValueError(f"the media of {unknown[0]} are linked, so that they are not known here; unlink its indices.")
    shares = {(interface.outside.n / interface.inside.n) ** 2 for interface in interfaces.values()}
    if max(shares) > min(shares) * (1 + 1e-6):
        raise ValueError("the scene has interfaces between several media; caustics are traced through one kind only.")
    return shares.pop()


class Texture:
    """What landed on an object in each half of the passes: `flux` (2, H, W, 3) power a texel, `count` (2, H, W) photons."""

    def __init__(self, height, width):
        self.flux = np.zeros((2, height, width, 3))
        self.count = np.zeros((2, height, width))


def _layout(tracer, suns, texels, side, seed):
    """Windows by chart and textures by object, from a first pass of photons."""
    first = [landed for sun in suns for landed in tracer.trace(sun, side, 1, seed=seed)]
    chart = np.concatenate([one.chart for one in first])
    place = np.concatenate([one.place for one in first])
    power = np.bincount(chart, np.concatenate([one.power for one in first]).sum(axis=1), len(tracer.charts))
    bounds = {}
    for number in np.flatnonzero(power > LEAST * power.sum()):
        spots = place[chart == number]
        # the few that land far out leave the texels to where the light is
        low, high = np.quantile(spots, 0.001, axis=0), np.quantile(spots, 0.999, axis=0)
        margin = 0.02 * (high - low).max() + 1e-4
        limits = tracer.charts[number]
        bounds[number] = np.maximum(low - margin, limits.low), np.minimum(high + margin, limits.high)
    windows, textures = {}, {}
    for name in {tracer.charts[number].thing for number in bounds}:
        mine = {number: both for number, both in bounds.items() if tracer.charts[number].thing == name}
        area = sum(float(np.prod(high - low)) for low, high in mine.values())
        texel = max(np.sqrt(area) / texels, 1e-6)
        while True:
            laid = {number: Window(low, high, texel) for number, (low, high) in mine.items()}
            height = _shelve(laid.values(), texels)
            if height <= texels:
                break
            texel *= 1.1
        windows |= laid
        textures[name] = Texture(texels, texels)
    return windows, textures


def _shelve(windows, width):
    """Lay windows on shelves, the highest first; returns the height they take, or more than `width` if one is too wide."""
    left = top = shelf = 0
    for window in sorted(windows, key=lambda one: -one.cells[1]):
        if window.cells[0] > width:
            return width + 1
        if left + window.cells[0] > width:
            left, top, shelf = 0, top + shelf, 0
        window.at = np.array([left, top])
        left += window.cells[0]
        shelf = max(shelf, window.cells[1])
    return top + shelf


def _splat(landed, tracer, windows, textures, half, share):
    for number, window in windows.items():
        mine = landed.chart == number
        cell = np.floor((landed.place[mine] - window.low) / window.texel).astype(int)
        inside = np.all((cell >= 0) & (cell < window.cells), axis=1)
        column, row = cell[inside].T
        texture = textures[tracer.charts[number].thing]
        shape = window.cells[::-1]
        index, size = row * shape[1] + column, shape[0] * shape[1]
        part = half, slice(window.at[1], window.at[1] + shape[0]), slice(window.at[0], window.at[0] + shape[1])
        texture.count[part] += np.bincount(index, minlength=size).reshape(shape)
        for channel, power in enumerate((landed.power * share[:, None])[mine][inside].T):
            texture.flux[(*part, channel)] += np.bincount(index, power, size).reshape(shape)


def _irradiance(texture, windows, tracer):
    """(H, W, 3) power per area: each photon's power spread over a box about it, and on the surface only.

    The box is as wide as it takes to hold ENOUGH photons, so that a sharp line stays sharp and a dim place smooth, and
    bright light does not leak into a dark place beside it (a variable kernel at the sample points: Breiman, Meisel and
    Purcell 1977; the density estimate of a photon map, Jensen 1996, asks at the texels instead, and does leak). The
    photons of one half of the passes choose the width for those of the other: chosen by its own, an estimate is biased.
    What a box holds is shared out over the surface in it: nothing is lost where the surface or its chart ends.
    """
    answer = np.zeros(texture.flux.shape[1:])
    for number, window in windows.items():
        rows = slice(window.at[1], window.at[1] + window.cells[1])
        columns = slice(window.at[0], window.at[0] + window.cells[0])
        area = tracer.area(number, window.low, window.texel, window.cells)
        for half in (0, 1):
            answer[rows, columns] += _spread(
                texture.flux[half, rows, columns], texture.count[1 - half, rows, columns], area
            )
    return answer


def _spread(flux, others, area):
    """Power per area (H, W, 3) of `flux` (H, W, 3), in boxes that hold enough of `others` (H, W); `area` (H, W) of cells."""
    answer = np.zeros_like(flux)
    counts, ground = _table(others), _table(area)
    left = flux.sum(axis=2) > 0
    for radius in RADII:
        # a photon on a cell that holds no surface, at its very edge, lands on the nearest
        here = left & ((_box(counts, radius) >= ENOUGH) | (radius == RADII[-1]))
        if not here.any():
            continue
        surface = _box(ground, radius)
        here &= surface > 0
        left &= ~here
        share = np.divide(1.0, surface, out=np.zeros_like(surface), where=here)
        for channel in range(flux.shape[2]):
            answer[..., channel] += _box(_table(flux[..., channel] * share), radius)
        if not left.any():
            break
    return answer * (area > 0)[..., None]


def _table(values):
    return np.pad(values, ((1, 0), (1, 0))).cumsum(axis=0).cumsum(axis=1)


def _box(table, radius):
    """Sums over the square of that radius about each cell, cut off at the edges."""
    height, width = table.shape[0] - 1, table.shape[1] - 1
    low_y, high_y = np.maximum(np.arange(height) - radius, 0), np.minimum(np.arange(height) + radius + 1, height)
    low_x, high_x = np.maximum(np.arange(width) - radius, 0), np.minimum(np.arange(width) + radius + 1, width)
    rows = table[high_y] - table[low_y]
    return rows[:, high_x] - rows[:, low_x]


# ------------------------------------------------------------------------------------------------ what shines


def clear(scene):
    """Take baked caustics out of `scene`: the copies and lamps go, and what they stood for is rendered again."""
    things = [thing for thing in scene.objects if thing.get(OWNER)]
    collections = [one for one in scene.collection.children if one.get(OWNER)]
    data = {thing.data for thing in things}
    materials = {
        slot.material for thing in things for slot in thing.material_slots if slot.material and slot.material.get(OWNER)
    }
    images = {
        node.image for one in materials for node in one.node_tree.nodes if node.get(OWNER) and node.type == "TEX_IMAGE"
    }
    for thing in scene.objects:
        if thing.get(f"{OWNER}_hidden"):
            thing.hide_render = False
            del thing[f"{OWNER}_hidden"]
    bpy.data.batch_remove([*things, *collections])
    bpy.data.batch_remove([*data, *materials, *images])


def _replace(scene, collection, name, copies, irradiance):
    """Put a copy of the object `name`, which also shines, in its place."""
    image = bpy.data.images.new(f"{COLLECTION} {name}", *irradiance.shape[1::-1], alpha=False, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.ones((*irradiance.shape[:2], 4), np.float32)
    pixels[..., :3] = irradiance
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    original = scene.objects[name]
    for mesh, matrix in copies:
        thing = bpy.data.objects.new(f"{COLLECTION} {name}", mesh)
        thing[OWNER] = True
        thing.matrix_world = matrix
        for index, material in enumerate(list(mesh.materials)):
            if material and photons.lands(material):
                mesh.materials[index] = _shining(material, image)
        collection.objects.link(thing)
    original.hide_render = True
    original[f"{OWNER}_hidden"] = True


def _lamps(collection, sun):
    """Lamps for what a sun shines on straight: one, or as many disks as make a Gaussian."""
    disks = sun.half_angles(DISKS if sun.gaussian else 1, np.random.default_rng(0))
    strongest = max(sun.irradiance)
    for half in disks:
        data = bpy.data.lights.new(COLLECTION, "SUN")
        data.angle = 2 * half
        data.energy = strongest / len(disks)
        data.color = tuple(np.divide(sun.irradiance, strongest))
        # met by shadow rays only, which end at an interface: by chance it would be met through one, and counted twice
        data.cycles.use_multiple_importance_sampling = False
        lamp = bpy.data.objects.new(COLLECTION, data)
        lamp[OWNER] = True
        lamp.rotation_euler = mathutils.Vector(sun.direction).to_track_quat("-Z", "Y").to_euler()
        collection.objects.link(lamp)


def _shining(material, image):
    """A copy of `material` that also sends out what it would of the light in `image`."""
    copy = material.copy()
    copy[OWNER] = True
    tree = copy.node_tree
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL" and node.is_active_output)
    diffuse = next((node for node in tree.nodes if node.type in ("BSDF_DIFFUSE", "BSDF_PRINCIPLED")), None)

    def add(kind, inputs=None, **properties):
        node = tree.nodes.new(kind)
        node[OWNER] = True
        for key, value in properties.items():
            setattr(node, key, value)
        for key, value in (inputs or {}).items():
            if isinstance(value, bpy.types.NodeSocket):
                tree.links.new(value, node.inputs[key])
            else:
                node.inputs[key].default_value = value
        return node

    place = add("ShaderNodeUVMap", uv_map=UV).outputs[0]
    inside = None
    for attribute, sign in ((LOW, "GREATER_THAN"), (HIGH, "LESS_THAN")):
        limit = add("ShaderNodeAttribute", attribute_name=attribute).outputs["Vector"]
        a, b = (add("ShaderNodeSeparateXYZ", {0: vector}) for vector in (place, limit))
        for axis in (0, 1):
            within = add("ShaderNodeMath", {0: a.outputs[axis], 1: b.outputs[axis]}, operation=sign).outputs[0]
            inside = (
                add("ShaderNodeMath", {0: inside, 1: within}, operation="MULTIPLY").outputs[0] if inside else within
            )
    light = add("ShaderNodeTexImage", {"Vector": place}, image=image, interpolation="Linear").outputs["Color"]
    color = (1.0, 1.0, 1.0, 1.0)
    if diffuse:
        socket = diffuse.inputs["Color" if diffuse.type == "BSDF_DIFFUSE" else "Base Color"]
        color = socket.links[0].from_socket if socket.is_linked else tuple(socket.default_value)
    product = add(
        "ShaderNodeVectorMath",
        {0: light, 1: color if isinstance(color, bpy.types.NodeSocket) else color[:3]},
        operation="MULTIPLY",
    )
    strength = add("ShaderNodeMath", {0: inside, 1: 1 / np.pi}, operation="MULTIPLY")
    glow = add("ShaderNodeEmission", {"Color": product.outputs[0], "Strength": strength.outputs[0]})
    before = output.inputs["Surface"].links[0].from_socket
    both = add("ShaderNodeAddShader", {0: before, 1: glow.outputs[0]})
    tree.links.new(both.outputs[0], output.inputs["Surface"])
    copy.cycles.emission_sampling = "NONE"
    return copy
