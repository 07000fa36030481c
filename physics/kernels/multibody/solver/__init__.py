"""Solvers of the contact problem of all bodies of a world."""
