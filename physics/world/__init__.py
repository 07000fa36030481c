"""Worlds: batches of copies of a scene with states of their own, and their steps, states, reports and snapshots."""
