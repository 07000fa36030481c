"""Adapter of the native batch for Stable-Baselines3, with one call per step instead of a loop over environments."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from copy import deepcopy
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from physics.summary import shown
from rigid_env.envs import vector_infos as infos_of_batches
from rigid_env.envs.goals import METHODS
from rigid_env.envs.vector_env import RigidVectorEnv
from rigid_env.extras import require

try:
    from stable_baselines3.common.monitor import Monitor
    from stable_baselines3.common.vec_env import VecEnv
except ImportError:
    require("agents", "torch", "stable_baselines3", purpose="rigid_env.envs.sb3")
    raise


class RigidVecEnv(VecEnv):
    """A `RigidVectorEnv` with the interface of Stable-Baselines3's vector environments.

    Worlds start anew in the step in which their episode ends; the info of that step holds
    ``terminal_observation``, ``TimeLimit.truncated``, the numbers of the task's infos and draws, and, with `monitor`,
    ``episode`` (return ``r``, length ``l``, seconds since the start of training ``t``).
    The other infos are empty. `reset_infos` holds the infos of the starts of the running episodes, with the parameters
    of each (``mass``, ``size``, ``friction``, ``restitution``, ``gravity``).

    Parameters
    ----------
    vector_env : RigidVectorEnv
        Vector environment with ``autoreset_mode="SameStep"``.
    monitor : bool
        Add the ``episode`` statistics of SB3's `Monitor`; `env_is_wrapped(Monitor)` is then True. Set it to False to
        use SB3's `VecMonitor`.

    Raises
    ------
    ValueError
        If the vector environment has another autoreset mode.
    """

    def __init__(self, vector_env: RigidVectorEnv[Any], monitor: bool = True) -> None:
        if vector_env.autoreset_mode is not AutoresetMode.SAME_STEP:
            raise ValueError(
                f"vector_env has autoreset_mode={vector_env.autoreset_mode}; allowed is AutoresetMode.SAME_STEP: make "
                f'it with {type(vector_env).__name__}(..., autoreset_mode="SameStep"), or with '
                'gymnasium.make_vec(..., autoreset_mode="SameStep")'
            )
        self.vector_env = vector_env
        self.monitor = monitor
        self._actions: Any = None
        self._shared: dict[str, Any] = {}  # options of all environments; `_options` are those of each
        self._returns = np.zeros(vector_env.num_envs)
        self._lengths = np.zeros(vector_env.num_envs, dtype=np.int64)
        self._start = time.perf_counter()
        super().__init__(vector_env.num_envs, vector_env.single_observation_space, vector_env.single_action_space)
        self.metadata = vector_env.metadata

    def reset(self) -> NDArray[Any]:
        """Start new episodes in all worlds, with the seeds and options that were set since the last reset.

        Returns
        -------
        (num_envs, entries) float32

        Raises
        ------
        TypeError, ValueError
            An option or a seed that is unknown or out of range. Nothing has changed then.
        """
        seeds = None if all(seed is None for seed in self._seeds) else self._seeds
        starts: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        groups = self._option_groups()
        before = self.vector_env.get_state() if len(groups) > 1 else None
        try:
            for rows, options in groups:
                obs, infos = self.vector_env.reset(seed=seeds, options=options or None)
                for i in rows:
                    starts[i] = self._row_of(infos, i)
        except BaseException:
            if before is not None:  # groups before the refused one have started already
                self.vector_env.set_state(before)
            raise
        self.reset_infos = starts
        self._reset_seeds()
        self._reset_options()
        self._returns[:] = 0.0
        self._lengths[:] = 0
        return obs

    def set_options(self, options: Mapping[str, Any] | Sequence[Mapping[str, Any]] | None = None) -> None:
        """Fix draws of the next episodes; used once, at the next `reset`.

        Parameters
        ----------
        options : dict, or list of dict, optional
            A dict is as of `RigidVectorEnv.reset`, without ``reset_mask``, since all environments start: a value is for
            all of them, or an array with a row for each. A list has a dict for each environment, with its own
            values; keys may differ.

        Raises
        ------
        ValueError
            `options` has another type, or the number of dicts is not that of environments.
        """
        if options is None or isinstance(options, Mapping):
            if options is not None and "reset_mask" in options:
                raise ValueError("options holds reset_mask; allowed are draws: a reset starts all environments")
            self._shared, self._options = deepcopy(dict(options or {})), [{} for _ in range(self.num_envs)]
            return
        each = list(options) if isinstance(options, Sequence) and not isinstance(options, str) else []
        if len(each) != self.num_envs or not all(isinstance(one, Mapping) for one in each):
            raise ValueError(
                f"options is {shown(options)}; allowed are a dict, or a list of {self.num_envs} dicts, one for each "
                "environment"
            )
        for i, one in enumerate(each):
            if "reset_mask" in one:
                raise ValueError(f"options[{i}] holds reset_mask; allowed are draws of one environment")
        self._shared, self._options = {}, [deepcopy(dict(one)) for one in each]

    def _reset_options(self) -> None:
        self.set_options(None)

    def _option_groups(self) -> list[tuple[Sequence[int], dict[str, Any]]]:
        """Group environments by the draws that they fix; each group and its options need one `reset` of the batch."""
        groups: dict[frozenset, list[int]] = {}
        for i, one in enumerate(self._options):
            groups.setdefault(frozenset(one), []).append(i)
        found: list[tuple[Sequence[int], dict[str, Any]]] = []
        for keys, rows in groups.items():
            options = {key: self._stacked(key, rows) for key in sorted(keys)}
            if len(groups) > 1:
                options["reset_mask"] = np.isin(np.arange(self.num_envs), rows)
            found.append((rows, {**self._shared, **options}))
        return found

    def _stacked(self, key: str, rows: Sequence[int]) -> np.ndarray:
        """Values of the option `key` for the environments `rows`, as an array with a row for each."""
        values = [np.asarray(self._options[i][key]) for i in rows]
        for i, value in zip(rows, values):
            if value.shape != values[0].shape:
                allowed = f"{values[0].shape}, as options[{rows[0]}]"
                raise ValueError(f"options[{i}] has {key} of shape {value.shape}; allowed is {allowed}")
        return np.stack(values)

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keep actions (num_envs, numbers) for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[NDArray[Any], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Step all environments with the actions of `step_async`.

        Returns
        -------
        observations : (num_envs, entries) float32
        rewards : (num_envs,) float32
        dones : (num_envs,) bool
        infos : list of dict
        """
        obs, rewards, terminations, truncations, vector_infos = self.vector_env.step(self._actions)
        dones = terminations | truncations
        self._returns += rewards
        self._lengths += 1
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        ended = np.flatnonzero(dones)
        for i in ended.tolist():
            infos[i] = self._final_info(i, bool(truncations[i] and not terminations[i]), vector_infos)
            self.reset_infos[i] = self._row_of(vector_infos, i)
        self._returns[ended] = 0.0
        self._lengths[ended] = 0
        return obs, rewards.astype(np.float32), dones, infos

    def _final_info(self, i: int, is_truncated: bool, vector_infos: dict[str, Any]) -> dict[str, Any]:
        final = vector_infos["final_info"]
        info = {
            "terminal_observation": vector_infos["final_obs"][i],
            "TimeLimit.truncated": is_truncated,
            **{key: self._of_world(final[key], i) for key in self._keys()},
        }
        if self.monitor:
            info["episode"] = {
                "r": round(float(self._returns[i]), 6),
                "l": int(self._lengths[i]),
                "t": round(time.perf_counter() - self._start, 6),
            }
        return info

    def _row_of(self, infos: dict[str, Any], world: int) -> dict[str, Any]:
        """One world's info at the start of its episode."""
        return {key: infos[key][world].tolist() for key in self._keys()}

    def _keys(self) -> tuple[str, ...]:
        """Keys of every info."""
        return infos_of_batches.keys(self.vector_env.task, self.vector_env.contact_infos)

    @staticmethod
    def _of_world(values: np.ndarray, world: int) -> Any:
        """Number of one world, or a copy of its array, from an array with a row for each world."""
        return values[world].item() if values.ndim == 1 else values[world].copy()

    def close(self) -> None:
        """Close the vector environment."""
        self.vector_env.close()

    # --- attributes and methods of single environments ----------------------------------------------------

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Attribute of each chosen world (`RigidVectorEnv.get_attr`), or of the vector environment, once for each."""
        rows = list(self._get_indices(indices))
        try:
            values = self.vector_env.get_attr(attr_name)
        except AttributeError:
            return [getattr(self.vector_env, attr_name) for _ in rows]
        return [values[i] for i in rows]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of all worlds to one value; see `RigidVectorEnv.set_attr`.

        Raises
        ------
        AttributeError
            A name that has no effect.
        ValueError
            If `indices` leaves some out, or on a value out of range.
        """
        self._require_all("set_attr", indices)
        self.vector_env.set_attr(attr_name, [value] * self.num_envs)

    def env_method(self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any) -> list[Any]:
        """Call a method of the vector environment once, for all environments; the result is repeated for each index.

        `indices` may choose some of the environments only for a method that depends on no environment's state
        (`goals.METHODS`). For other methods it must be None, or name all environments.

        Raises
        ------
        ValueError
            `indices` leaves out environments, and the method is another one.
        """
        if method_name not in METHODS:
            self._require_all("env_method", indices)
        result = getattr(self.vector_env, method_name)(*method_args, **method_kwargs)
        return [result for _ in self._get_indices(indices)]

    def _require_all(self, what: str, indices: Any) -> None:
        chosen = sorted(set(self._get_indices(indices)))
        if chosen != list(range(self.num_envs)):
            raise ValueError(f"{what} got indices {indices!r}; allowed is None: the environments are one batch")

    def env_is_wrapped(self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: Any = None) -> list[bool]:
        """True for SB3's `Monitor` if this adapter does its work, else False; one bool for each index."""
        is_wrapped = self.monitor and wrapper_class is Monitor
        return [is_wrapped for _ in self._get_indices(indices)]

    def get_images(self) -> list[NDArray[np.uint8] | None]:
        """Picture of each world, (height, width, 3) uint8; None if the render mode is not "rgb_array"."""
        if self.render_mode != "rgb_array":
            return [None] * self.num_envs
        return list(self.vector_env.render())  # type: ignore[arg-type]
