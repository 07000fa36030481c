"""Linear complementarity problems: pivoting methods, and the certificate of a solution."""
