"""Mutants of the kernels that one body and its walls use, folder by folder."""

from __future__ import annotations

from tests.mutants.mutant import Mutant

_KERNELS, _TESTS = "physics/kernels/", "tests/"


def _mutant(name: str, fault: str, path: str, old: str, new: str, test: str) -> Mutant:
    """Mutant of a kernel with one test."""
    return Mutant(name, fault, _KERNELS + path, old, new, (_TESTS + test,))


MATH = [
    _mutant(
        "math-product",
        "The last component of the product of quaternions has the signs of the reversed product.",
        "math/quaternion.py",
        "a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],",
        "a[0] * b[3] - a[1] * b[2] + a[2] * b[1] + a[3] * b[0],",
        "kernels/test_quaternion.py::test_the_units_multiply_as_hamilton_wrote_on_the_bridge",
    ),
    _mutant(
        "math-matrix",
        "An entry of the rotation matrix is that of its transpose.",
        "math/quaternion.py",
        "xy + wz, 1.0 - (xx + zz), yz - wx,",
        "xy + wz, 1.0 - (xx + zz), yz + wx,",
        "kernels/test_quaternion.py::test_the_matrix_is_a_rotation_and_a_homomorphism",
    ),
    _mutant(
        "math-exponential",
        "The exponential's vector part is that of twice the angle.",
        "math/quaternion.py",
        "s = 0.5 * sinc",
        "s = sinc",
        "kernels/test_quaternion.py::test_the_exponential_turns_by_the_rotation_vector",
    ),
    _mutant(
        "math-parabola",
        "The slope at the start of a gap's parabola has the wrong sign of its bend.",
        "math/parabolic_root.py",
        "/ width - bend * width",
        "/ width + bend * width",
        "kernels/test_step.py::test_the_parabola_is_zero_where_it_is_said_to_be",
    ),
    _mutant(
        "math-pivot-order",
        "Elimination forgets the exchange of columns in its result.",
        "math/full_pivot_solve.py",
        "x[order[k]] = total / A[k, k]",
        "x[k] = total / A[k, k]",
        "kernels/test_events_linear.py::test_regular_systems_are_solved_as_numpy_does",
    ),
]

LCP = [
    _mutant(
        "lcp-refinement",
        "Principal pivoting replaces a solution by its refinement instead of adding it.",
        "lcp/dantzig.py",
        "z[clamped[r]] += x[r]",
        "z[clamped[r]] = x[r]",
        "kernels/test_dantzig.py::test_baraff_1994_block_on_four_coplanar_contacts_carries_its_weight",
    ),
    _mutant(
        "lcp-scale",
        "Principal pivoting returns a solution in scaled units of q.",
        "lcp/dantzig.py",
        "* (whole / q_scale)",
        "* whole",
        "kernels/test_dantzig.py::test_scaling_by_powers_of_two_scales_z_bit_for_bit",
    ),
    _mutant(
        "lcp-tie",
        "Lemke's path breaks ties without the lexicographic rule.",
        "lcp/lemke.py",
        "        count = filter_tied_rows(tableau, basis, n, c, k, count)\n    return tied[0]",
        "        count = count - 1\n    return tied[0]",
        "kernels/test_lemke.py::test_kostreva_1979_example_1_cycles_without_a_tie_rule",
    ),
    _mutant(
        "lcp-pivot",
        "A pivot of Lemke's tableau leaves its own entry as it was.",
        "lcp/lemke.py",
        "tableau[r, c] = 1.0 / pivot",
        "tableau[r, c] = pivot",
        "kernels/test_lemke.py",
    ),
]

