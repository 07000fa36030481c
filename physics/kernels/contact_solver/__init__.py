"""Solvers of the contact problem of one body at walls: the problem, and the input and output of all solvers.

The problem
-----------
A body has n contacts. Contact i has the impulse p_i = (normal, tangent 1, tangent 2) [N s] and the velocity u_i [m/s]
along the same axes, less its target. With the Delassus matrix W = J M⁻¹ Jᵀ [1/kg] and the velocities b without
impulses, less the targets,

    u = W p + b,    0 <= p_n ⟂ u_n >= 0,    |p_t| <= μ p_n,    u_t = 0 or p_t = -μ p_n u_t/|u_t|.

Friction with two coefficients becomes a stretched problem of this form (`contact_law.anisotropic_friction`). Compliant
walls have a larger diagonal of W (`contact_law.compliance`). Without friction only the normal rows remain.

Input
-----
n : int
    Number of contacts, one at least.
R : tuple of 9 floats
    Principal frame to world.
v, L : tuples of 3 floats
    Velocity [m/s] and angular momentum [kg m²/s] without contact impulses, world frame.
scratch : record
    Workspace of the body (`time_stepping.workspace`). Solvers read of its groups

    - `contacts`: `slot`, `arm`, `target` of each contact;
    - `contacts.impulse`, the warm start: 3 n numbers with friction, n without; zeros if there is none;
    - `scene.walls`; of `body` its `mass`, `J`, `radius`, `mu` and the members of its laws;
    - `stage.mode`, the direct method to try first, because it solved the last problem (`sliding_patch.TRY_STICKING`,
      `TRY_SLIDING`, `TRY_MIXED`);
    - `settings.tolerance` of the relative residual; `stage.residual_limit`, a tolerance of iterative solves [m/s];
      `stage.target_error_limit`, the allowed error of the targets of sticking contacts [m/s];
    - `settings.sweeps`, the largest number of sweeps.

Output
------
scratch.contacts.impulse
    The solution, along the unit tangents of each wall.
scratch.stage.mode
    The direct method that solved the problem. It is not changed by `single_wall` for one contact, and for two contacts
    that are left of a face, nor by iterative solves and pivoting.
v, L, residual, sweeps, method
    Returned by `solve.solve_contacts`: motion with the impulses, relative residual, sweeps and Newton steps made, and
    `METHOD_DIRECT`, `METHOD_SWEEPS` or `METHOD_PIVOTING` (`state.layout`), the last method tried.

Solvers also write to the group `solver` and to other members of `scratch`; no other kernel reads these.

Residual
--------
The residual is the natural map of the problem, in units of velocity. It is 0 at solutions and nowhere else:

    max over i of   |p_n - max(0, p_n - ρ u_n)|/ρ   and   |p_t - disk(p_t - ρ_t u_t, μ p_n)|/ρ_t,

with ρ = 1/W_nn, ρ_t = 1/λ_max(W_tt) of the contact's own block, and disk the projection onto a disk about 0 of the
radius μ p_n. It is divided by the largest free contact speed, max |b|, unless that is 0. How it is measured depends on
the solver:

- Sweeps, Newton's method and pivoting measure it on the impulses that they leave (`gauss_seidel.cone_residual`,
  `gauss_seidel.normal_residual`).
- `single_wall` reports a bound of the tangential part, with W_aa + W_bb instead of λ_max(W_tt). Pushing contacts meet
  their normal targets, and open ones do not close, to within the tolerance; for a face the residual leaves this out.
- `sticking` reports the largest distance of a velocity from its target, or the fastest approach of an open contact,
  divided by the largest free speed along the axes of the world. It reports 0 if that is rounding, or at most
  `target_error_limit`.

Failure
-------
No solver raises an exception. A solver reports its failure as follows, and `solve_contacts` then tries the next one:

- A direct solver returns `found` False, and has changed neither `contacts.impulse` nor `stage.mode`.
- Sweeps and Newton's method return a residual above their tolerance. Sweeps leave their last impulses, Newton's method
  leaves the best of its impulses, so that its residual is at most that of its start.
- The LCP solvers return a status other than `LCP_SOLVED`, and leave the impulses as they were.
- `solve_contacts` returns a residual above `settings.tolerance`. Callers count that as unconverged
  (`state.body.report_solve`).

Comparisons are written `not residual <= tolerance`, so that a residual of NaN counts as failure. Velocities that are
not finite have an infinite residual.

Solvers
-------
`solve_contacts` tries the solvers in this order, and takes the first result within its tolerance.

1. Direct, without W, to the tolerance `settings.tolerance` max |b|. They return (found, v, L, relative residual).

   a. `sticking.solve_all_sticking`: all contacts meet their targets, or open. It solves any number of contacts and
      walls, with friction, without compliance. It comes before b where it is more likely to succeed: for three or four
      contacts of one wall if friction may stop them (`patch_start.may_stick`), for two contacts, or several walls, if
      `stage.mode` is `TRY_STICKING`. Otherwise it comes after b, for a single contact always.
   b. `single_wall.solve_single_wall`: contacts stick, slide or open. It solves one to four contacts of one wall; at
      most two if walls are compliant. It calls `two_contacts.solve_one_contact` for one contact,
      `two_contacts.solve_two_contacts` for two, and `sliding_patch.solve_sliding_patch` for three or four. The latter
      is called once more, with `patient`, if it has opened a contact and found nothing. It calls in turn

      - `primal_dual_friction.solve_stick_slip_patch`, where a direction of sliding would reverse, and at first if
        `stage.mode` is `TRY_MIXED` and the warm start belongs to the present loads;
      - `two_contacts.solve_two_contacts`, once two contacts are left.

2. Iterative, on the assembled `contacts.delassus` and `contacts.bias`, starting from `contacts.impulse`. The tolerance
   is the smaller of `settings.tolerance` max |b| and `stage.residual_limit`, but not below rounding. They return
   (sweeps or steps, residual [m/s]), and leave u in `contacts.velocity`.

   a. Without friction `gauss_seidel.normal_sweeps`; if walls are compliant, after a few pivots of Dantzig's method.
   b. With friction a dozen sweeps by `gauss_seidel.cone_sweeps`, in turn with `proximal_newton.proximal_newton`; if
      walls are compliant, Newton's method comes first. This goes on until `settings.sweeps` sweeps are made.

3. Pivoting, if the plan has it and the residual is above both the tolerance and 1 % of max |b|. With friction this is
   `friction_pyramid.solve_pyramid_lcp` (Lemke's method), without it `friction_pyramid.solve_normal_lcp` (Dantzig's).
   They return (status, pivots). Their result is kept if it has the smaller residual.
"""
