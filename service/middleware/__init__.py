"""What surrounds every request: its log, the headers of its answer, and where it may come from."""