FLIGHT = [
    _mutant(
        "flight-gyroscopic",
        "The gyroscopic torque about the first axis has the wrong sign.",
        "flight/free_rotation.py",
        "n1 = (C * m1 + D * g1) * inv_N",
        "n1 = (C * m1 - D * g1) * inv_N",
        "kernels/test_rotation.py::test_flow_keeps_unit_length_energy_and_reverses",
    ),
    _mutant(
        "flight-period",
        "The period of the momentum is half as long.",
        "flight/free_rotation.py",
        "return 2.0 * math.pi / high",
        "return math.pi / high",
        "kernels/test_rotation.py::test_period_of_the_momentum_is_that_of_the_elliptic_functions",
    ),
    _mutant(
        "flight-rk4-weights",
        "The classical Runge-Kutta method takes k3 once instead of twice.",
        "flight/integrators.py",
        "mean = _along4(_along4(k1, 2.0, k2), 1.0, _along4(k4, 2.0, k3))",
        "mean = _along4(_along4(k1, 2.0, k2), 1.0, _along4(k4, 1.0, k3))",
        "kernels/test_schemes.py::test_order_of_the_attitude_of_a_tumbling_block",
    ),
    _mutant(
        "flight-semi-implicit",
        "Semi-implicit Euler moves a body with the velocity at the start of the step.",
        "flight/integrators.py",
        "return (_along3(x, h, v_new), normalise(euler_attitude(q, L_new,",
        "return (_along3(x, h, v), normalise(euler_attitude(q, L_new,",
        "kernels/test_schemes.py::test_free_flight_is_the_discrete_parabola",
    ),
    _mutant(
        "flight-parabola",
        "A body in flight falls twice as far.",
        "flight/free_flight.py",
        "half = 0.5 * h * h",
        "half = h * h",
        "physics/test_flight.py::test_hard_case_4_parabola_is_exact_at_any_step",
    ),
]

FORCES = [
    _mutant(
        "forces-faces",
        "The shadow of a hull is that of all its faces, instead of half of it.",
        "forces/drag_of_shapes.py",
        "return 0.25 * total",
        "return 0.5 * total",
        "physics/test_fields_of_shapes.py::test_drag_is_that_of_the_shadow",
    ),
    _mutant(
        "forces-segment",
        "The moment of a wet segment of a disk is half of what it is.",
        "forces/wet_revolution.py",
        "rho * rho * rho * 2.0 / 3.0",
        "rho * rho * rho * 1.0 / 3.0",
        "physics/test_fields_of_shapes.py::test_buoyancy_is_the_slope_of_its_energy",
    ),
    _mutant(
        "forces-shadow",
        "Drag takes the first half edge twice for the area of a face.",
        "forces/drag.py",
        "a = (dims[1] * dims[2] * b[0],",
        "a = (dims[0] * dims[2] * b[0],",
        "physics/test_fields.py::test_the_shadow_of_a_turned_body",
    ),
    _mutant(
        "forces-cap",
        "The centre of a spherical cap is half as deep.",
        "forces/submerged_volume.py",
        "/ (4.0 * (3.0 * r - h))",
        "/ (8.0 * (3.0 * r - h))",
        "kernels/test_submerged.py::test_an_ellipsoid_by_its_slices",
    ),
    _mutant(
        "forces-cone",
        "The centre of a cone of a block's wet part is too near to its tip.",
        "forces/submerged_volume.py",
        "times(0.25 * cone, o)",
        "times(0.75 * cone, o)",
        "kernels/test_submerged.py::test_a_block_is_cut_as_qhull_cuts_it",
    ),
    _mutant(
        "forces-lift",
        "The Magnus force has the wrong sign.",
        "forces/magnus.py",
        "qt.cross(state.w, u)), ZERO",
        "qt.cross(u, state.w)), ZERO",
        "physics/test_fields.py::test_a_ball_with_lift_flies_in_circles",
    ),
    _mutant(
        "forces-lag",
        "The mean of a lagging actuator is that of its start.",
        "forces/actuator_lag.py",
        "mean = share * (command[i, c] + kept * gap)",
        "mean = share * (command[i, c] + gap)",
        "physics/test_actuator.py::test_a_step_of_the_command_arrives_as_lag_and_dead_time_say",
    ),
]

