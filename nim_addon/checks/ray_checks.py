# SPDX-License-Identifier: GPL-3.0-or-later
"""What keeps rays from an interface, or lets them pass beside it: lamps, visibility, overrides of the view layer."""

from __future__ import annotations

import bpy

from ..caustics.placing import SAMPLING
from ..cycles import visibility
from ..cycles.material import asked_interfaces
from ..cycles.problem import LINKED, Problem, about, own_data, own_objects
from ..cycles.visibility import asked, declared, rendered
from .sight import Sight

# What a light of no size is given: a small bulb (metres), and the sun as it is seen from the earth (radians).
LAMP_RADIUS, SUN_ANGLE = 0.1, 0.00918
# Rays that an object may be invisible to, and what that does to the picture of an interface.
RAYS = {
    "visible_shadow": "{name} is invisible to shadow rays: light passes straight through it, and bent once more.",
    "visible_diffuse": "{name} is invisible to diffuse rays: light that it sends to matte surfaces is wrong.",
    "visible_glossy": "{name} is invisible to glossy rays: it is missing in mirrors and in its own reflections.",
    "visible_transmission": "{name} is invisible to transmission rays: behind glass or water it is missing.",
}


def lamps(sight: Sight) -> list[Problem]:
    """The Problems of lamps: what comes through an interface is found by chance, or by light tracing."""
    found = []
    for lamp in sight.lamps:
        light = lamp.data
        if light.cycles.is_portal:  # which guides rays to the sky, and shines not
            continue
        baked = light.get(SAMPLING) is not None  # then its light through interfaces is traced, not found by chance
        if sizeless(light) and not baked:
            text = "The light {name} has no size: it is never seen through what bends light, and casts none through it."
            found.append(about(lamp, "zero_light", text, "Give it a size"))
        if not light.cycles.use_multiple_importance_sampling and not baked:
            text = "Multiple Importance of the light {name} is off: it casts no light through what bends it."
            found.append(about(lamp, "light_by_chance", text, "Turn it on"))
        if not light.use_shadow:
            text = "The light {name} casts no shadows: it passes straight through what bends light, and bent once more."
            found.append(about(lamp, "light_shadow", text, "Let it cast shadows"))
        elif passed := [name for name in _names(sight) if not _blocks(lamp, name)]:
            text = "Shadow linking lets the light {name} straight through {passed}, and bent once more."
            found.append(about(lamp, "shadow_linking", text, None, passed=", ".join(passed)))
    return found


def objects(sight: Sight) -> list[Problem]:
    """The Problems of settings of objects that wear an interface: what they are invisible to, and tricks of shading."""
    found = []
    for shown, materials in sight.wearers().items():
        names = tuple(sorted(material.name for material in materials))
        for obj in dict.fromkeys((shown.original, shown.parent or shown.original)):
            for ray, text in RAYS.items():
                if not getattr(obj, ray):
                    found.append(about(obj, "ray_visibility", text, "Make it visible", names, owner=obj))
        if getattr(*_shading_offset(shown.original)) > 0:
            text = "The shading offset of the shadow terminator darkens {name}, as if its surface took light away."
            owner = shown.original
            found.append(about(owner, "shading_offset", text, "Set it to 0", names, owner=owner))
        if shown.original.cycles.is_caustics_caster and _has_shadow_caustics(sight):
            text = "Shadow Caustics do not know light that bends backwards: the light that {name} casts is missing."
            owner = shown.original
            found.append(about(owner, "shadow_caustics", text, "Turn them off for it", names, owner=owner))
    return found


def world(sight: Sight) -> list[Problem]:
    """The Problems of worlds that some of the rays from an interface do not see."""
    found = []
    for sky in _worlds(sight.scene):
        seen = sky.cycles_visibility
        if not (seen.camera and seen.glossy and seen.transmission):
            text = "The world {name} is invisible to rays that are mirrored or bent: they meet black."
            texts, remedy = ((text, LINKED), None) if sky.library else ((text,), "Make it visible")
            found.append(Problem("world_visibility", texts, {"name": sky.name}, remedy))
    return found


def _worlds(scene):
    overrides = [getattr(layer, "world_override", None) for layer in scene.view_layers if layer.use]
    return [sky for sky in dict.fromkeys(override or scene.world for override in overrides) if sky]


def layers(sight: Sight) -> list[Problem]:
    """The Problems of what view layers override."""
    found = []
    for layer in sight.scene.view_layers:
        override, values = layer.material_override, {"layer": layer.name}
        if not layer.use:
            continue
        if override and not asked_interfaces(override):
            values = {**values, "material": override.name}
            text = (
                "View layer {layer} puts {material} in the place of all materials: nothing negative-index is rendered."
            )
            found.append(Problem("layer_material", (text,), values, "Take the override away"))
        samples = layer.samples if sight.scene.cycles.use_layer_samples != "IGNORE" else 0
        if 0 < samples < sight.scene.cycles.samples:
            values = {**values, "samples": samples, "all": sight.scene.cycles.samples}
            text = "View layer {layer} has a number of samples of its own, {samples}, not the {all} of the scene."
            found.append(Problem("layer_samples", (text,), values, "Use the scene's"))
    return found


def shadow_tricks(sight: Sight) -> list[Problem]:
    """The Problems of interface materials that become transparent to shadow rays."""
    found = []
    for material in sight.worn:
        nodes = [node for node, _ in asked(material)]
        told = any(node.type == "LIGHT_PATH" and node.outputs["Is Shadow Ray"].is_linked for node in nodes)
        if told and any(node.type == "BSDF_TRANSPARENT" for node in nodes):
            text = "{material} is transparent to shadow rays: light passes straight through it, and bent once more."
            found.append(
                Problem("shadow_trick", (text,), {"material": material.name}, None, materials=(material.name,))
            )
    return found


