"""Where jobs and bytes stay: the database and the blobs."""
