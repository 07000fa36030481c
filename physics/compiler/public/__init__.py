"""Kernels compiled one by one, through public interfaces of Numba alone."""
