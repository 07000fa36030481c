"""Compiler `numba`: kernels are compiled one by one, with public interfaces of Numba only."""
