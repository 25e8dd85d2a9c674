"""Values that the stages hand to each other: plain data, no algorithm.

Two spaces are used.  *World* is the space of the input file.  *Grid space* has its origin at the
corner of the voxel grid and one voxel as its unit; every stage between voxelization and the
finished occluder works there, so nothing depends on the scale or the offset of the input.
"""
