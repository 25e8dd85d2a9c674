"""From a triangle soup to a handful of triangles that hide nearly the same.

    import simplifier

    mesh = simplifier.load("castle.glb")
    result = simplifier.simplify(mesh, budget=64, ground=True)
    result.save("castle_occluder.glb")
    measured = result.measure()
    print(measured.precision, measured.recall)
    json.dump(measured.report(), file)               # what --report writes

    chain = simplifier.simplify(mesh, lods=3).chain  # levels of detail
    found = simplifier.evaluate(mesh, simplifier.load_occluder("by_hand.glb"))

    scene = simplifier.load_scene("city.glb")
    tree = simplifier.simplify_scene(scene, "city_occluders", ground=True)
    culler = simplifier.Culler(tree, simplifier.DepthBuffer())
    verdicts = culler.cull(camera).verdicts

    sets = simplifier.find_visible_sets("city.glb", up="z")
    sets.save("city.pvs")
    pvs = simplifier.load_pvs("city.pvs")            # what can be seen from each view cell
    seen = pvs.visible((12.0, 1.7, -3.0))

``__init__.pyi`` lists the names and where each is; that list is what is imported.  Errors are
:class:`OccluderError` and its kinds.  Commands from outside use :mod:`simplifier.cli.plugin`.
A name is imported when it is first used, so that a process that only describes options or loads
nothing stays without numpy.
"""

import lazy_loader

from simplifier.version import VERSION as __version__

__getattr__, _, __all__ = lazy_loader.attach_stub(__name__, __file__)
__all__ += ["__version__"]


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
