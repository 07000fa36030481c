"""Memory layouts: state of a body, records of a step, and the contact laws that a kernel is compiled for."""
