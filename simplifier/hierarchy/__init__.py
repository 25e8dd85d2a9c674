"""Scenes of many objects to trees of occluders (section 5 of the paper)."""
