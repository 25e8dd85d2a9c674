"""Where view cells are."""
