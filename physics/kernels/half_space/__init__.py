"""Bodies at walls: support functions, contact points, gaps, and times of flight without contact."""
