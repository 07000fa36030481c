"""Worlds: the arrays of a batch, and the step that advances them."""
