"""Solvers of the contact problem of one body, from closed forms to Newton's method."""
