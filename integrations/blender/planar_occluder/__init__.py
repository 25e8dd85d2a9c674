"""Occluders for the selected objects, made by the ``occluder`` command or a service.

    panel, settings, preferences, overlay   what is seen
    operator > session                      one press of the button, object by object
    command | service                       who makes one: both are a ``Run``
    geometry, ply                           objects to triangles and back, and their file
    materials                               what one can see through, which is left out

Nothing of the library runs inside of Blender.
"""

from . import operator, overlay, panel, preferences, settings

_MODULES = preferences, settings, operator, panel, overlay


def register():
    for module in _MODULES:
        module.register()


def unregister():
    for module in reversed(_MODULES):
        module.unregister()
