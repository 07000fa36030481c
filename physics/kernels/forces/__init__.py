"""Force fields: forces and torques that depend on pose, velocities and time of a body. One file per field."""
