"""Memory layouts of the kernels: states and parameters of bodies, records of a step, sleep, and contact laws."""
