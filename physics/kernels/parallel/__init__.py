"""Work shared by threads without Python's lock: atomics, work stealing, spinning workers."""
