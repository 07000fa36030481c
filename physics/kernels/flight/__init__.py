"""Motion of a body without contact: the exact flow, and the textbook integrators (Euler, midpoint, Runge-Kutta)."""
