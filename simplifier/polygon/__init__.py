"""Polygon -> Chain -> triangles: bridge, simplify, collapse (sections 4.3 and 4.4 of the paper)."""
