"""Who makes the occluders: a command on this machine, or a service."""

import bpy
from bpy.props import EnumProperty, StringProperty

from .command import CommandRun
from .run import RunError
from .service import ServiceRun


class OccluderPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    maker: EnumProperty(
        name="Made by",
        items=[
            ("COMMAND", "Command", "The occluder command on this machine"),
            ("SERVICE", "Service", "An occluder service, by its address"),
        ],
    )
    command: StringProperty(
        name="Command",
        description="Path of the occluder command, or its name where it is on PATH",
        default="occluder",
        subtype="FILE_PATH",
    )
    server: StringProperty(name="Service", default="http://127.0.0.1:8000")
    key: StringProperty(
        name="Key",
        description="API key, where the service needs one. Blender saves it as plain text",
        subtype="PASSWORD",
    )

    def draw(self, _context):
        layout = self.layout
        layout.prop(self, "maker", expand=True)
        for name in ("command",) if self.maker == "COMMAND" else ("server", "key"):
            layout.prop(self, name)


def start_run(context, mesh, options):
    """Begin to make an occluder of a PLY; raises RunError."""
    chosen = context.preferences.addons[__package__].preferences
    if chosen.maker == "COMMAND":
        return CommandRun(bpy.path.abspath(chosen.command), mesh, options, bpy.app.tempdir)
    if not bpy.app.online_access:
        raise RunError("allow online access in Preferences > System, or choose the command")
    return ServiceRun(chosen.server, chosen.key, mesh, options)


def register():
    bpy.utils.register_class(OccluderPreferences)


def unregister():
    bpy.utils.unregister_class(OccluderPreferences)