HALF_SPACE = [
    _mutant(
        "half-space-arm-rate",
        "The contact point of an ellipsoid wanders at a rate in wrong units.",
        "half_space/contact_point.py",
        "along = qt.dot(e, f) / (s * s)",
        "along = qt.dot(e, f) / s",
        "kernels/test_events_linear.py::test_contact_point_is_the_support_and_moves_as_its_difference_quotient_says",
    ),
    _mutant(
        "half-space-vertex",
        "The second axis of a vertex has the sign of the first.",
        "half_space/support_function.py",
        "h += e[1] if k & 2 else -e[1]",
        "h += e[1] if k & 1 else -e[1]",
        "kernels/test_geometry.py::test_all_at_once_they_are_what_each_is",
    ),
    _mutant(
        "half-space-turning",
        "Turning adds to the speed of a contact with the wrong sign.",
        "half_space/contact_set.py",
        "m = qt.cross(n, w)  # n·(ω x r) = (n x ω)·r",
        "m = qt.cross(w, n)",
        "kernels/test_contact.py::test_the_set_is_what_touches_or_arrives",
    ),
    _mutant(
        "half-space-forgotten",
        "A contact that pushed in the last stage is forgotten as soon as it leaves.",
        "half_space/contact_set.py",
        "scratch.stage.is_last == 1 or last_normal_impulse(slot, memory, scratch) > 0.0",
        "scratch.stage.is_last == 1",
        "kernels/test_contact.py::test_what_pushed_and_may_be_back_within_the_step_belongs_to_the_set",
    ),
]

CONTACT_LAW = [
    _mutant(
        "contact-law-rebound",
        "The restitution target of each contact is that of the first one.",
        "contact_law/target_velocity.py",
        "s = -contacts.speed[i]",
        "s = -contacts.speed[0]",
        "kernels/test_aims.py::test_an_impact_is_what_one_contact_of_it_is",
    ),
    _mutant(
        "contact-law-centripetal",
        "The target of a resting contact adds one of its two accelerations with the wrong sign.",
        "contact_law/target_velocity.py",
        "c = (-half * (a[0] + b[0]),",
        "c = (-half * (a[0] - b[0]),",
        "kernels/test_aims.py::test_each_contact_is_asked_for_what_the_formula_says",
    ),
    _mutant(
        "contact-law-stretch",
        "The spin about the second tangent of an anisotropic wall is not stretched.",
        "contact_law/anisotropic_friction.py",
        "(w[0], w[1], s * w[2]),",
        "(w[0], w[1], w[2]),",
        "kernels/test_ellipse.py::test_impulses_dissipate_most",
    ),
    _mutant(
        "contact-law-give",
        "The compliance of a stage leaves out its length.",
        "contact_law/compliance.py",
        "body.give = 1.0 / (h * D)",
        "body.give = 1.0 / D",
        "physics/test_compliance.py::test_a_bobbing_ball_is_the_discrete_scheme",
    ),
]

CONTACT_SOLVER = [
    _mutant(
        "contact-solver-cone",
        "The cone of friction of a sliding contact has the radius of the coefficient 1.",
        "contact_solver/one_contact.py",
        "s = -mu * inverse_root(square)",
        "s = -inverse_root(square)",
        "kernels/test_slide.py::test_one_contact_opens_holds_or_slides",
    ),
    _mutant(
        "contact-solver-block",
        "An entry of the matrix between two contacts has the wrong sign.",
        "contact_solver/one_contact.py",
        "inv_mass + (c * s2 - b * s0), c * t2 - b * t0,\n        a * n0",
        "inv_mass + (c * s2 - b * s0), b * t0 - c * t2,\n        a * n0",
        "kernels/test_slide.py::test_blocks_of_the_wall_frame_are_those_of_the_dense_matrix",
    ),
    _mutant(
        "contact-solver-arm",
        "The moment of a contact about the third axis adds the wrong products of its arm.",
        "contact_solver/gauss_seidel.py",
        "z * a - x * d, x * b - y * a",
        "z * a - x * d, x * b + y * a",
        "kernels/test_sweeps.py::test_the_assembled_problem_is_the_dense_one",
    ),
    _mutant(
        "holding-cone",
        "Forces that hold a body may be outside their friction cones by a fiftieth.",
        "contact_solver/holding.py",
        "if size <= mu * y:",
        "if size <= 1.02 * mu * y:",
        "physics/test_holding.py::test_a_block_holds_to_the_limit_of_friction[precise]",
    ),
    _mutant(
        "holding-never",
        "A body at rest on four contacts is not asked whether it can hold.",
        "contact_solver/holding.py",
        "if n < 3 or",
        "if n < 5 or",
        "physics/test_holding.py::test_a_block_holds_to_the_limit_of_friction[precise]",
    ),
    _mutant(
        "contact-solver-target",
        "The target of one of two contacts counts twice.",
        "contact_solver/contact_pair.py",
        "f[0] - contacts.target[i, 0], f[1]",
        "f[0] - 2.0 * contacts.target[i, 0], f[1]",
        "kernels/test_direct.py::test_any_targets_are_met",
    ),
]

