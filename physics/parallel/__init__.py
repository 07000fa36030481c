"""Threads that share a batch of worlds, bound calls of kernels, and locks that let one thread at a time use a world."""
