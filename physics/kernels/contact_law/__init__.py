"""Contact laws: target velocities of the contact problem, friction with two coefficients, restitution, compliance."""
