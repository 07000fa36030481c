"""Mutants of the kernels of worlds whose bodies touch each other."""

from __future__ import annotations

from tests.mutants.mutant import Mutant


def _mutant(name: str, fault: str, path: str, old: str, new: str, test: str) -> Mutant:
    """Mutant of such a kernel with one test."""
    return Mutant(name, fault, "physics/kernels/multibody/" + path, old, new, ("tests/" + test,))


BROADPHASE = [
    _mutant(
        "broadphase-overlap",
        "Two boxes count as overlapping although the second one begins beyond the end of the first one.",
        "broadphase/sweep_and_prune.py",
        "if box[a, k] > box[b, k + 3] or box[b, k] > box[a, k + 3]:",
        "if box[a, k] > box[b, k + 3]:",
        "kernels/test_many.py::test_pairs_are_those_whose_boxes_overlap_in_the_order_of_bodies",
    ),
    _mutant(
        "broadphase-order",
        "Pairs are not sorted by their second body.",
        "broadphase/sweep_and_prune.py",
        "_count_into(sweep.pairs, 1, count, sweep.first_entry, sweep.sorted_pairs)",
        "_count_into(sweep.pairs, 0, count, sweep.first_entry, sweep.sorted_pairs)",
        "kernels/test_many.py::test_pairs_are_those_whose_boxes_overlap_in_the_order_of_bodies",
    ),
    _mutant(
        "broadphase-strip",
        "A body is listed in the first column that its box enters only.",
        "broadphase/grid.py",
        "strip_index(box[b, u], lu, du, nu), strip_index(box[b, u + 3], lu, du, nu),",
        "strip_index(box[b, u], lu, du, nu), strip_index(box[b, u], lu, du, nu),",
        "kernels/test_many.py::test_pairs_are_those_whose_boxes_overlap_in_the_order_of_bodies",
    ),
]

DATA = [
    _mutant(
        "data-clipped",
        "A point where two edges cross is carried along with the incident face.",
        "data/clipped_points.py",
        "return times(qt.dot(e, u) / across, d)",
        "return times(0.0, d)",
        "kernels/test_clipped_points.py::test_contact_points_move_as_the_next_narrow_phase_finds_them",
    ),
    _mutant(
        "data-lone-corner",
        "A corner of the reference face is carried along with the incident face.",
        "data/clipped_points.py",
        "w = _along_face(edges[0], edges[1], out, u)",
        "w = (0.0, 0.0, 0.0)",
        "kernels/test_clipped_points.py::test_contact_points_move_as_the_next_narrow_phase_finds_them",
    ),
    _mutant(
        "data-capsule",
        "The contact point of a capsule moves to the axis of the capsule.",
        "data/contact_set.py",
        "return from_body(b, add_scaled(arm, side * d[0], n) if is_capsule(b, many) else arm, many)",
        "return from_body(b, arm, many)",
        "physics/test_capsules.py::test_a_capsule_rolls_down_a_slope",
    ),
    _mutant(
        "data-rim",
        "The lowest point of a cylinder stays where it is in the body, and does not roll along the rim.",
        "data/cylinders.py",
        "change = minus(times(-qt.dot(k, turn), y), times(qt.dot(k, y), turn))",
        "change = (0.0, 0.0, 0.0)",
        "physics/test_cylinders.py::test_a_tilted_disk_moves_as_the_equations_say",
    ),
    _mutant(
        "data-cylinder-ball",
        "The normal of a ball on a cylinder turns, but the gap does not feel how.",
        "data/cylinder_balls.py",
        "return (target[0] - time * _turn_beside(can, ball, many), target[1], target[2])",
        "return target",
        "physics/test_cylinders.py::test_a_ball_slides_on_a_cylinder_that_turns_under_it",
    ),
    _mutant(
        "data-free-turn",
        "The contact point of a cylinder does not feel how its spin turns.",
        "data/cylinders.py",
        "return plus(acceleration, qt.cross(alpha, row_vector(many.contacts.arm, k, first)))",
        "return acceleration",
        "physics/test_cylinders.py::test_a_tilted_disk_moves_as_the_equations_say",
    ),
    _mutant(
        "data-part-place",
        "The parts of a compound stay where they are while it turns.",
        "data/parts.py",
        "return plus(x, qt.matvec(R, row_vector(table.place, part, 0))), _matrix_product(R, _matrix(table.turn, part))",
        "return plus(x, row_vector(table.place, part, 0)), _matrix_product(R, _matrix(table.turn, part))",
        "physics/test_compounds.py::test_queries_ask_every_part",
    ),
    _mutant(
        "data-part-anchor",
        "The contact point of a round part moves to where the body's centre of mass would have it.",
        "data/contact_set.py",
        "return from_body(b, (r * n[0], r * n[1], r * n[2]), many)",
        "return (r * n[0], r * n[1], r * n[2])",
        "physics/test_compounds.py::test_a_dumbbell_tips_over_about_a_ball",
    ),
    _mutant(
        "data-arm",
        "The arm of a contact leads from its point to the centre of mass.",
        "data/contact_set.py",
        "arm = subtract(point, row_vector(many.bodies.state, body_of(part, many), 0))",
        "arm = subtract(row_vector(many.bodies.state, body_of(part, many), 0), point)",
        "kernels/test_hulls.py::test_a_hull_touches_a_wall_with_the_corners_that_are_near",
    ),
    _mutant(
        "data-second-body",
        "The turning of the second body does not count in the relative velocity of a contact.",
        "data/contact_set.py",
        "u, add_scaled(row_vector(t, b, 0), 1.0, qt.cross(",
        "u, add_scaled(row_vector(t, b, 0), 0.0, qt.cross(",
        "kernels/test_many.py::test_the_speed_of_a_contact_is_that_of_its_two_points",
    ),
    _mutant(
        "data-cube",
        "The faces of the cube's table look inwards on one side of each axis.",
        "data/hull_tables.py",
        "normals.append(sign * np.eye(3)[axis])",
        "normals.append(np.eye(3)[axis])",
        "kernels/test_hulls.py::test_the_tables_of_a_block_are_those_of_a_cube",
    ),
    _mutant(
        "data-group",
        "A body falls asleep although another one of its group is not quiet.",
        "data/sleeping.py",
        "found[root, 2] = 1.0",
        "found[root, 2] = 0.0",
        "physics/test_sleeping_bodies.py::test_what_touches_something_in_motion_does_not_sleep",
    ),
]

