"""Time stepping of single bodies: impacts at their times, Moreau's midpoint step between them."""
