"""What goes over the wire: bodies of requests and answers, and what OpenAPI says of them."""