NARROWPHASE = [
    _mutant(
        "narrowphase-edges",
        "The extent of a block along a product of edges mixes up its two other axes.",
        "narrowphase/box_sat.py",
        "size = (da[ip] * S[iq, j] + da[iq] * S[ip, j])",
        "size = (da[ip] * S[ip, j] + da[iq] * S[iq, j])",
        "kernels/test_many.py::test_the_normal_of_two_blocks_separates_them_most",
    ),
    _mutant(
        "narrowphase-face",
        "The faces of the second block are tested with the transposed rotation.",
        "narrowphase/box_sat.py",
        "(db[j] + (da[0] * S[0, j] + da[1] * S[1, j] + da[2] * S[2, j]))",
        "(db[j] + (da[0] * S[j, 0] + da[1] * S[j, 1] + da[2] * S[j, 2]))",
        "kernels/test_many.py::test_the_normal_of_two_blocks_separates_them_most",
    ),
    _mutant(
        "narrowphase-corner",
        "The gap of a hull's corner to a wall is that of the opposite corner.",
        "narrowphase/body_wall.py",
        "gap = d + qt.dot(n, r)",
        "gap = d - qt.dot(n, r)",
        "kernels/test_hulls.py::test_a_hull_touches_a_wall_with_the_corners_that_are_near",
    ),
    _mutant(
        "narrowphase-covered-seam",
        "A seam between two parts is an edge of the whole.",
        "narrowphase/covered_points.py",
        "found < (1.0 - _NEARER_SHARE) * height",
        "found < -height",
        "physics/test_compounds.py::test_seams_between_parts_stop_nothing",
    ),
    _mutant(
        "narrowphase-covered-valley",
        "Two parts leave out each other's contacts in the line in which they meet.",
        "narrowphase/covered_points.py",
        "if is_free and float(many.bodies.parts.touching[j, end]) == cover:",
        "if float(many.bodies.parts.touching[j, end]) == cover:",
        "physics/test_compounds.py::test_an_edge_stands_in_the_bottom_of_a_valley",
    ),
    _mutant(
        "narrowphase-capsule-edge",
        "A capsule does not touch the edges that its axis passes.",
        "narrowphase/capsule_hull.py",
        "if far > distance or",
        "if far > 0.9 * distance or",
        "kernels/test_capsules.py::test_a_capsule_over_an_edge_touches_it_whatever_rounding_does",
    ),
    _mutant(
        "narrowphase-cylinder-ring",
        "The ring of a cylinder's face begins at a fixed point of the body, not where loads would tip it.",
        "narrowphase/cylinder_wall.py",
        "    if not square > 0.0:",
        "    if height <= 2.0 * _FLAT_SINE * r:",
        "physics/test_cylinders.py::test_a_cylinder_stands_below_the_critical_angle",
    ),
    _mutant(
        "narrowphase-capsule-inside",
        "The direction across an edge and the axis of a capsule counts beyond the normals of the edge's faces.",
        "narrowphase/segment_polyhedron.py",
        "if not qt.dot(left, u) * qt.dot(right, u) < 0.0:",
        "if not qt.dot(left, u) * qt.dot(right, u) > 0.0:",
        "kernels/test_capsules.py::test_the_least_gap_to_a_block_is_the_distance",
    ),
]

