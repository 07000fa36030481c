"""Mutants of worlds and of files of scenes and recordings."""

from __future__ import annotations

from tests.mutants.mutant import Mutant


def _mutant(name: str, fault: str, path: str, old: str, new: str, test: str) -> Mutant:
    """Mutant of `physics` with one test."""
    return Mutant(name, fault, "physics/" + path, old, new, ("tests/physics/" + test,))


WORLD = [
    _mutant(
        "world-limits",
        "An actuator's limits of force and torque are exchanged.",
        "world/actuator.py",
        "limits = (self.actuator.limit_force, self.actuator.limit_torque)",
        "limits = (self.actuator.limit_torque, self.actuator.limit_force)",
        "test_actuator.py::test_limits_shorten_the_wrench_and_keep_its_direction",
    ),
    _mutant(
        "world-arm",
        "The arm of a force begins at the world's origin instead of the centre of mass.",
        "world/wrench.py",
        "else points - world.pos",
        "else points",
        "test_wrench.py::test_points_of_the_world_and_bodies_that_nothing_acts_on",
    ),
    _mutant(
        "world-frame",
        "A force along the body axes is turned by the inverse rotation.",
        "world/wrench.py",
        'forces = np.einsum("wbij,wbj->wbi", R, forces)',
        'forces = np.einsum("wbji,wbj->wbi", R, forces)',
        "test_wrench.py::test_a_force_at_a_point_of_a_body_is_what_a_push_is",
    ),
    _mutant(
        "world-table-spin",
        "A body that follows a table of attitudes turns at half its angular velocity.",
        "kernels/flight/prescribed_motion.py",
        "scale = 2.0 / (w * w",
        "scale = 1.0 / (w * w",
        "test_motion.py::test_a_table_is_a_spline_of_places_and_of_attitudes",
    ),
    _mutant(
        "world-table-slope",
        "The spline through a table has no continuous acceleration.",
        "scene/motion.py",
        "2.0 * (w[:-1] + w[1:]), w[1:]",
        "1.0 * (w[:-1] + w[1:]), w[1:]",
        "test_motion.py::test_a_table_is_a_spline_of_places_and_of_attitudes",
    ),
    _mutant(
        "world-fault",
        "The status of a world with one fault does not tell it.",
        "world/report.py",
        "if table[world, at.FAULTS] > 0.0:",
        "if table[world, at.FAULTS] > 1.0:",
        "test_stepper.py::test_the_status_is_the_gravest_thing_whatever_else_is_in_the_batch",
    ),
    _mutant(
        "world-impacts-other",
        "The other body of an impact gets the same impulse as the first one.",
        "world/impacts.py",
        "out.total[n, b, c] -=",
        "out.total[n, b, c] +=",
        "test_impacts.py::test_two_balls_get_opposite_impulses",
    ),
    _mutant(
        "world-impacts-joined",
        "Impacts of the earlier calls of a step are dropped.",
        "world/impacts.py",
        "if not self._goes_on:",
        "if True:",
        "test_impacts.py::test_a_call_of_many_steps_has_the_collisions_of_all",
    ),
    Mutant(
        "world-gusts",
        "Gusts that begin later have the wrong sign of their delay.",
        "physics/world/gusts.py",
        "begun = phases - _frequencies()",
        "begun = phases + _frequencies()",
        ("tests/tasks/test_gusts.py::test_gusts_that_begin_later_are_the_same",),
    ),
    _mutant(
        "world-snapshot",
        "A snapshot's file has no output of the actuators.",
        "world/snapshot.py",
        'parts["actuator_output"] = output',
        'parts["actuator_output"] = 0.0 * output',
        "test_snapshot_file.py::test_commands_on_their_way_are_in_the_file",
    ),
    _mutant(
        "world-other-scene",
        "A snapshot of another scene is taken where the sizes of arrays agree.",
        "world/restoring.py",
        "        _check_scene(world, snapshot)",
        "        pass",
        "test_restore.py::test_a_snapshot_of_another_scene_is_refused_also_where_the_sizes_of_arrays_agree",
    ),
    _mutant(
        "world-age",
        "Commands of a delayed actuator do not age.",
        "world/actuator.py",
        "(age + dt, command) for age",
        "(age, command) for age",
        "test_actuator.py::test_a_step_of_the_command_arrives_as_lag_and_dead_time_say",
    ),
]

