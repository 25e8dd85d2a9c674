"""A walk through a scene, played."""