EVENT_DRIVEN = [
    _mutant(
        "event-driven-root",
        "A falling gap closes in half of its time.",
        "event_driven/time_of_impact.py",
        "return 2.0 * g / (math.sqrt(disc) - r)",
        "return g / (math.sqrt(disc) - r)",
        "kernels/test_events_air.py::test_parabola_root_is_the_first_zero",
    ),
    _mutant(
        "event-driven-horizon",
        "The bound of a gap's third derivative counts half, so that a flight goes on into a wall.",
        "event_driven/time_of_impact.py",
        "b - third * over / 3.0",
        "b - third * over / 6.0",
        "kernels/test_events_air.py::test_safe_time_is_safe_and_cannot_be_doubled",
    ),
    _mutant(
        "event-driven-moment",
        "The total moment of the contacts sums their forces.",
        "event_driven/force_system.py",
        "moment = plus(moment, times(s, row_vector(unknowns.column_moment, k, 0)))",
        "moment = plus(moment, times(s, row_vector(unknowns.column_force, k, 0)))",
        "kernels/test_events_unknowns.py::test_rows_that_are_independent_are_all_met",
    ),
    _mutant(
        "event-driven-rebound",
        "A capped rebound keeps the impulses of the plastic impact.",
        "event_driven/impact.py",
        "scratch.contacts.impulse[k] += s * (contacts.rebound[k] - scratch.contacts.impulse[k])",
        "scratch.contacts.impulse[k] += 0.0 * (contacts.rebound[k] - scratch.contacts.impulse[k])",
        "physics/test_events.py::test_a_rebound_that_friction_turns_round_takes_all_the_energy_there_is_and_no_more",
    ),
    _mutant(
        "event-driven-implicit-table",
        "The table of the implicit rule takes its error to be a series in the square of a part.",
        "event_driven/implicit_extrapolation.py",
        "(_PARTS[k] / _PARTS[k - j] - 1.0)",
        "((_PARTS[k] / _PARTS[k - j]) ** 2 - 1.0)",
        "physics/test_events_slow_slide.py::test_a_block_that_friction_nearly_holds_moves_as_its_equations_say",
    ),
    _mutant(
        "event-driven-implicit-sign",
        "The implicit rule goes against the Jacobian.",
        "event_driven/implicit_extrapolation.py",
        "matrix[i, k] = -s * smooth.jacobian[i, k]",
        "matrix[i, k] = s * smooth.jacobian[i, k]",
        "physics/test_events_slow_slide.py::test_the_cost_of_a_slow_slide_does_not_grow_with_its_stiffness",
    ),
    _mutant(
        "event-driven-turning-point",
        "A body falls asleep at its turning point.",
        "event_driven/falling_asleep.py",
        "acceleration_bound(y, offset_frame, scratch, motion) <=",
        "0.0 <=",
        "physics/test_sleeping_precise.py::test_a_bounce_in_a_period_that_divides_the_step_does_not_sleep",
    ),
    _mutant(
        "event-driven-wake",
        "A sleeping body is left out of a step under a new wrench.",
        "event_driven/step.py",
        "if sleep is not None and remains_asleep(i, bodies.wrench, sleep):",
        "if sleep is not None and sleep.rows[i, 0] > 0.0:",
        "physics/test_sleeping_precise.py::"
        "test_a_block_at_rest_sleeps_for_nothing_and_wakes_with_the_bits_of_one_that_never_slept",
    ),
]

PARALLEL = [
    _mutant(
        "parallel-ranges",
        "A thread looks for worlds in one range less than there are.",
        "parallel/work_stealing.py",
        "for _ in range(1, turns.shape[0]):",
        "for _ in range(2, turns.shape[0]):",
        "physics/test_threads.py::test_whoever_is_fast_each_world_is_taken_once",
    ),
    _mutant(
        "parallel-chunk",
        "Of a chunk of worlds only the first one is stepped.",
        "parallel/work_stealing.py",
        "min(world + chunk, turns[place, RANGE_END])",
        "min(world + 1, turns[place, RANGE_END])",
        "physics/test_threads.py::test_whoever_is_fast_each_world_is_taken_once",
    ),
    _mutant(
        "parallel-exception",
        "The leader does not hear of exceptions in the calls of others.",
        "parallel/spin_wait_workers.py",
        "return RUN_FAILED if atomic_load(crew, 0, CREW_FAILED_COUNT) > 0 else RUN_DONE",
        "return RUN_DONE",
        "physics/test_threads.py::test_what_a_thread_raises_is_raised_and_the_team_goes_on",
    ),
]

