"""Bodies at walls: support functions, contact points, gaps, and how long a flight is sure to stay clear."""
