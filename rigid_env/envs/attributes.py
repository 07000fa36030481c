"""Attributes of environments that differ between worlds: drawn parameters of the episode, random generators."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, TypeVar

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from physics.keywords import nearest_first
from rigid_env.envs.sources import Obs
from rigid_env.envs.vector_arguments import episode_limit
from rigid_env.tasks import Task

if TYPE_CHECKING:
    T_co = TypeVar("T_co", covariant=True)

    class _Drawn(Generic[T_co]):
        """Type of a parameter for type checkers: reads give a number or an array, settings accept more."""

        def __get__(self, env: Any, kind: Any = None) -> T_co: ...

        def __set__(self, env: Any, value: ArrayLike | None) -> None: ...


def _parameter(field: str, what: str) -> property:
    def read(env: Any) -> Any:
        _require_drawn(env.task, field)
        return value_of(env.task.drawn[field][0])

    def write(env: Any, value: Any) -> None:
        _require_drawn(env.task, field)
        env.task.hold(field, value)

    return property(
        read, write, doc=f"{what}; setting it holds from now on, in all later episodes, too. None: draw again."
    )


def _require_drawn(task: Task, field: str) -> None:
    if field not in task.drawn:
        drawn = ", ".join(nearest_first(field, task.drawn)) or "no attributes of this kind"
        raise AttributeError(f"{type(task).__name__} does not draw {field!r}; allowed are {drawn}")


def value_of(value: Any) -> Any:
    """Return a float from a scalar, or a copy of an array."""
    return float(value) if np.ndim(value) == 0 else value.copy()


class EpisodeParameters:
    """Drawn parameters of a single environment's episode, as attributes that can be read and set.

    Setting raises a ValueError that names the field, the value and what is allowed; nothing has changed then. A
    parameter that the task does not draw is an AttributeError.
    """

    if TYPE_CHECKING:
        mass = _Drawn[float]()
        size = _Drawn[NDArray[np.float64]]()
        friction = _Drawn[float]()
        restitution = _Drawn[float]()
        gravity = _Drawn[float]()
    else:
        mass = _parameter("mass", "Mass of the bodies [kg]")
        size = _parameter("size", "Edges or diameters of the bodies (3,) [m]")
        friction = _parameter("friction", "Coulomb coefficient against the walls")
        restitution = _parameter("restitution", "Restitution against the walls")
        gravity = _parameter("gravity", "Strength of gravity along -y [m/s²]")


SHARED = (
    "accuracy", "autoreset_mode", "control_dt", "dt", "effects", "frame_skip", "max_episode_steps", "metadata",
    "render_mode", "spec",
)  # fmt: skip
"""Names of attributes that are the same in all worlds of a batch."""

OF_BLOCKS = ("half_width", "walls")
"""Names of further attributes that all worlds share, only in the block's tasks."""

SINGLE = ("action_space", "observation_space", "np_random", "np_random_seed")
"""Names of attributes of one world that a batch has under another name or as a tuple."""


class BatchAttributes(gym.vector.VectorEnv[Obs, NDArray[Any], NDArray[Any]]):
    """Methods `call`, `get_attr` and `set_attr` of Gymnasium's vector environments, for a native batch.

    Gymnasium's `SyncVectorEnv` calls its environments one by one; here a call reads the arrays of the batch. A name
    that has no meaning for a single world raises an error.
    """

    task: Any

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Get an attribute of every world.

        Parameters
        ----------
        name : str
            One of: a drawn value of the running episodes, such as ``mass``; ``np_random``, ``np_random_seed``;
            ``action_space`` and ``observation_space`` of one world; ``elapsed_steps``; a setting of the batch
            (`SHARED`), which is the same in all worlds.

        Returns
        -------
        tuple of length num_envs

        Raises
        ------
        AttributeError
            Listing the known names, the nearest first.
        """
        if name in self.task.drawn:
            return tuple(value_of(value) for value in self.task.drawn[name])
        if name in ("np_random", "np_random_seed"):
            return tuple(getattr(self, name))
        if name == "elapsed_steps":
            return tuple(self.task.steps.tolist())
        if name in ("action_space", "observation_space"):
            return (getattr(self, f"single_{name}"),) * self.num_envs
        if name in self._shared_names:
            return (self._shared(name),) * self.num_envs
        raise AttributeError(
            self._unknown("get_attr", name, (*self.task.drawn, "elapsed_steps", *SINGLE, *self._shared_names))
        )

    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute of every world.

        Parameters
        ----------
        name : str
            Name of a drawn value, or ``max_episode_steps``, which is the same for all worlds. A physical parameter such
            as ``mass`` changes at once, in the running and all later episodes; other drawn values change in later
            episodes. None draws the value again from the next episode on.
        values : list, tuple or anything else
            A list or a tuple has one entry for each world. Anything else is one value for all, such as a (3,) array for
            a size.

        Raises
        ------
        AttributeError
            A name that is unknown, or can only be given to the constructor.
        ValueError
            The message names the field, its value and what is allowed. Nothing has changed then.
        """
        settable = (*self.task.drawn, "max_episode_steps")
        if name not in settable:
            raise AttributeError(self._unknown("set_attr", name, settable))
        if isinstance(values, (list, tuple)) and len(values) != self.num_envs:
            raise ValueError(
                f"{name} has {len(values)} values; allowed are {self.num_envs}, one for each world, or one that is no "
                "list or tuple for all"
            )
        if name == "max_episode_steps":
            self.max_episode_steps = self._one_limit(values)
        else:
            self.task.hold(name, values)

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Call `render` for every world, or get an attribute of it.

        Parameters
        ----------
        name : str
            ``render``, or a name of `get_attr`.

        Returns
        -------
        tuple of length num_envs

        Raises
        ------
        AttributeError
            Any other name: a batch is reset, stepped and closed as a whole.
        TypeError
            Further arguments, which are never allowed.
        """
        if name in ("reset", "step", "close"):
            raise AttributeError(
                f"call got name {name!r}; the worlds of a native batch have no {name} of their own: use the "
                f"environment's, of some worlds reset(options={{'reset_mask': ...}})"
            )
        if args or kwargs:
            raise TypeError(f"call got arguments {args!r}, {kwargs!r} for {name!r}; allowed are none")
        if name == "render":
            return self.render() or (None,) * self.num_envs
        return self.get_attr(name)

    @property
    def _shared_names(self) -> tuple[str, ...]:
        return SHARED + (OF_BLOCKS if hasattr(self.task, "area") else ())

    def _shared(self, name: str) -> Any:
        if name in OF_BLOCKS:
            return getattr(self.task.area, name)
        if name in ("accuracy", "dt"):
            return getattr(self.task.world, name)
        if name in ("control_dt", "effects", "frame_skip"):
            return getattr(self.task, name)
        return getattr(self, name)

    def _one_limit(self, values: Any) -> int | None:
        limits = set(values) if isinstance(values, (list, tuple)) else {values}
        if len(limits) > 1:
            raise ValueError(f"max_episode_steps is {values!r}; allowed is the same number for all worlds of a batch")
        return episode_limit(limits.pop())

    def _unknown(self, method: str, name: str, allowed: tuple[str, ...]) -> str:
        return f"{method} got name {name!r}; allowed are {', '.join(nearest_first(name, allowed))}"
