"""What the panel asks for, kept in the scene."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from . import overlay


class OccluderSettings(bpy.types.PropertyGroup):
    budget: IntProperty(
        name="Budget", description="Most triangles of an occluder", default=64, min=1, max=100_000
    )
    preset: EnumProperty(
        name="Preset",
        description="How much time to spend",
        items=[("draft", "Draft", ""), ("balanced", "Balanced", ""), ("best", "Best", "")],
        default="balanced",
    )
    scope: EnumProperty(
        name="Make",
        items=[
            ("EACH", "One for Each", "An occluder for each selected object"),
            ("TOGETHER", "One for All", "One for all of them, a child of the active object"),
        ],
    )
    ground: BoolProperty(
        name="Stands on Ground", description="The base may be open: it counts as closed"
    )
    above: BoolProperty(
        name="Seen from Above", description="Viewers are level with the object or above it"
    )
    smallest_hole: FloatProperty(
        name="Smallest Hole",
        description="Openings narrower than this count as closed",
        min=0.0,
        subtype="DISTANCE",
    )
    transparent: EnumProperty(
        name="See-through",
        description="Faces of materials that one can see through, which must hide nothing",
        items=[("leave-out", "Leave Out", ""), ("keep", "Keep", "")],
        default="leave-out",
    )
    suffix: StringProperty(
        name="Suffix",
        description="Of the occluder's name. Godot makes an occluder of what ends in -occonly",
        default="_occluder",
    )
    preview: BoolProperty(
        name="Preview",
        description="Draw all occluders over the scene",
        update=lambda self, _context: overlay.show(self.preview),
    )

    def options(self):
        """By the names of ``occluder simplify``."""
        return {
            "budget": self.budget,
            "preset": self.preset,
            "up": "z",
            "ground": self.ground,
            "viewers": "above" if self.above else "all",
            "smallest_hole": self.smallest_hole,
            "transparent": self.transparent,
        }


def register():
    bpy.utils.register_class(OccluderSettings)
    bpy.types.Scene.planar_occluder = bpy.props.PointerProperty(type=OccluderSettings)


def unregister():
    del bpy.types.Scene.planar_occluder
    bpy.utils.unregister_class(OccluderSettings)
