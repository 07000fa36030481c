"""Force fields: forces and torques that depend on a body's pose, velocities and time. One module per kind of field."""
