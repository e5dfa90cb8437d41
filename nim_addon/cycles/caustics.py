# SPDX-License-Identifier: GPL-3.0-or-later
"""Caustics of small lights: photons, traced from the light, baked into what shines on the surfaces where they landed.

A surface that gets caustics is replaced by a copy that also shines with them; the light's own part of it, through
interfaces, is then left out of the path tracing, so that nothing is counted twice.
"""

import hashlib
import json
import math
import time
import zipfile
from pathlib import Path

import bpy
import mathutils
import numpy as np

from ..base.files import whole
from ..stopping import interruptible
from . import lights
from .bending import fed, kind_of, lands, own_groups
from .density import LEVELS, Density, layout
from .digest import ALIKE, digest
from .material import asked_interfaces
from .nodes import Nodes, empty_tree
from .object_values import carry, give
from .photons import ATTRIBUTE, Landed, Tracer, set_materials
from .visibility import HIDDEN, OWNER, as_rendered, asked, has_nodes

DIGEST = "nim_caustics_of"  # of the collection: digest() of the scene that was traced
MULTIPLE = "nim_caustics_multiple"  # of a lamp: whether it was found by chance too; of a sky: how it was sampled
SKY = "nim_caustics_sky"  # of the collection: the world whose sun the caustics are of
STANDS = "nim_caustics_lamp"  # of a lamp that is only seen: the bpy.types.Light of the one it is seen for
COLLECTION = "NIM Caustics"
PHOTONS = 1 << 24
PASS = 1 << 20  # photons of a round
SAVING = 20  # seconds between two savings of a bake
PASSES = 64  # at least, of a light that a pass shows one point or one width of
TRIAL = 1 << 18  # photons by which the textures are laid out
NARROW = math.radians(10)  # a sun that is better traced than found by chance
DISKS = 6  # lamps for a Gaussian sun


