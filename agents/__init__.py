"""Training, evaluation and recording of agents, and baselines to compare them with, on Stable-Baselines3."""
