"""Sets, cull maps and cells as pictures."""
