"""Broad phase: which bodies may touch within a stage."""
