"""Fused compiler: it links all kernels of a step before they are optimised once, through private parts of Numba."""
