"""Scenes: immutable descriptions of bodies, walls and effects, whose only numerics are mass properties."""
