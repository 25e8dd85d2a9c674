"""What requests bring, read as it comes: files into blobs, and the few fields beside them."""
