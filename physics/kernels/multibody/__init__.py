"""Worlds in which bodies touch each other: broad phase, narrow phase, one contact problem for all, one step."""