STATE = [
    _mutant(
        "state-frame",
        "The principal frame is added to an attitude instead of taken off.",
        "state/body.py",
        "return qt.multiply(q, (p[0], -p[1], -p[2], -p[3]))",
        "return qt.multiply(q, (p[0], p[1], p[2], p[3]))",
        "physics/test_flight.py::test_gyroscopic_torque_is_left_out_when_isotropic_and_tilted_axes_are_seen",
    ),
    _mutant(
        "state-finite",
        "Numbers that are not finite pass in half of the lanes.",
        "state/copy_if_finite.py",
        "return lane_sum(first + second) + odd == 0.0",
        "return lane_sum(first) + odd == 0.0",
        "kernels/test_intake.py::test_one_that_is_not_finite_is_noticed_wherever_it_stands",
    ),
    _mutant(
        "state-windows",
        "A body sleeps after one quiet window.",
        "state/sleeping.py",
        "return rows[i, QUIET_WINDOWS] >= WINDOWS_BEFORE_SLEEP",
        "return rows[i, QUIET_WINDOWS] >= 1.0",
        "physics/test_sleeping.py::test_a_block_at_rest_sleeps_after_two_windows_and_then_costs_nothing",
    ),
    _mutant(
        "state-wake",
        "A body sleeps on under a new wrench.",
        "state/sleeping.py",
        "    if has_new_wrench(i, wrench, sleep):\n        wake_body(i, sleep)\n    return",
        "    has_new_wrench(i, wrench, sleep)\n    return",
        "physics/test_sleeping.py::test_a_push_beyond_friction_wakes_it_and_it_goes_as_the_law_says",
    ),
]

TIME_STEPPING = [
    _mutant(
        "time-stepping-forces",
        "The impulse that brings a body back to rest is no part of its contact forces.",
        "time_stepping/warm_start.py",
        "memory[scratch.body.i, base + c] += contacts.rebound[width * k + c]",
        "memory[scratch.body.i, base + c] += 0.0",
        "physics/test_momentum_balance.py",
    ),
    _mutant(
        "time-stepping-stale",
        "The warm start keeps impulses of contacts that have ended.",
        "time_stepping/warm_start.py",
        "memory[i, base + c] = 0.0",
        "memory[i, base + c] *= 1.0",
        "kernels/test_contact.py::test_impulses_are_found_by_the_name_of_their_contact",
    ),
    _mutant(
        "time-stepping-scale",
        "The warm start is not scaled to the length of the stage.",
        "time_stepping/warm_start.py",
        "scale = h / memory[i, WALL_MEMORY_STAGE]",
        "scale = 1.0",
        "kernels/test_contact.py::test_impulses_are_found_by_the_name_of_their_contact",
    ),
    _mutant(
        "time-stepping-rolling",
        "Rolling friction has the wrong sign, and is therefore left out.",
        "time_stepping/rolling_friction.py",
        "a = -across * p / size",
        "a = across * p / size",
        "physics/test_rolling.py::test_a_rolling_ball_slows_by_five_sevenths_of_g_times_radius_over_radius",
    ),
    _mutant(
        "time-stepping-tangential",
        "Tangential restitution leaves one tangent as it is.",
        "time_stepping/tangential_restitution.py",
        "contacts.target[k, 2] = -share *",
        "contacts.target[k, 2] = share *",
        "physics/test_rolling.py::test_a_superball_keeps_its_energy_and_comes_back",
    ),
]

ONE_BODY = [
    *MATH, *LCP, *FLIGHT, *FORCES, *HALF_SPACE, *CONTACT_LAW, *CONTACT_SOLVER, *EVENT_DRIVEN, *PARALLEL, *STATE,
    *TIME_STEPPING,
]  # fmt: skip
