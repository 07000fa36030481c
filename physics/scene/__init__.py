"""Descriptions of scenes: bodies, walls, effects. No numerics beyond mass properties."""
