"""Time stepping of single bodies: impacts where they happen, Moreau's midpoint step between them."""
