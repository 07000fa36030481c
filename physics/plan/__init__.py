"""Plans: the scheme, effects and settings for which the kernels of a scene are compiled."""
