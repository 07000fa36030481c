"""Threads that share a batch of worlds, and locks that keep a world to one thread."""
