"""Queries of a scene in its present state, without a step: rays, nearest points, overlap."""
