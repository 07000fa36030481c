"""The viewer, without a browser."""
