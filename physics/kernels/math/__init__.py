"""Quaternions, roots, small dense systems."""