SOLVER = [
    _mutant(
        "solver-scaling",
        "The scaling of two points of the cone adds their tangents instead of their difference.",
        "solver/second_order_cone.py",
        "half * (t * u[1] - s * p[1])",
        "half * (t * u[1] + s * p[1])",
        "kernels/test_many.py::test_the_scaling_takes_p_and_u_to_the_same_point",
    ),
    _mutant(
        "solver-quotient",
        "The quotient in the cone's algebra has one wrong sign.",
        "solver/second_order_cone.py",
        "x = (a[0] * b[0] - a[1] * b[1] - a[2] * b[2])",
        "x = (a[0] * b[0] - a[1] * b[1] + a[2] * b[2])",
        "kernels/test_many.py::test_the_quotient_undoes_the_product_and_the_way_out_ends_at_the_boundary",
    ),
    _mutant(
        "solver-budget",
        "Elimination goes on beyond the products that it is allowed.",
        "solver/minimum_degree.py",
        "        if cost > most:\n            return -1\n",
        "",
        "kernels/test_many.py::test_elimination_ends_where_it_takes_more_products_than_are_allowed",
    ),
    _mutant(
        "solver-reaction",
        "The impulse of a contact pushes both bodies the same way.",
        "solver/contact_operator.py",
        "add_scaled(row_vector(t, b, 0), -many.bodies.inv_mass[b], p)",
        "add_scaled(row_vector(t, b, 0), many.bodies.inv_mass[b], p)",
        "physics/test_bodies.py::test_free_bodies_keep_their_momenta_and_gain_no_energy",
    ),
]

_CASE = "hard_cases/test_cases.py::test_the_case_comes_out_as_it_must"

