"""What compiles kernels, in a process of its own: numba, LLVM, and stand-ins for parts of them."""
