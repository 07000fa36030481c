"""Compiler `python`: kernels run as Python functions, with the arithmetic of machine code."""
