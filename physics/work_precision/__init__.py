"""Work-precision diagrams: error against computing time of simulations, of this engine and of others."""
