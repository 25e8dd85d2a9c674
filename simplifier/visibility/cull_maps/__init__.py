"""Shadows of all that stands on the ground, fused (Wonka et al. 2000)."""
