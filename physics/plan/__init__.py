"""Plans: the parts of the engine that a scene needs at an accuracy."""