class Bake:
    """A bake, pass by pass; with `with`, for it takes what it made to trace away at the end.

    scene:   bpy.types.Scene; nothing of it is changed before put(), which puts these caustics in the place of any others
    light:   None for the lamps of the scene and the sun of its sky (lights.sun_of), or a list of lights.Sun, Lamp or Area
             that nothing else in the scene stands for: lamps are made for what they shine on straight
    texels:  edge of the largest texture; photons: about how many in all; seed: of their noise
    most:    photons of one round, about, so that a window can answer in between
    for step in bake: one round, a pass of every light; bake.done of bake.total rounds are traced. Then put() at any time.
    Raises ValueError, one sentence: as photons.Tracer does, for a scene without a light, a light of a kind that is not
    traced or that stands in a medium, and from the first step on where no light lands.
    """

    def __init__(self, scene, light=None, *, texels=2048, photons=PHOTONS, seed=0, most=PASS):
        for name, value in (("photons", photons), ("texels", texels), ("most", most)):
            if value < 1:
                raise ValueError(f"{name} is {value}, but must be 1 or more.")
        self.scene, self.texels, self.seed, self.done = scene, texels, seed, 0
        self.sun = lights.sun_of(scene) if light is None else None
        if light is None:
            self.sources = [(self.sun, None)] if self.sun else []
            with as_rendered(scene) as depsgraph:
                lamps = lights.placed(scene, depsgraph)
            for lamp in lamps:
                lights.check(lamp.thing)
                self.sources.append((lights.light_of(lamp.thing, lamp.matrix), lamp))
        else:
            self.sources = [(one, None) for one in light]
        if not self.sources:
            raise ValueError("the scene has no light to trace; add a lamp: a sun, a point, a spot or an area.")
        each = max(64, math.ceil(photons / len(self.sources)))
        several = any(isinstance(one, lights.Area) or getattr(one, "gaussian", False) for one, _ in self.sources)
        self.total = max(PASSES if several else 2, math.ceil(photons / most))
        self.photons = math.ceil(each / self.total)
        self.density = None
        self.tracer = Tracer(scene)

    def __enter__(self):
        self.tracer.__enter__()
        try:
            for light, lamp in self.sources:
                if not isinstance(light, lights.Sun):
                    self.tracer.check_outside(lamp.thing.name if lamp else "of the bake", light.place)
            self.unlit = [self._unlit(lamp) for _, lamp in self.sources]
        except BaseException:
            self.tracer.__exit__()
            raise
        return self

    def __exit__(self, *_):
        self.tracer.__exit__()

    def __iter__(self):
        if self.density is None:
            self.density = self._laid_out()
        first = self.done
        rounds = zip(*(self._passes(number, first) for number in range(len(self.sources))), strict=True)
        for landed in rounds:
            for one in landed:
                self.density.add(one, self.done % 2)
            self.done += 1
            yield self.done

    def _passes(self, number, first):
        return self._trace(number, self.photons, self.total, seed=self.seed + 1 + number, first=first)

    def _trace(self, number, *given, **how):
        """Tracer.trace() of the light of that number, without what lands where light linking has it shine on nothing."""
        for landed in self.tracer.trace(self.sources[number][0], *given, **how):
            yield landed.only(~self.unlit[number][landed.chart]) if self.unlit[number].any() else landed

    def _unlit(self, lamp):
        """(charts,) whether a lights.Placed, or None for any light, leaves a chart out."""
        names = [chart.thing for chart in self.tracer.charts]
        if lamp is None:
            return np.zeros(len(names), bool)
        bending = lights.leaves_out(lamp.thing, self.tracer.benders)
        if bending:
            name = min(one.name for one in bending)
            raise ValueError(
                f"the lamp {lamp.thing.name} does not light {name}, which bends light, by its Light Linking, and such light is "
                f"not traced; let it light {name} too."
            )
        out = {one.name for one in lights.leaves_out(lamp.thing, set(self.scene.objects)) if not one.library}
        return np.array([name in out for name in names])

    def _laid_out(self):
        trial = []
        for number in range(len(self.sources)):
            trial += self._trace(number, TRIAL // 4, 4, seed=self.seed)
        if not sum(len(one.side) for one in trial):
            raise ValueError(
                "no light lands by way of an interface; let the lamps shine on the NIM, and it on something."
            )
        colors = np.array([_color(light) for light, _ in self.sources])
        alike = np.ptp(colors, axis=0).max() < 1e-6 and not self.tracer.bending.tinted
        names = ("side", "place", "power", "share")
        sample = Landed(*(np.concatenate([getattr(one, name) for one in trial]) for name in names))
        textures = layout(self.tracer.charts, sample, self.texels)
        return Density(self.tracer.parts, self.tracer.charts, textures, tuple(colors[0]) if alike else None)

    def put(self):
        """Put what has landed so far into the scene; returns the power that landed, as Cycles counts it, by object."""
        baked = []
        for name, texture in self.density.textures.items():
            copies = list(self._copies(name, texture))
            baked.append((name, copies, self.density.irradiance(name, self.done), _layers(texture)))
        clear(self.scene)
        collection = bpy.data.collections.new(COLLECTION)
        collection[OWNER], collection[DIGEST] = True, digest(self.scene)
        self.scene.collection.children.link(collection)
        for one in baked:
            _replace(self.scene, collection, *one)
        for light, lamp in self.sources:
            if lamp is None:
                _lamps(collection, light)
            else:
                _split(collection, lamp)
        if self.sun:
            collection[SKY] = self.scene.world
            _hide_sun(self.scene.world)
        return self.density.power(self.done)

    def save(self, file):
        """Keep the state in a file (path), whole or not at all, for load()."""
        state = {"done": self.done, "mark": self._mark(), **self.density.state()}

        def write(part):
            with part.open("wb") as stream:
                np.savez(stream, **state)

        whole(file, write)

    def load(self, file):
        """Go on from a file that save() made of the same bake; returns whether there was one. Another's is left alone."""
        try:
            with np.load(file) as state:
                if str(state["mark"]) != self._mark():
                    return False
                self.density = Density(self.tracer.parts, self.tracer.charts, **Density.from_state(state))
                self.done = int(state["done"])
        except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile):
            return False
        return True

    def _mark(self):
        of = [digest(self.scene), self.seed, self.photons, self.total, self.texels, bpy.app.version_string]
        of.append(
            [(chart.thing, chart.axis) for chart in self.tracer.charts]
        )  # sums are kept by their numbers and names
        return hashlib.sha256(json.dumps([*of, repr([light for light, _ in self.sources])]).encode()).hexdigest()

    def _copies(self, name, texture):
        """Meshes of an object, with the places of its windows in its texture, for either side, and the Part each is made of."""
        height, width = texture.shape
        for part in (part for part in self.tracer.parts if part.name == name):
            mesh = part.mesh.copy()
            set_materials(mesh, part.materials)
            mesh.attributes.remove(mesh.attributes[ATTRIBUTE])
            for back, level in _layers(texture):
                place = np.full((len(part.charts), 3), -1.0, np.float32)
                bounds = np.zeros((2, len(part.charts), 3), np.float32)
                for number in np.unique(part.charts):
                    window = texture.windows.get(LEVELS * (2 * number + back) + level) if number >= 0 else None
                    if window is None:
                        continue
                    mine = part.charts == number
                    flat = np.delete(part.corners[mine], self.tracer.charts[number].axis // 2, axis=1)
                    place[mine, :2] = ((flat - window.low) / window.texel + window.at) / (width, height)
                    # half a texel within, so that no neighbour shines through
                    bounds[0, mine, :2] = (window.at + 0.5) / (width, height)
                    bounds[1, mine, :2] = (window.at + window.cells - 0.5) / (width, height)
                for attribute, values in zip(_names(back, level), (place, *bounds), strict=True):
                    data = mesh.attributes.new(attribute, "FLOAT_VECTOR", "CORNER").data
                    data.foreach_set("vector", values.ravel())
            yield mesh, part


def bake(scene, light=None, *, progress=None, file=None, **options):
    """Trace the caustics of a scene's lights and put them into it; returns the power that landed, by object.

    scene, light, options: as for Bake; progress: called with (rounds done, rounds in all)
    file: None, or a path to keep the state in now and then: a bake that was killed goes on from there; gone at the end
    Raises as Bake does, and OSError where there is no folder for the file, or what is no file has its name.
    """
    if file and not Path(file).parent.is_dir():
        raise OSError(f"there is no folder {Path(file).parent} to keep the bake in; make it, or name another.")
    if file and Path(file).exists() and not Path(file).is_file():
        raise OSError(f"{file} is no file to keep the bake in; move it away, or name another.")
    with Bake(scene, light, **options) as one, interruptible():
        if file:
            one.load(file)
        if progress:
            progress(one.done, one.total)
        saved = time.monotonic()
        for done in one:
            if file and done < one.total and time.monotonic() - saved > SAVING:
                one.save(file)
                saved = time.monotonic()
            if progress:
                progress(done, one.total)
        power = one.put()
    if file:
        Path(file).unlink(missing_ok=True)
    return power


def best_way(scene):
    """ "traced" where the sun in the sky of `scene` is so narrow that a path tracer hardly meets it, else "path"."""
    sun = lights.sun_of(scene)
    bends = any(asked_interfaces(slot.material) for thing in scene.objects for slot in thing.material_slots)
    return "traced" if sun and sun.angle < NARROW and bends else "path"


def baked(scene):
    """The collection of the caustics in `scene`, or None."""
    return next((one for one in scene.collection.children if one.get(OWNER)), None)


def left(scene):
    """Whether there is anything in `scene` for clear() to take back, if only what stays hidden without its copy."""
    return baked(scene) is not None or any(
        thing.get(HIDDEN) or (thing.type == "LIGHT" and thing.data.get(MULTIPLE) is not None) for thing in scene.objects
    )


def out_of_date(scene, meshes=None):
    """Whether `scene` has caustics of another shape, place, medium or light than it has now; `meshes` as for digest()."""
    collection = baked(scene)
    return collection is not None and collection.get(DIGEST) != digest(scene, meshes)


# ------------------------------------------------------------------------------------------------ what shines


def clear(scene):
    """Take baked caustics out of `scene`: the copies and lamps go, and what they stood for is rendered again."""
    things = [thing for thing in scene.objects if thing.get(OWNER)]
    collections = [one for one in scene.collection.children if one.get(OWNER)]
    data = {thing.data for thing in things}
    materials = {
        slot.material for thing in things for slot in thing.material_slots if slot.material and slot.material.get(OWNER)
    }
    groups = {node.node_tree for one in materials for node in _nodes(one.node_tree) if node.type == "GROUP"}
    groups = {group for group in groups if group and group.get(OWNER)}
    trees = [*(one.node_tree for one in materials), *groups]
    images = {node.image for tree in trees for node in tree.nodes if node.get(OWNER) and node.type == "TEX_IMAGE"}
    for lamp in {thing[STANDS] for thing in things if thing.get(STANDS)}:
        _found_by_chance(lamp)
    for thing in scene.objects:
        if thing.get(HIDDEN):
            thing.hide_render, thing.hide_viewport = False, thing[HIDDEN] > 1
            del thing[HIDDEN]
        if thing.type == "LIGHT":
            _found_by_chance(thing.data)
    for world in {scene.world, *(one.get(SKY) for one in collections)} - {None}:
        if world.get(MULTIPLE) is not None:
            _switch_sun(world, hidden=False)
            world.cycles.sampling_method = world[MULTIPLE]
            del world[MULTIPLE]
    for collection in collections:
        _hand_back(scene, collection)
    bpy.data.batch_remove([*things, *collections])
    bpy.data.batch_remove([*data, *materials, *groups, *images])


def _found_by_chance(lamp):
    """Let a lamp be found by chance again, if it was before."""
    if lamp.get(MULTIPLE) is not None:
        lamp.cycles.use_multiple_importance_sampling = lamp[MULTIPLE]
        del lamp[MULTIPLE]


def _nodes(tree):
    """All nodes of a tree, those in the groups in it too."""
    for node in tree.nodes:
        yield node
        if node.type == "GROUP" and node.node_tree:
            yield from _nodes(node.node_tree)


def _hand_back(scene, collection):
    """Leave what a person put into the collection of the caustics to the scene."""
    keeps, others = scene.collection, set(collection.children)
    held = {thing for one in scene.collection.children_recursive if one != collection for thing in one.objects}
    for thing in collection.objects:
        if not thing.get(OWNER) and thing not in held and thing not in set(keeps.objects):
            keeps.objects.link(thing)
    for child in others - set(keeps.children):
        keeps.children.link(child)


def _switch_sun(world, hidden):
    node = world.node_tree and world.node_tree.nodes.get(lights.HIDDEN)
    if node:  # unless the sky was made anew
        node.outputs[0].default_value = float(hidden)


def _hide_sun(world):
    """Leave the sun in a sky to where nothing was scattered: a lamp and the photons stand for it elsewhere."""
    world[MULTIPLE] = world.cycles.sampling_method
    _switch_sun(world, hidden=True)
    world.cycles.sampling_method = "NONE"  # without its sun the sky is smooth, and is found by chance


def _color(light):
    """(3,) the colour of a light, its strongest channel 1."""
    strength = np.asarray(light.irradiance if isinstance(light, lights.Sun) else light.intensity)
    return strength / strength.max()


def _layers(texture):
    """The (back, level) of the windows of a density.Texture: whether of the back of faces, and which of those nested."""
    return sorted({(key // LEVELS % 2, key % LEVELS) for key in texture.windows})


def _names(back, level):
    """Names of the corner attributes for those windows: the place in the texture, and the window's two corners there."""
    return [f"nim_caustics_{what}_{'back' if back else 'front'}_{level}" for what in ("place", "low", "high")]


def _replace(scene, collection, name, copies, irradiance, layers):
    """Put a copy of the object `name`, which also shines, in its place."""
    image = bpy.data.images.new(f"{COLLECTION} {name}", *irradiance.shape[1::-1], alpha=False, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.ones((*irradiance.shape[:2], 4), np.float32)
    pixels[..., :3] = irradiance
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    group = _light(image, layers)
    original = next(thing for thing in scene.objects if thing.name == name and not thing.library)
    for mesh, part in copies:
        thing = bpy.data.objects.new(f"{COLLECTION} {name}", mesh)
        thing.matrix_world = part.matrix
        _look_alike(thing, original)
        give(thing, part.values, original)
        thing[OWNER] = True
        for index, material in enumerate(part.materials):
            if lands(material):
                mesh.materials[index] = _shining(material, group)
        collection.objects.link(thing)
        _link_to_lamps(thing, original)
    original[HIDDEN] = 2 if original.hide_viewport else 1
    original.hide_render = original.hide_viewport = True


def _look_alike(thing, original):
    """Give an object what decides, beside mesh and materials, how another one is rendered."""
    for key, value in original.items():
        if isinstance(value, (bool, int, float, str)) and not key.startswith("nim_"):
            thing[key] = value
    for name in ALIKE:
        setattr(thing, name, getattr(original, name))
    for kind in ("receiver_collection", "blocker_collection"):
        setattr(thing.light_linking, kind, getattr(original.light_linking, kind))


def _link_to_lamps(thing, original):
    """Let the lamps that shine on some things only take a copy for its original."""
    lamps = [one for one in bpy.data.objects if one.type == "LIGHT"]
    for linked in {one.light_linking.receiver_collection for one in lamps} - {None}:
        for held in (linked, *linked.children_recursive):
            at = list(held.objects).index(original) if original in set(held.objects) else None
            if at is not None and thing not in set(held.objects):
                held.objects.link(thing)
                state = held.collection_objects[at].light_linking.link_state
                held.collection_objects[list(held.objects).index(thing)].light_linking.link_state = state


def _lamps(collection, light):
    """Lamps for what a lights.Sun, Lamp or Area shines on straight; a Gaussian sun is made of some disks."""
    if isinstance(light, lights.Sun):
        halves = light.half_angles(DISKS if light.gaussian else 1, np.random.default_rng(0))
        for half in halves:
            data = bpy.data.lights.new(COLLECTION, "SUN")
            data.angle = 2 * half
            data.energy = max(light.irradiance) / len(halves)
            _lamp(collection, data, light, light.direction)
    elif isinstance(light, lights.Area):
        data = bpy.data.lights.new(COLLECTION, "AREA")
        data.shape = "ELLIPSE" if light.round else "RECTANGLE"
        data.size, data.size_y = light.size
        data.energy = max(light.intensity) * math.pi
        _lamp(collection, data, light).matrix_world = mathutils.Matrix(light.frame)
    else:
        data = bpy.data.lights.new(COLLECTION, "SPOT" if light.axis else "POINT")
        data.shadow_soft_size = light.radius
        data.energy = max(light.intensity) * 4 * math.pi
        if light.axis:
            data.spot_size, data.spot_blend = 2 * math.acos(light.edge), light.blend
        _lamp(collection, data, light, light.axis).location = light.place


def _lamp(collection, data, light, direction=None):
    data.color = _color(light)
    # met by shadow rays only, which end at an interface: by chance it would be met through one, and counted twice
    data.cycles.use_multiple_importance_sampling = False
    lamp = bpy.data.objects.new(COLLECTION, data)
    lamp[OWNER] = True
    if direction:
        lamp.rotation_euler = mathutils.Vector(direction).to_track_quat("-Z", "Y").to_euler()
    collection.objects.link(lamp)
    return lamp


def _split(collection, placed):
    """Let a lights.Placed be met by shadow rays only, and a copy of it only be seen, where nothing was scattered."""
    lamp, data = placed.thing, placed.thing.data
    if data.get(MULTIPLE) is None:
        data[MULTIPLE] = data.cycles.use_multiple_importance_sampling
    data.cycles.use_multiple_importance_sampling = False
    seen = lamp.copy()
    seen.name = f"{COLLECTION} {lamp.name}"
    seen.data = data.copy()
    seen.data.cycles.use_multiple_importance_sampling = True
    seen.visible_diffuse = False
    seen[OWNER], seen[STANDS] = True, data
    if not placed.single:
        seen.parent = None
        seen.animation_data_clear()
        seen.constraints.clear()
        seen.matrix_world = placed.matrix
    own = lights.emitted(lamp)
    nodes = Nodes(empty_tree(seen.data))
    path = nodes.add("ShaderNodeLightPath").outputs
    straight = nodes.math("MAXIMUM", path["Is Camera Ray"], path["Is Singular Ray"])
    scattered = nodes.math("LESS_THAN", path["Diffuse Depth"], 0.5)
    strength = nodes.math("MULTIPLY", straight, scattered)
    nodes.end(nodes.add("ShaderNodeEmission", inputs={"Color": own, "Strength": strength}), "Light")
    collection.objects.link(seen)


def _plain_diffuse(material):
    """Give a material without nodes those of what Cycles renders in its place."""
    nodes = Nodes(empty_tree(material))
    nodes.end(nodes.add("ShaderNodeBsdfDiffuse", inputs={"Color": tuple(material.diffuse_color)}))


def _light(image, layers):
    """A node group: what a white surface would send out of the light in `image`, whose windows are those _layers()."""
    group = bpy.data.node_groups.new(COLLECTION, "ShaderNodeTree")
    group[OWNER] = True
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    nodes = Nodes(group)
    back = nodes.add("ShaderNodeNewGeometry").outputs["Backfacing"]
    light, left = None, [nodes.math("SUBTRACT", 1.0, back), back]
    for side, level in layers:
        place, *limits = (
            nodes.add("ShaderNodeAttribute", attribute_name=name).outputs["Vector"] for name in _names(side, level)
        )
        inside = None
        for limit, operation in zip(limits, ("GREATER_THAN", "LESS_THAN"), strict=True):
            a, b = (nodes.add("ShaderNodeSeparateXYZ", inputs={0: one}) for one in (place, limit))
            for axis in (0, 1):
                within = nodes.math(operation, a.outputs[axis], b.outputs[axis])
                inside = nodes.math("MULTIPLY", inside, within) if inside else within
        here = nodes.math("MULTIPLY", left[side], inside)
        # what a finer window shows, a coarser one does not
        left[side] = nodes.math("SUBTRACT", left[side], here)
        shown = nodes.add("ShaderNodeTexImage", inputs={"Vector": place}, image=image, interpolation="Linear")
        shown[OWNER] = True
        scaled = nodes.scale(shown.outputs["Color"], here)
        light = nodes.vector("ADD", light, scaled) if light else scaled
    nodes.add("NodeGroupOutput", inputs={0: nodes.scale(light, 1 / np.pi)})
    return group


def _shining(material, group):
    """A copy of `material` whose diffuse parts also send out what they would of the light of the _light() group."""
    copy = material.copy() if material else bpy.data.materials.new(COLLECTION)
    copy[OWNER] = True
    if not has_nodes(material):
        _plain_diffuse(copy)
    for owned in own_groups(copy.node_tree):
        owned[OWNER] = True
    carry(copy)
    for node, path in asked(copy):
        if kind_of(node, path) == "diffuse":
            _glow(node, group)
    copy.cycles.emission_sampling = "NONE"
    return copy


def _glow(node, group):
    """Let a diffuse closure also send out its part of the light of a group."""
    nodes = Nodes(node.id_data)
    color = node.inputs["Color"] if "Color" in node.inputs else node.inputs["Base Color"]
    albedo = fed(color) if color.is_linked else fed(color)[:3]
    light = nodes.vector("MULTIPLY", nodes.add("ShaderNodeGroup", node_tree=group).outputs[0], albedo)
    if node.type == "BSDF_PRINCIPLED":  # of its metal nothing is diffuse
        light = nodes.scale(light, nodes.math("SUBTRACT", 1.0, fed(node.inputs["Metallic"])))
    glow = nodes.add("ShaderNodeEmission", inputs={"Color": light})
    places = [link.to_socket for link in node.outputs[0].links]
    both = nodes.add("ShaderNodeAddShader", inputs={0: node.outputs[0], 1: glow.outputs[0]})
    for place in places:
        nodes.feed(place, both.outputs[0])
