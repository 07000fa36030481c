"""Laws at a contact: target velocities, friction, restitution, compliance."""