def other_layers(scene: bpy.types.Scene) -> list[Problem]:
    """The Problems of interfaces that only a view layer behind the first shows, where nobody looks for them."""
    first, *others = scene.view_layers
    looked_at, found = set(rendered(scene)) if others else set(), []
    text = "Only the view layer {layer} shows {name}: checks, caustics and light paths look at the first one, {first}."
    for view in others:
        beside = [obj for obj in rendered(scene, view) if obj not in looked_at] if view.use else []
        for obj, materials in declared(beside).items():
            if any(asked_interfaces(material) for material in materials):
                values = {"layer": view.name, "name": obj.name, "first": first.name}
                found.append(Problem("other_layers", (text,), values, None, (obj.name,)))
    return found


def overridden(sight: Sight) -> bool:
    """Whether an interface of the scene is not rendered because a view layer overrides all materials."""
    if not any(layer.material_override and layer.use for layer in sight.scene.view_layers):
        return False
    all_shown = visibility.shown(sight.scene, sight.depsgraph, overridden=False)
    beneath = {material for surface in all_shown for material in surface.materials}
    beneath.update(material for materials in declared(rendered(sight.scene)).values() for material in materials)
    return any(asked_interfaces(material) for material in beneath)


def sizeless(light: bpy.types.Light) -> bool:
    """Whether a lamp shines from one point, or in one direction: no path finds it by chance."""
    if light.type == "SUN":
        return light.angle == 0
    if light.type == "AREA":
        return light.size == 0 or (light.shape in ("RECTANGLE", "ELLIPSE") and light.size_y == 0)
    return light.shadow_soft_size == 0


def _shading_offset(obj):
    """Where that setting of an object is, and its name; after 4.2 it is Blender's own."""
    name = "shadow_terminator_shading_offset"
    return (obj, name) if hasattr(obj, name) else (obj.cycles, "shadow_terminator_offset")


def _names(sight):
    return list(dict.fromkeys(shown.original.name for shown in sight.wearers()))


def _blocks(lamp, name):
    """Whether shadow linking lets the object of that name cast a shadow in the light of `lamp`."""
    linking = getattr(lamp, "light_linking", None)
    held = linking and linking.blocker_collection
    if not held:
        return True
    states = {}
    for entry, child in zip(held.collection_children, held.children, strict=True):
        states.update({obj.name: entry.light_linking.link_state for obj in child.all_objects})
    for entry, obj in zip(held.collection_objects, held.objects, strict=True):
        states[obj.name] = entry.light_linking.link_state
    if name in states:
        return states[name] == "INCLUDE"
    return "INCLUDE" not in states.values()


def _has_shadow_caustics(sight):
    sky = sight.scene.world
    return any(lamp.data.cycles.is_caustics_light for lamp in sight.lamps) or bool(sky and sky.cycles.is_caustics_light)


def unannounced(scene: bpy.types.Scene, lamps: list[str], wearers: list[str]) -> tuple[bool, ...]:
    """The settings above whose changes Blender tells nobody of, to be compared with what they were; quick.

    lamps, wearers: names of lamps, and of objects with an interface
    """
    sky = scene.world
    lights = [lamp.data for lamp in map(bpy.data.objects.get, lamps) if lamp and lamp.type == "LIGHT"]
    caustics = [bool(sky and sky.cycles.is_caustics_light), *(light.cycles.is_caustics_light for light in lights)]
    objects = map(bpy.data.objects.get, wearers if any(caustics) else ())
    casters = [obj is not None and obj.cycles.is_caustics_caster for obj in objects]
    return (*caustics, *casters, *(light.cycles.use_multiple_importance_sampling for light in lights))


def give_size(scene: bpy.types.Scene, problem: Problem) -> None:
    """Mend a Problem of lamps without size."""
    for light in own_data(problem):
        if light.type == "SUN":
            light.angle = SUN_ANGLE
        elif light.type == "AREA":
            light.size, light.size_y = light.size or LAMP_RADIUS, light.size_y or LAMP_RADIUS
        else:
            light.shadow_soft_size = LAMP_RADIUS


def _find_by_chance(scene, problem):
    for light in own_data(problem):
        light.cycles.use_multiple_importance_sampling = True


def _cast_shadows(scene, problem):
    for light in own_data(problem):
        light.use_shadow = True


def _show(scene, problem):
    for obj in own_objects(problem):
        for ray in RAYS:
            setattr(obj, ray, True)


def _shade_without_offset(scene, problem):
    for obj in own_objects(problem):
        setattr(*_shading_offset(obj), 0.0)


def _cast_no_caustics(scene, problem):
    for obj in own_objects(problem):
        obj.cycles.is_caustics_caster = False


def _show_world(scene, problem):
    seen = bpy.data.worlds[problem.values["name"], None].cycles_visibility
    seen.camera = seen.glossy = seen.transmission = True


def _override_nothing(scene, problem):
    scene.view_layers[problem.values["layer"]].material_override = None


def _use_samples_of_scene(scene, problem):
    scene.view_layers[problem.values["layer"]].samples = 0


CHECKS = (layers, lamps, objects, world, shadow_tricks)
MENDS = {
    "zero_light": give_size,
    "light_by_chance": _find_by_chance,
    "light_shadow": _cast_shadows,
    "ray_visibility": _show,
    "shading_offset": _shade_without_offset,
    "shadow_caustics": _cast_no_caustics,
    "world_visibility": _show_world,
    "layer_material": _override_nothing,
    "layer_samples": _use_samples_of_scene,
}
