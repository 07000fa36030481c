"""Geometry of bodies at walls, which are half-spaces: support functions, contact points, gaps, contact-free times."""
