"""Mathematics of the kernels: vectors, quaternions, roots of parabolas, small linear systems, disjoint sets."""
