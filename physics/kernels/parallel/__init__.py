"""Threads that share work without Python's lock: atomics, work stealing, spinning workers."""
