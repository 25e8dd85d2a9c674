"""What a camera sees of a scene, and what occluders hide from it."""
