"""Solve linear complementarity problems by pivoting: Lemke's and Dantzig's methods, and the check of a solution."""
