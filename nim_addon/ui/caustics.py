# SPDX-License-Identifier: GPL-3.0-or-later
"""The caustics panel: what is traced from the lamps, the button that bakes it, and whether it still holds."""

import contextlib
import time

import bpy
from bpy.app.handlers import persistent
from bpy.app.translations import pgettext_iface, pgettext_rpt
from bpy.props import EnumProperty, IntProperty, PointerProperty

from .. import caustics
from ..base.text import duration
from ..caustics import lights
from ..caustics.digest import digest, forget_changed
from . import deferred, scenes

MILLION = 1_000_000  # photons in the panel's unit
ROUND = 1 << 18  # photons of a round, at most: a window does not answer meanwhile
SETTLED = 0.3  # seconds without a redraw before a change is looked at: not while a thing is dragged
LEAST = 2  # rounds of which caustics can be made: either half of them smooths the other
BAKED = "nim_caustics_baked"  # of the collection of the caustics: what was baked, and of how much

# Blender files hold these numbers.
SIZES = [
    ("512", "512", "4 MB for the largest surface", "NONE", 0),
    ("1024", "1024", "16 MB for the largest surface", "NONE", 1),
    ("2048", "2048", "64 MB for the largest surface", "NONE", 2),
    ("4096", "4096", "256 MB for the largest surface", "NONE", 3),
]
# What still gets through while a window bakes: looking around. Anything else could change what is being traced.
LOOKING = {"MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "TRACKPADPAN", "TRACKPADZOOM", "MOUSEROTATE"}
LOOKING |= {"MOUSEMOVE", "INBETWEEN_MOUSEMOVE", "WINDOW_DEACTIVATE"}


class NIM_PG_caustics(bpy.types.PropertyGroup):
    """How the caustics of a scene are traced: Scene.nim_caustics."""

    photons: IntProperty(
        name="Million Photons",
        description="How many are traced from all lamps together, in millions; more of them draw finer lines",
        default=16,
        min=1,
        max=1000,
    )
    texels: EnumProperty(
        name="Texture Size",
        description="Edge of the texture of the surface where most light lands; the others get as many texels a photon",
        items=SIZES,
        default="2048",
    )
    seed: IntProperty(name="Seed", description="Another number gives other noise", default=0, min=0, max=2**20)


# ------------------------------------------------------------------------------------------------ a bake under way


class Run:
    """A bake under way: step() by step, then keep() what is traced; close() takes away what was made for tracing.

    Raises ValueError, one sentence, as caustics.Bake does.
    """

    def __init__(self, scene):
        settings = scene.nim_caustics
        self.scene, self.started, self.more = scene, time.monotonic(), True
        self.settings = [settings.photons, settings.texels, settings.seed]
        self.mark = digest(scene, _meshes)
        self.bake = bake = caustics.Bake(
            scene, photons=settings.photons * MILLION, texels=int(settings.texels), seed=settings.seed, most=ROUND
        )
        self.stack = contextlib.ExitStack()
        self.stack.enter_context(bake)
        self.rounds = iter(bake)

    @property
    def photons(self):
        """How many are traced so far, about."""
        return self.bake.done * self.bake.photons * len(self.bake.sources)

    @property
    def part(self):
        """How much is traced, 0 to 1."""
        return self.bake.done / self.bake.total

    def text(self):
        """How far it is, in words."""
        if not self.more:
            return pgettext_iface("Laying it down...")
        if self.bake.done < LEAST:
            return pgettext_iface("Starting")
        left = (time.monotonic() - self.started) * (1 - self.part) / self.part
        return pgettext_iface("{}, {} left").format(f"{self.part:.0%}", duration(left))

    def step(self):
        """Trace one round; returns whether there are more. ReferenceError where the scene is gone."""
        if self.scene.name:  # asked for the error where it is gone
            self.more = next(self.rounds, None) is not None and self.bake.done < self.bake.total
        return self.more

    def keep(self):
        """Put what is traced into the scene; ValueError, one sentence, where the scene is no longer the one traced."""
        scene = self.scene
        if digest(scene, _meshes) != self.mark:
            raise ValueError(pgettext_rpt("The scene was changed while it was traced; bake it again."))
        self.bake.put()
        collection = caustics.baked(scene)
        textures = self.bake.density.textures.values()
        collection[BAKED] = {
            "photons": self.photons,
            "seconds": time.monotonic() - self.started,
            "surfaces": len(textures),
            "megabytes": sum(texture.size for texture in textures) * 16 / 1e6,
            # what was asked for; nothing where it was stopped before
            "settings": [str(one) for one in self.settings] if self.bake.done == self.bake.total else [],
        }

    def close(self):
        """Take away what was made for tracing."""
        with contextlib.suppress(ReferenceError):  # another file, or another state of this one, took it away
            self.stack.close()


# The bake under way, and the timer of the window that it is shown in; there are never two.
_run = _timer = None


def _stop():
    """Drop the bake under way, if there is one."""
    global _run
    if _run is not None:
        run, _run = _run, None
        run.close()


def _release():
    """Give back the timer, the cursor and the status bar."""
    global _timer
    if _timer is not None:
        bpy.context.window_manager.event_timer_remove(_timer)
        bpy.context.window_manager.progress_end()
        _timer = None
        for workspace in bpy.data.workspaces:
            workspace.status_text_set(None)


# ------------------------------------------------------------------------------------------------ what the panel knows


class _Known:
    """What drawing needs to know of a scene; no bpy data, which may be gone by the next drawing."""

    def __init__(self, scene):
        self.lights = _lights(scene)
        collection = caustics.baked(scene)
        self.baked = collection is not None
        made = collection.get(BAKED) if self.baked else None
        self.made = made.to_dict() if made else None  # a script's own bake says nothing of itself
        self.left = caustics.left(scene)
        self.stale = self.baked and caustics.out_of_date(scene, _meshes)


def _lights(scene):
    """What is traced, by its kind: "Sun: Key; Spot: Left, Right"; empty where nothing shines."""
    kinds = {pgettext_iface("Sky"): [pgettext_iface("its sun")]} if lights.sun_of(scene) else {}
    for lamp in lights.lamps_of(scene):
        kind = lamp.data.bl_rna.properties["type"].enum_items[lamp.data.type].name
        kinds.setdefault(pgettext_iface(kind), []).append(lamp.name)
    return "; ".join(f"{kind}: {', '.join(names)}" for kind, names in kinds.items())


# By session_uid of a scene, and those of them that nothing has changed since; the marks of meshes (digest()).
_known = {}
_fresh = set()
_meshes = {}


def _look(scene):
    """The _Known of a scene; while it is looked at anew, the last one, or None."""
    uid = scene.session_uid
    # what is being edited is not evaluated as it will be rendered
    if uid not in _fresh and bpy.context.mode == "OBJECT":
        deferred.do(_renew, uid, after=SETTLED if uid in _known else 0.0)
    return _known.get(uid)


def _renew(uid):
    scene = next((scene for scene in bpy.data.scenes if scene.session_uid == uid), None)
    if scene:
        _known[uid] = _Known(scene)
        # what the look has changed and put back is evaluated now, or it would be taken for a change later
        for layer in {scene.view_layers[0], *(window.view_layer for window in bpy.context.window_manager.windows)}:
            layer.update()
        _fresh.add(uid)


def _up_to_date(scene):
    """Whether baking would give what is there, as far as that is known."""
    # without a window a look is at once, and nothing can be changed for it while Blender asks what can be pressed
    known = _known.get(scene.session_uid) if bpy.app.background else _look(scene)
    settings = scene.nim_caustics
    if scene.session_uid not in _fresh or known.stale or not known.made:
        return False
    return list(known.made["settings"]) == [str(settings.photons), settings.texels, str(settings.seed)]


# ------------------------------------------------------------------------------------------------ operators


class NIM_OT_bake_caustics(bpy.types.Operator):
    """Bake caustics; while a window is open it is a modal operator, a round each time its timer fires."""

    bl_idname = "nim.bake_caustics"
    bl_label = "Bake Caustics"
    bl_description = (
        "Trace light from the lamps through interfaces and by mirrors, and let the surfaces shine where it lands. "
        "It takes the place of the last render in the Image editor"
    )
    bl_options = {"REGISTER", "UNDO"}

    run = None  # its Run, once it is started

    @classmethod
    def poll(cls, context):
        problem = None
        if _run is not None:
            problem = "Caustics are being baked; Esc stops it"
        elif context.mode != "OBJECT":
            problem = "Leave the mode you are in for Object Mode first"
        elif bpy.app.is_job_running("RENDER"):
            problem = "A render is under way; wait for it, or cancel it"
        elif _up_to_date(context.scene):
            problem = "The caustics are up to date"
        if problem:
            cls.poll_message_set(problem)
        return problem is None

    def invoke(self, context, event):
        if bpy.app.background or context.window is None:
            return self.execute(context)
        global _timer
        manager = context.window_manager
        _timer = manager.event_timer_add(0.02, window=context.window)
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC" and event.value == "PRESS":
            return self._closed(context, self._stopped())
        if event.type == "TIMER":
            # Blender may hang where a script sets up a scene while a material's icon is rendered
            state = set() if bpy.app.is_job_running("RENDER_PREVIEW") else self._ticked(context.scene)
            if state:
                return self._closed(context, state)
            self._tell(context)
            return {"PASS_THROUGH"}
        return {"PASS_THROUGH"} if event.type in LOOKING else {"RUNNING_MODAL"}

    def execute(self, context):
        manager = context.window_manager
        manager.progress_begin(0, 100)
        try:
            while True:
                state = self._ticked(context.scene)
                if state:
                    return state
                manager.progress_update(100 * _run.part)
        finally:
            manager.progress_end()
            _stop()

    def cancel(self, context):
        """Called by Blender where the window closes, or another file is opened."""
        self._closed(context, set())

    def _ticked(self, scene):
        """Start, trace a round or put what is traced into the scene, whichever is next; returns the state that ends it."""
        global _run
        try:
            if self.run is None and _run is None:
                self.run = _run = Run(scene)
            elif _run is not self.run:
                return {"CANCELLED"}  # undone, another file was opened, or another bake was quicker to start
            elif self.run.more:
                self.run.step()
            else:
                return self._kept()
        except (ValueError, RuntimeError, OSError) as error:
            return self._failed(error)
        except ReferenceError:
            _stop()
            return {"CANCELLED"}
        except BaseException:
            _stop()  # or no other bake could be started
            raise
        return set()

    def _stopped(self):
        run = _run
        if run is None or run.bake.done < LEAST:
            _stop()
            self.report({"INFO"}, pgettext_rpt("Stopped before anything could be seen; nothing is changed"))
            return {"CANCELLED"}
        run.more = False
        return self._ticked(None)

    def _kept(self):
        run = _run
        run.keep()
        _stop()
        forget()
        self.report(
            {"INFO"},
            pgettext_rpt("Caustics baked: {millions} million photons in {time}").format(
                millions=_millions(run.photons), time=duration(time.monotonic() - run.started)
            ),
        )
        return {"FINISHED"}

    def _failed(self, error):
        _stop()
        self.report({"ERROR"}, str(error))
        return {"CANCELLED"}

    def _tell(self, context):
        if _run is None:
            return
        context.window_manager.progress_update(100 * _run.part)
        text = pgettext_iface("Caustics: {}. Esc: stop, and keep what is traced").format(_run.text())
        context.workspace.status_text_set(text)
        if context.area:
            context.area.tag_redraw()

    def _closed(self, context, state):
        """Leave the window as it was; returns `state`."""
        _stop()
        _release()
        if context.area:
            context.area.tag_redraw()
        return state


def _left(scene):
    """Whether there is anything to clear, from what is known if that is fresh."""
    return _known[scene.session_uid].left if scene.session_uid in _fresh else caustics.left(scene)


class NIM_OT_clear_caustics(bpy.types.Operator):
    """Take the baked caustics out of this scene; its surfaces and lamps are as before"""

    bl_idname = "nim.clear_caustics"
    bl_label = "Clear Caustics"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        problem = None
        if _run is not None:
            problem = "Caustics are being baked; Esc stops it"
        elif context.mode != "OBJECT":
            problem = "Leave the mode you are in for Object Mode first"
        elif not _left(context.scene):
            problem = "This scene has no baked caustics"
        if problem:
            cls.poll_message_set(problem)
        return problem is None

    def execute(self, context):
        caustics.clear(context.scene)
        forget()
        self.report({"INFO"}, pgettext_rpt("Caustics cleared"))
        return {"FINISHED"}


def _millions(photons):
    return f"{photons / MILLION:.3g}"


# ------------------------------------------------------------------------------------------------ the panel


class NIM_PT_caustics(bpy.types.Panel):
    """Light that interfaces and mirrors gather on surfaces, traced from the lamps"""

    bl_idname = "NIM_PT_caustics"
    bl_label = "Caustics"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "NIM"
    bl_order = 15

    def draw(self, context):
        layout = self.layout
        settings = context.scene.nim_caustics
        known = _look(context.scene)
        row = layout.row(align=True)
        text = "Bake Again" if known and known.baked else "Bake Caustics"
        row.operator("nim.bake_caustics", text=text, icon="LIGHT_SUN")
        row.operator("nim.clear_caustics", text="", icon="TRASH")
        if _run is not None:
            layout.progress(factor=_run.part, text=_run.text())
            layout.label(text="Esc: stop, and keep what is traced")
        elif known:
            _draw_known(layout, context, known)
        column = layout.column()
        column.enabled = _run is None
        column.use_property_split = True
        column.use_property_decorate = False
        column.prop(settings, "photons")
        column.prop(settings, "texels")
        column.prop(settings, "seed")


def _draw_known(layout, context, known):
    column = layout.column(align=True)
    if not known.baked:
        column.label(text="No caustics yet", icon="INFO")
    elif known.stale:
        scenes.draw_sentence(column, context, pgettext_iface("Out of date: the scene has changed since"), "ERROR")
    else:
        column.label(text="Up to date", icon="CHECKMARK")
    if known.made:
        made = known.made
        values = {"millions": _millions(made["photons"]), "time": duration(made["seconds"])}
        text = pgettext_iface("{millions} million photons in {time}").format(**values)
        column.label(text=text, icon="BLANK1", translate=False)
        text = pgettext_iface("Surfaces: {count}, {size:.0f} MB")
        text = text.format(count=made["surfaces"], size=max(made["megabytes"], 1))
        column.label(text=text, icon="BLANK1", translate=False)
    none = pgettext_iface("No lamp shines here: add a sun, a point, a spot or an area")
    scenes.draw_sentence(layout, context, known.lights or none, "LIGHT" if known.lights else "ERROR")


@persistent
def _changed(scene, depsgraph=None):
    if depsgraph is not None:
        forget_changed(_meshes, depsgraph)
    if _counts(depsgraph):
        _fresh.discard(scene.session_uid)


def _counts(depsgraph):
    """Whether an update can be of what is traced or named here. What is hidden is not evaluated, and comes without any."""
    updates = depsgraph.updates if depsgraph else ()
    return not len(updates) or any(_is_change(one) for one in updates)


def _is_change(update):
    one = update.id
    kind = one.type if isinstance(one, bpy.types.Object) else type(one).__name__.upper()
    told = update.is_updated_geometry or update.is_updated_transform or update.is_updated_shading
    return kind == "LIGHT" or (told and kind != "CAMERA")


@persistent
def forget(*_):
    """Forget what is known: another file, or another state of this one."""
    _known.clear()
    _fresh.clear()
    _meshes.clear()


@persistent
def _leave(*_):
    """Drop a bake before its scene goes."""
    _stop()


CLASSES = (NIM_PG_caustics, NIM_OT_bake_caustics, NIM_OT_clear_caustics, NIM_PT_caustics)
_HANDLERS = (
    ("depsgraph_update_post", _changed),
    ("frame_change_post", _changed),
    ("undo_post", forget),
    ("redo_post", forget),
    ("load_post", forget),
    ("undo_pre", _leave),
    ("redo_pre", _leave),
    ("load_pre", _leave),
)


def register():
    """Give every scene its settings, and watch for changes."""
    bpy.types.Scene.nim_caustics = PointerProperty(
        type=NIM_PG_caustics, name="Caustics", description="How the caustics of this scene are traced"
    )
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister():
    """Take both back."""
    _stop()
    _release()
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
    forget()
    del bpy.types.Scene.nim_caustics
