"""What of a scene is solid, and so hides."""
