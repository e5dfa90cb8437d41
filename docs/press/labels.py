# SPDX-License-Identifier: GPL-3.0-or-later
"""Which labels of the sidebar's panels Blender would cut off, as they are drawn now: the panels draw into a layout that notes.

Folded parts are measured too.
"""

from types import SimpleNamespace

import blf
import bpy
from bpy.app.translations import pgettext_iface

# In Blender's units, measured in pictures of 4.3 and 5.2: see tests/ui/test_panels.py, whose numbers these are.
SIDEBAR, LINE, BEFORE, BEHIND, CHOSEN, ICON = 280, 210, 88, 112, 116, 18
EDGES = 10  # of a button, both together


def wide(text):
    """How wide Blender draws a text, in units at a scale of 1."""
    blf.size(0, 11)
    return blf.dimensions(0, text)[0]


class Noting:
    """Stands for a bpy.types.UILayout: what is drawn is measured. In a row all of it must fit, elsewhere each for itself."""

    def __init__(self, cut, room, split=False, row=False):
        self.__dict__.update(cut=cut, room=room, use_property_split=split, row_of=[] if row else None)

    def __getattr__(self, name):
        return lambda *_, **__: self

    def _inside(self, row=False, room=None):
        inner = Noting(self.cut, room or self.room, self.use_property_split, row)
        inner.__dict__["outer"] = self
        return inner

    def column(self, **_):
        return self._inside()

    def row(self, **_):
        return self._inside(row=True)

    def box(self):
        return self._inside(room=self.room - EDGES)

    def split(self, factor=0.5, **_):
        return self._inside(room=self.room * min(factor or 0.5, 1 - (factor or 0.5)))

    def grid_flow(self, columns=0, **_):
        return self._inside(room=self.room / max(columns, 1))

    def panel(self, *_, **__):
        return self._inside(), self._inside()

    def label(self, text="", text_ctxt=None, translate=True, icon="NONE", **_):
        self._note(text, text_ctxt, translate, icon)

    def operator(self, operator, text=None, text_ctxt=None, translate=True, icon="NONE", **_):
        group, name = operator.split(".")
        label = getattr(getattr(bpy.ops, group), name).get_rna_type().name if text is None else text
        self._note(label, text_ctxt or "Operator", translate, icon, EDGES)
        return SimpleNamespace()

    def menu(self, menu, text=None, text_ctxt=None, translate=True, icon="NONE", **_):
        self._note(
            getattr(bpy.types, menu).bl_label if text is None else text, text_ctxt, translate, icon, EDGES + ICON
        )

    def progress(self, text="", **_):
        self._note(text, None, False, "NONE", EDGES)

    def prop(self, data, name, text=None, text_ctxt=None, translate=True, icon="NONE", expand=False, **_):
        known = data.bl_rna.properties[name]
        label = known.name if text is None else text
        if known.type == "ENUM":
            items = {item.identifier: item.name for item in known.enum_items}
            names = items.values() if expand else [items.get(getattr(data, name), "")]
            for item in names if expand else ():
                self._note(item, known.translation_context, True, "NONE", EDGES)
            shown = self._say(next(iter(names), ""), known.translation_context, True)
            if not expand and wide(shown) > CHOSEN + self.room - LINE and self.use_property_split:
                self.cut.append((shown, round(wide(shown)), CHOSEN))
        if self.use_property_split:
            said = self._say(label, text_ctxt or known.translation_context, translate)
            room = (BEHIND if known.type == "BOOLEAN" else BEFORE) + 0.4 * (self.room - LINE)
            if not expand and self.row_of is None and wide(said) > room:
                self.cut.append((said, round(wide(said)), round(room)))
        elif not expand:
            self._note(label, text_ctxt or known.translation_context, translate, icon, EDGES)

    def _say(self, text, context, translate):
        return pgettext_iface(text, context) if translate and text else text or ""

    def _note(self, text, context, translate, icon, edges=0):
        said = self._say(text, context, translate)
        need = wide(said) + ICON * (icon != "NONE") + edges
        if self.row_of is not None:
            self.row_of.append(need)
            need = sum(self.row_of)
        if need > self.room + (EDGES if edges else 0) + 4:
            self.cut.append((said, round(need), round(self.room)))


def drawn(panel, context):
    """The labels of a panel that are cut off as it is drawn now: (text, width, room)."""
    cut = []
    room = LINE + (context.region.width / context.preferences.system.ui_scale - SIDEBAR)
    panel.draw(SimpleNamespace(layout=Noting(cut, room), page=getattr(panel, "page", "")), context)
    return cut


def cut_off(window):
    """{(panel, text, width, room)} of all our panels in the sidebars that are open in a window."""
    found = set()
    for area in window.screen.areas:
        region = next((one for one in area.regions if one.type == "UI" and one.width > 1), None)
        if area.type not in ("VIEW_3D", "NODE_EDITOR") or region is None:
            continue
        with bpy.context.temp_override(window=window, area=area, region=region):
            for panel in bpy.types.Panel.__subclasses__():
                if not panel.__name__.startswith("NIM_PT") or panel.bl_space_type != area.type:
                    continue
                if panel.bl_region_type == "UI" and (not hasattr(panel, "poll") or panel.poll(bpy.context)):
                    found |= {(panel.bl_idname, *line) for line in drawn(panel, bpy.context)}
    return found
