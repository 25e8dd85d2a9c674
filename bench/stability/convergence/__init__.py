"""How far a report, a measure and an occluder are from what more views or pixels would give."""
