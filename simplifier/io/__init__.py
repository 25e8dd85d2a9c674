"""Files to meshes, scenes and camera paths, and occluders to files; a format is a file.

Nothing is imported here: what only needs to know the suffixes stays without numpy.
"""
