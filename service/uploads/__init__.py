"""What requests bring, read as it comes: files into blobs, and texts beside them."""
