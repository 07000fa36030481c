"""Compilers of kernels, which import nothing else of physics: decorators, caches of machine code."""
