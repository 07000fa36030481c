"""Mass properties of shapes: mass, centre of mass and inertia tensor."""
