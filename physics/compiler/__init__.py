"""Compilers of kernels: decorators, three compilers, and caches of machine code. It imports nothing else of physics."""
