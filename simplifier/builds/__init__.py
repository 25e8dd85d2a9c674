"""``occluder build``: a manifest of many meshes to occluders that are current, and the proof of it.

A run reads the manifest (``manifest.py``), plans its assets (``plan.py``), compares them with the
record of what was made (``record.py``, ``staleness.py``), makes what is stale (``making.py``, here
or by an entry point of ``makers.py`` elsewhere) and judges all of them (``requirements.py``).  What
only compares imports no numpy.
"""
