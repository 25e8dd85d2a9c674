"""The panel in the sidebar of the 3D view."""

import bpy

from .geometry import MARK, is_occluder, occluder_of
from .operator import OBJECT_OT_make_occluder

_ASKED = (
    "budget", "preset", "scope", "ground", "above", "smallest_hole", "transparent", "suffix",
)  # fmt: skip


class VIEW3D_PT_planar_occluder(bpy.types.Panel):
    bl_label = "Occluder"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Occluder"

    def draw(self, context):
        layout, settings = self.layout, context.scene.planar_occluder
        layout.use_property_split = True
        for name in _ASKED:
            layout.prop(settings, name)
        layout.operator(OBJECT_OT_make_occluder.bl_idname)
        layout.prop(settings, "preview")
        for line in figures(context.active_object):
            layout.label(text=line)


def figures(item):
    """Lines on the occluder that an object is or has."""
    occluder = item if item is None or is_occluder(item) else occluder_of(item)
    if occluder is None:
        return []
    found = occluder[MARK]
    shares = (
        f"{name.capitalize()} {found[name]:.1%}"
        for name in ("recall", "precision")
        if name in found
    )
    return [f"{found['triangles']} triangles", *shares]


def register():
    bpy.utils.register_class(VIEW3D_PT_planar_occluder)


def unregister():
    bpy.utils.unregister_class(VIEW3D_PT_planar_occluder)
