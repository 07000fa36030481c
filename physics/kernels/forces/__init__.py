"""Force fields: forces and torques that depend on where a body is, how it moves, and when. One file per field."""
