"""What compiles kernels, in a process of its own: numba, LLVM, and what stands in for parts."""
