"""Mutants of tasks, environments and agents."""

from __future__ import annotations

from tests.mutants.mutant import Mutant


def _mutant(name: str, fault: str, path: str, old: str, new: str, test: str) -> Mutant:
    """Mutant with one test."""
    return Mutant(name, fault, path, old, new, ("tests/" + test,))


TASKS = [
    _mutant(
        "tasks-clip",
        "A number of an action is not clipped.",
        "rigid_env/tasks/wrenches.py",
        "return clip(actions[i, k], -1.0, 1.0) if k >= 0 else 0.0",
        "return actions[i, k] if k >= 0 else 0.0",
        "envs/test_tasks.py::test_numbers_beyond_one_act_as_one",
    ),
    _mutant(
        "tasks-draw",
        "Drawn gravity does not reach the world.",
        "rigid_env/tasks/draws.py",
        "arguments[parameter] = value[:, None] * down",
        "arguments[parameter] = strength * down",
        "tasks/test_declaration.py::test_a_fixed_draw_reaches_the_world",
    ),
    _mutant(
        "tasks-body",
        "A parameter that is drawn for one body is given to all.",
        "rigid_env/tasks/draws.py",
        "table[:, place] = value",
        "table[...] = value[:, None]",
        "tasks/test_functions.py::test_a_parameter_of_one_body_leaves_the_others",
    ),
    _mutant(
        "tasks-push",
        "The mean wait between pushes is a rate instead of a time.",
        "rigid_env/tasks/disturbances.py",
        "quiet = kind.every / self._task.control_dt",
        "quiet = 1.0 / (kind.every * self._task.control_dt)",
        "tasks/test_disturbances.py::test_waiting_times_are_nearly_exponential",
    ),
    _mutant(
        "tasks-gust",
        "A gust lasts a control step too long.",
        "rigid_env/tasks/disturbances.py",
        "acting = self.end[k] > steps",
        "acting = self.end[k] >= steps",
        "tasks/test_disturbances.py::test_a_gust_blows_as_hard_and_as_long_as_it_says",
    ),
    _mutant(
        "tasks-disturbance-as-command",
        "Disturbances go through the actuator.",
        "rigid_env/tasks/steps.py",
        "if actuation is None:",
        "if True:",
        "tasks/test_disturbances.py::test_no_actuator_stands_between_a_disturbance_and_its_body",
    ),
    _mutant(
        "tasks-direction",
        "Random directions lie in the upper half of the sphere.",
        "rigid_env/tasks/disturbances.py",
        "height, turn = 2.0 * shares[1] - 1.0,",
        "height, turn = shares[1],",
        "tasks/test_disturbances.py::test_directions_are_unit_vectors_of_all_directions_alike",
    ),
    _mutant(
        "tasks-impulse",
        "An impulse acts as a force without regard to the time in which it acts.",
        "rigid_env/tasks/action_table.py",
        "columns[:, k] = limit / first_dt if vector.kind == IMPULSE else limit",
        "columns[:, k] = limit",
        "tasks/test_actions.py::test_an_impulse_changes_the_momentum_by_itself_however_long_the_step",
    ),
]

ENVS = [
    _mutant(
        "envs-reward",
        "The step in which a world starts anew keeps the reward of its old episode.",
        "rigid_env/envs/vector_env.py",
        "rewards[rows], terminations[rows], truncations[rows] = 0.0, False, False",
        "terminations[rows], truncations[rows] = False, False",
        "envs/test_autoreset.py::test_next_step_resets_one_step_later_without_reward",
    ),
    _mutant(
        "envs-final-observation",
        "Every world that ends is told the final observation of the first one.",
        "rigid_env/envs/sb3.py",
        '"terminal_observation": vector_infos["final_obs"][i],',
        '"terminal_observation": vector_infos["final_obs"][0],',
        "envs/test_sb3.py::test_truncation_is_told_apart_and_the_final_observation_kept",
    ),
    _mutant(
        "envs-truncation",
        "An episode that succeeds in its last step counts as truncated.",
        "rigid_env/envs/sb3.py",
        "bool(truncations[i] and not terminations[i])",
        "bool(truncations[i])",
        "envs/test_sb3.py::test_success_is_no_truncation",
    ),
    _mutant(
        "envs-autoreset",
        "In the mode SameStep the observation after an end is still the last one of the old episode.",
        "rigid_env/envs/vector_env.py",
        "if self.autoreset_mode is not AutoresetMode.DISABLED and len(rows):",
        "if self.autoreset_mode is AutoresetMode.NEXT_STEP and len(rows):",
        "envs/test_autoreset.py::test_same_step_returns_the_new_observation_and_keeps_the_final_one",
    ),
    _mutant(
        "envs-failure",
        "A batch goes on after a failure.",
        "rigid_env/envs/vector_env.py",
        "terminations = task.outcome[:, col.FAILURE] > 0.0",
        "terminations = task.outcome[:, col.FAILURE] < 0.0",
        "tasks/test_functions.py::test_failure_and_success_end_an_episode_and_success_alone_is_success",
    ),
]

AGENTS = [
    _mutant(
        "agents-interval",
        "The confidence interval of a success rate is too wide.",
        "agents/interval.py",
        "CONFIDENCE = 0.95",
        "CONFIDENCE = 0.99",
        "agents/test_interval.py::test_newcombe_1998_table_1_method_3",
    ),
    _mutant(
        "agents-return",
        "The return of an episode goes on after its end.",
        "agents/evaluate.py",
        "returns += np.where(is_running, rewards, 0.0)",
        "returns += rewards",
        "agents/test_evaluate.py::test_every_seed_has_its_own_episode",
    ),
    _mutant(
        "agents-goal",
        "The difference to the goal has the wrong sign.",
        "agents/features.py",
        'way = observations["desired_goal"] - achieved',
        'way = achieved - observations["desired_goal"]',
        "agents/test_config.py::test_features_hold_the_way_to_the_goal_coarsely_and_finely",
    ),
    _mutant(
        "agents-checkpoint",
        "A checkpoint counts as complete while it is written.",
        "agents/checkpoint.py",
        'sorted(path for path in folder.glob("*") if path.name.isdigit())',
        'sorted(folder.glob("*"))',
        "agents/test_training.py::test_partial_checkpoint_is_not_found",
    ),
    _mutant(
        "agents-seeds",
        "Two evaluations share episodes.",
        "agents/evaluate.py",
        "first = FIRST_SEED + SEED_STRIDE * seed",
        "first = FIRST_SEED + seed",
        "agents/test_evaluate.py::test_seeds_of_two_evaluations_are_apart",
    ),
]

ENVIRONMENTS = [*TASKS, *ENVS, *AGENTS]
