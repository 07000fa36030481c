"""The compiler: decorators of kernels, the cache of machine code, and what of Numba is extended."""
