from physics.kernels.compiler import kernel


def workspace_sizes(n):
    return 1, 1


@kernel
def normal_fallback(W, b, n, p, wf, wi):
    return 1, 0


@kernel
def pyramid_fallback(W, b, mu, n, p, wf, wi):
    return 1, 0
