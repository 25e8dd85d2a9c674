"""How kernels become machine code: compiled ahead of the first call, a file at a time, and kept."""
