"""What a job is, and what storage and engines promise each other."""
