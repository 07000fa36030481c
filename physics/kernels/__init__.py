"""Compiled pure functions on plain numbers and arrays.

Nothing here knows a scene, a world or an environment. Conventions: see
``docs/conventions.md`` (SI units; quaternions are (w, x, y, z), body to world).
"""
