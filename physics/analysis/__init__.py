"""Analysis of simulations: trajectories, energies and momenta, events, and exercises of the course notes."""
