"""Stages of a step of worlds whose bodies touch each other."""
