"""Sets of visible objects, held against what is certainly seen."""
