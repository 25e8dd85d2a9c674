"""Which materials one can see through, and what is said of triangles left out for it."""

import bpy

_CLEAR = {"BSDF_TRANSPARENT", "BSDF_GLASS", "BSDF_REFRACTION"}
_OPAQUE_AT = {"Alpha": 1.0, "Transmission Weight": 0.0, "Transparency": 0.0}
"""Inputs of other shaders, by identifier, and the value at which these hide what is behind."""

_RENDERERS = "EEVEE", "CYCLES"
_NAMED = 5  # how many materials a remark lists

KEEP = "keep them with See-through: Keep"


def is_see_through(material):
    """Whether a material, or None, shows any of what is behind it.

    As it is declared, whatever colours and textures hold: its surface is blended, an input for
    that is linked or set, or a clear shader reaches its output, through whatever mix.
    """
    if material is None or not _has_nodes(material):
        return False
    if material.surface_render_method == "BLENDED":
        return True
    found = {material.node_tree.get_output_node(one) for one in _RENDERERS}
    return any(_shows_behind(output) for output in found if output is not None)


def omitted_words(omitted):
    """``12 see-through triangles were left out (material 'glass')``, of counts by name."""
    count = sum(omitted.values())
    noun = "triangle was" if count == 1 else "triangles were"
    more = len(omitted) - _NAMED
    names = ", ".join([f"material '{name}'" for name in omitted][:_NAMED])
    names += f" and {more} more" if more > 0 else ""
    return f"{count} see-through {noun} left out ({names})"


def _has_nodes(material):
    # From Blender 5.0 on all materials have; to ask is deprecated.
    return bpy.app.version >= (5, 0, 0) or material.use_nodes


def _shows_behind(output):
    surface, volume = output.inputs["Surface"], output.inputs["Volume"]
    if not _origin(surface)[0].is_output:
        return _origin(volume)[0].is_output  # fog without a surface
    return any(
        node.type in _CLEAR or any(_lets_through(socket, groups) for socket in node.inputs)
        for node, groups in _shaders(surface)
    )


def _lets_through(socket, groups):
    opaque = _OPAQUE_AT.get(socket.identifier)
    if opaque is None:
        return False
    origin, _ = _origin(socket, groups)
    return origin.is_output or origin.default_value != opaque


def _shaders(surface):
    """Each node that has a part in a surface, and the group nodes that it is in."""
    seen, rest = set(), [(surface, ())]
    while rest:
        origin, groups = _origin(*rest.pop())
        place = origin.node, groups
        if not origin.is_output or origin.node.mute or place in seen:
            continue
        seen.add(place)
        yield place
        rest += [(socket, groups) for socket in origin.node.inputs if socket.type == "SHADER"]


def _origin(socket, groups=()):
    """Where a socket's value comes from, and the group nodes that this is in, outermost first.

    That is an output of the node that computes it, or an input to which nothing is linked.
    """
    before = socket, groups
    while before is not None:
        socket, groups = before
        before = _before(socket, groups)
    return socket, groups


def _before(socket, groups):
    """What hands a socket its value, as for :func:`_origin`; None where it is the origin."""
    node = socket.node
    if not socket.is_output:
        links = [link for link in socket.links if link.is_valid and not link.is_muted]
        return (links[0].from_socket, groups) if links else None
    if node.mute:
        passing = [link for link in node.internal_links if link.to_socket == socket]
        return (passing[0].from_socket, groups) if passing else None
    if node.type == "REROUTE":
        return node.inputs[0], groups
    if node.type == "GROUP_INPUT" and groups:
        return _same(socket, groups[-1]), groups[:-1]
    if node.type == "GROUP" and node.node_tree is not None:
        ends = [one for one in node.node_tree.nodes if one.type == "GROUP_OUTPUT"]
        return next(
            ((_same(socket, end), (*groups, node)) for end in ends if end.is_active_output), None
        )
    return None


def _same(socket, node):
    """The input of a node that is on the other side of a group's border."""
    return next(one for one in node.inputs if one.identifier == socket.identifier)
