"""Slices through what is closed or flat, in all of 3D."""
