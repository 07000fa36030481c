"""Kernels run by Python itself, with the results of machine code."""
