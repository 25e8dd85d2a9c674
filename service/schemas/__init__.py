"""What goes over the wire: bodies of requests and answers, and options as requests give them."""
