"""Energies, trajectories, and the exercises of the course notes."""
