"""Threads that share worlds in machine code, without Python's lock: atomics, work stealing, spinning workers."""
