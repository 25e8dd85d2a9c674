"""The blobs: in files of one server, or in a bucket that several share."""
