"""Threads: a batch of worlds shared between them, and one thread at a time for a world."""
