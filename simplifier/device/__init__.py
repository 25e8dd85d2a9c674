"""What draws pictures and measures candidates: the processor, or a graphics card by OpenGL."""
