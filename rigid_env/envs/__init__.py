"""Gymnasium environments: single, native vector, Stable-Baselines3."""
