"""What occluders hide from a camera, and the truth to hold it against."""
