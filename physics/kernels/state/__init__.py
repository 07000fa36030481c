"""Memory layouts: state of a body, records of a step, and contact laws that a kernel is compiled for."""