IO = [
    _mutant(
        "io-spin",
        "The spin of a body in MJCF is along the wrong axes.",
        "io/mjcf/writer.py",
        "rotation_matrices(np.array(body.quat)).T @ body.angvel",
        "rotation_matrices(np.array(body.quat)) @ body.angvel",
        "test_mjcf.py::test_a_scene_comes_back",
    ),
    _mutant(
        "io-inertia",
        "Two products of inertia are exchanged in MJCF.",
        "io/mjcf/writer.py",
        "I[0, 1], I[0, 2], I[1, 2]",
        "I[0, 2], I[0, 1], I[1, 2]",
        "test_mjcf.py::test_a_scene_comes_back",
    ),
    _mutant(
        "io-friction",
        "Of two geoms in MJCF the smaller friction counts.",
        "io/mjcf/contacts.py",
        "return max(LEAST_FRICTION, *(surface.friction for surface in deciding))",
        "return min(surface.friction for surface in deciding)",
        "test_mjcf_plain.py::test_one_box_on_a_plane_of_another_friction_has_the_larger_one",
    ),
    _mutant(
        "io-fixed-mass",
        "Mass that is fixed to a free body in MJCF is at the body's origin.",
        "io/mjcf/compiled_bodies.py",
        "return model.frames[b].pos, model.frames[b].R",
        "return 0.0 * model.frames[b].pos, model.frames[b].R",
        "test_mjcf_compiled.py::test_a_text_gives_the_scene_that_mujoco_simulates",
    ),
    _mutant(
        "io-wrench",
        "A recorder keeps the array of wrenches itself instead of a copy.",
        "io/recorder.py",
        "_Load(wrench.copy(), None",
        "_Load(wrench, None",
        "test_recorder.py::test_a_fault_is_written_once_and_says_why",
    ),
    _mutant(
        "io-default",
        "A scene file leaves out parameters that are zero, whatever their default.",
        "io/plain.py",
        "if field.default is MISSING or value != field.default:",
        "if field.default is MISSING or (value != field.default and value != 0.0):",
        "test_scene_file.py::test_a_scene_comes_back_equal",
    ),
]

QUERIES = [
    _mutant(
        "rays-missed-block",
        "A ray hits a block that it passes by.",
        "kernels/queries/ray_shapes.py",
        "        last, leave = b, 2\n    if near > last or last < 0.0:",
        "        last, leave = b, 2\n    if last < 0.0:",
        "test_rays.py",
    ),
    _mutant(
        "rays-inside",
        "A ray from inside a sphere does not find where it leaves.",
        "kernels/queries/ray_shapes.py",
        "    side = -half if half <= -b else half",
        "    side = -half",
        "test_rays.py",
    ),
]

GROUPS = [
    _mutant(
        "groups-one-side",
        "Two bodies touch if one of their masks holds the group of the other.",
        "kernels/multibody/data/collision_groups.py",
        "(groups[b, 0] & groups[row, 1]) != 0 and (groups[b, 1]",
        "(groups[b, 0] & groups[row, 1]) != 0 or (groups[b, 1]",
        "test_collision_groups.py::test_two_ends_touch_if_each_has_a_group_of_the_others_mask",
    ),
    _mutant(
        "groups-wall-row",
        "A wall has the groups of the wall before it.",
        "kernels/multibody/data/collision_groups.py",
        "many.bodies.state.shape[0] - 1 - end",
        "many.bodies.state.shape[0] - 2 - end",
        "test_collision_groups.py::test_two_ends_touch_if_each_has_a_group_of_the_others_mask",
    ),
]

WORLDS = [*WORLD, *IO, *QUERIES, *GROUPS]
