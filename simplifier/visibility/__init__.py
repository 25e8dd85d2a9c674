"""From-region visibility: scene and view cells -> what may be seen from each cell."""
