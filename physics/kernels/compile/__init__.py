"""The compiler: decorators of kernels, the cache of machine code, and extensions of Numba."""
