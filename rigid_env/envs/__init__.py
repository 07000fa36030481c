"""Gymnasium environments of a task: single, native vector, and the adapter for Stable-Baselines3."""
