"""Error against time of simulations, beside other engines."""
