"""Arrays of a world whose bodies touch each other."""
