"""Broad phase: find the bodies that may touch within a stage."""