STEPPING = [
    _mutant(
        "stepping-rim",
        "A stage of a lone body goes on where its last contact has passed a rim.",
        "stepping/rim_crossing.py",
        "return _first_crossing(n, world, h, memory, many)",
        "return h",
        "physics/test_fixed.py::test_a_block_slides_off_the_end_of_a_ramp",
    ),
    _mutant(
        "stepping-sudden",
        "A part of a lone body is accepted without a look at the next part.",
        "stepping/sudden_change.py",
        "if many.lone.impacts[0] > 0:",
        "if many.lone.impacts[0] >= 0:",
        "physics/test_fixed.py::test_a_block_slides_off_the_end_of_a_ramp_precisely",
    ),
    _mutant(
        "stepping-mean-slip",
        "Friction of a lone body opposes the slip at the end of a stage where the slip turns.",
        "stepping/lone_stage.py",
        "return (t[0], -u[1], -u[2]) if goes_on and is_turning else t",
        "return t",
        "physics/test_motion.py::test_a_chip_slides_off_a_turntable",
    ),
    _mutant(
        "stepping-restitution",
        "A bounce returns all of its speed, whatever its restitution.",
        "stepping/impact.py",
        "return -many.contacts.restitution[k] * speed, not speed > 0.0",
        "return -speed, not speed > 0.0",
        "physics/test_bodies.py::test_head_on_impact",
    ),
    _mutant(
        "stepping-overlap",
        "Bodies that overlap are not pushed apart.",
        "stepping/position_correction.py",
        "goal = -_CORRECTION_SHARE * (gap + 0.5 * slop)",
        "goal = _CORRECTION_SHARE * (gap + 0.5 * slop)",
        "physics/test_bodies.py::test_overlapping_bodies_come_apart_without_speed",
    ),
    _mutant(
        "stepping-foretold",
        "A contact that is to be met in time is braked in the air before it.",
        "stepping/midpoint_step.py",
        "if many.contacts.target[k, 0] == FORETOLD:",
        "if many.contacts.target[k, 0] == 1.0:",
        _CASE + "[56-bounce-in-company]",
    ),
    _mutant(
        "stepping-passing",
        "The contact of a pair that passes keeps the direction that it has now.",
        "stepping/passing_pairs.py",
        "if not is_parted or qt.dot(way, m) > _SAME_DIRECTION:",
        "if is_parted or qt.dot(way, m) > _SAME_DIRECTION:",
        _CASE + "[58-sliding-past]",
    ),
    _mutant(
        "stepping-thinning",
        "Bodies are not thinned by the depth to which they land.",
        "stepping/passing_pairs.py",
        "return min(slop + landing, most)",
        "return min(slop, most)",
        _CASE + "[59-seams]",
    ),
    _mutant(
        "stepping-landing",
        "Bodies land in others that they pass.",
        "stepping/passing_pairs.py",
        "if not _is_beside_pair(k, a, b, many) or many.contacts.target[k, 0] == _PASSING:",
        "if not _is_beside_pair(k, a, b, many):",
        _CASE + "[59-seams]",
    ),
    _mutant(
        "stepping-moment",
        "The corners of a face that is tilted by what solves leave hit one by one.",
        "stepping/impact.py",
        "_SAME_MOMENT_RADII * radius)",
        "0.0 * radius)",
        "physics/test_refine.py::test_a_cube_that_falls_flat_on_a_block_does_not_turn",
    ),
    _mutant(
        "stepping-point",
        "The impulses of a contact act at two points, a gap apart.",
        "data/contact_set.py",
        "put_vector(many.contacts.arm, k, 0, subtract(other, way))",
        "put_vector(many.contacts.arm, k, 0, one)",
        "kernels/test_many.py::test_the_normal_of_two_blocks_separates_them_most",
    ),
    _mutant(
        "stepping-spin",
        "To push bodies apart adds angular momentum.",
        "stepping/position_correction.py",
        "_add_angular_momentum(a, on_a, turn, many)",
        "_add_angular_momentum(a, on_b, turn, many)",
        _CASE + "[60-closed-pairs]",
    ),
]

_MOTION = "physics/test_motion.py::test_"

DRIVEN = [
    _mutant(
        "driven-target",
        "A solve does not know the velocity of a driven end.",
        "data/driven_bodies.py",
        "many.contacts.target[k, c] += qt.dot(row_vector(E, k, 3 * c), w)",
        "many.contacts.target[k, c] += 0.0 * qt.dot(row_vector(E, k, 3 * c), w)",
        _MOTION + "a_belt_carries_a_block_along",
    ),
    _mutant(
        "driven-work",
        "The work of driven bodies counts as energy that an impact creates.",
        "data/driven_bodies.py",
        "    return _work(n, many)",
        "    return 0.0 * _work(n, many)",
        _MOTION + "a_rising_plate_bats_a_block",
    ),
    _mutant(
        "driven-arm",
        "The spin of a driven body does not move its contact points.",
        "data/driven_bodies.py",
        "return plus(plus(v, qt.cross(w, arm)), s)",
        "return plus(v, s)",
        _MOTION + "a_block_stays_on_a_turntable",
    ),
    _mutant(
        "driven-slip",
        "A stage does not end where a slip on a driven body ends.",
        "stepping/slip_end.py",
        "if is_last or not t < h or trial == _MAX_TRIALS - 1:",
        "if True:",
        _MOTION + "a_block_drifts_on_a_shaker",
    ),
    _mutant(
        "driven-surface",
        "A moving surface pushes along the normal of a contact.",
        "data/driven_bodies.py",
        "s = minus(s, times(qt.dot(s, n), n))",
        "s = minus(s, times(0.0 * qt.dot(s, n), n))",
        _MOTION + "a_belt_up_a_slope_carries_a_block_without_slip",
    ),
]

MANY_BODIES = [*BROADPHASE, *DATA, *NARROWPHASE, *SOLVER, *STEPPING, *DRIVEN]
