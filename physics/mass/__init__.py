"""Mass, centre, and inertia of shapes."""
