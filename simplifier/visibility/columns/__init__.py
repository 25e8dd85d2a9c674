"""Least altitudes over the tiles of a terrain from which others are seen."""
