"""From a kernel's Python to machine code, by way of Numba and LLVM."""
