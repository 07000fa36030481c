"""Plans: what of the engine a scene needs, and at which accuracy."""
