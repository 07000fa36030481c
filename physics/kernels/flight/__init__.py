"""Motion of a body that touches nothing: the exact flow, and the textbook integrators."""
