"""Starts of a task's episodes: draw values, place the bodies, and update quantities that depend on parameters."""

from __future__ import annotations

import reprlib
from collections.abc import Mapping
from dataclasses import replace as replace_fields
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.utils import seeding

import physics
from physics import validation
from physics.kernels.state import layout as at
from physics.parallel.team import listed
from physics.undo import undo_on_error
from physics.world.gusts import begin_gusts, gust_phases, reads_time
from physics.world.materials import wall_coefficients
from physics.world.parameters import masses_of
from physics.world.setters import start_anew
from rigid_env.tasks.declaration import Declaration
from rigid_env.tasks.distribution import Distribution, is_of_user
from rigid_env.tasks.distributions import as_distribution
from rigid_env.tasks.draws import parameter_of, world_arguments
from rigid_env.tasks.options import require_known
from rigid_env.tasks.parameters import DRAWN_LENGTHS
from rigid_env.tasks.replacing import refuse_replaced, replaced
from rigid_env.tasks.restoring import remember

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from physics.annotations import Effect
    from rigid_env.tasks.action_table import ActionTable
    from rigid_env.tasks.disturbances import Disturbances
    from rigid_env.tasks.draws import Draws

PARAMETER_ROUNDING = 1e-12
"""Largest relative rounding error of a parameter, which the world stores as an inverse or a half."""

AT_STARTS = ("declared_draws", "place", "note_episodes")
"""Functions of a compiled task that are called at the start of an episode."""

UNIT_GRAVITY = 9.81
"""[m/s²] Gravity in the unit m g of forces, for a scene without gravity."""


class Starts(Declaration):
    """Part of `Task` that begins episodes, and writes their drawn values into the worlds."""

    if TYPE_CHECKING:  # attributes that `Task` makes
        world: physics.World
        effects: tuple[Effect, ...]
        generators: list[np.random.Generator | None]
        episodes: Draws
        disturbed: Disturbances | None
        clock: int
        action: NDArray[np.float64]
        previous_action: NDArray[np.float64]
        given: NDArray[np.float64]
        outcome: NDArray[np.float64]
        record: NDArray[np.float64]
        obs: NDArray[np.float32]
        status: NDArray[np.int64]
        weights: NDArray[np.float64]
        limits: NDArray[np.float64]
        memory_arrays: dict[str, NDArray[np.float64]]
        _began: NDArray[np.int64]
        _functions: Any
        _own_starts: dict[str, np.ndarray]
        _table: ActionTable

        @property
        def worlds(self) -> int: ...

        @property
        def wrench(self) -> NDArray[np.float64]: ...

        @property
        def drawn(self) -> dict[str, NDArray[np.float64]]: ...

        @property
        def distributions(self) -> dict[str, Distribution]: ...

    def seed(self, world: int, seed: int | None) -> int:
        """Give one world a new random generator, as `gymnasium.Env.reset` does; returns its seed (None: random)."""
        self.generators[world], used = seeding.np_random(seed)
        return used

    def start(self, rows: np.ndarray, options: Mapping[str, Any] | None = None) -> None:
        """Start a new episode in the worlds `rows`.

        Parameters
        ----------
        rows : (n,) int64
            Worlds.
        options : dict, optional
            Values that are otherwise drawn, by the names of the task's `draws`; each has one value for all `rows`, or
            one for each row.

        Raises
        ------
        TypeError, ValueError
            An option that is unknown or out of range. Nothing has changed then, the generators included.
        """
        options = require_known(options, self.option_names)
        chosen = {name: self.episodes.read(name, f"options {name}", options[name], len(rows)) for name in options}
        refuse_replaced(self.effects, chosen, "options ")
        with undo_on_error(remember(self, rows) if self.may_fail or chosen else None):
            self._start(rows, chosen)

    def _start(self, rows: np.ndarray, chosen: Mapping[str, np.ndarray]) -> None:
        shares = np.array([self.generators[world].random(self.episodes.uniforms) for world in rows])
        has_fields = bool(self.world.plan.fields)
        has_time = has_fields or self.world.plan.motion_columns
        if has_time and len(rows) == self.worlds and reads_time(self.world.plan, self.world.params):
            self.world.time = 0.0  # so that the same seed leads to the same bits
        values = self.episodes.draw(rows, shares, chosen)
        self.move(rows, values, chosen)
        if has_fields:
            self._begin_gusts(rows)
        self.episodes.begin(rows, values, chosen)
        self._note_parameters(rows)
        for array in (self.action, self.previous_action, self.wrench, self.outcome, *self.memory_arrays.values()):
            array[rows] = 0.0
        self._began[rows] = self.clock
        self.status[rows] = physics.Status.OK
        if self.disturbed is not None:
            self.disturbed.begin(rows)
        self.note_episodes(rows, values)
        if self.compiled is None:
            self._functions.begin(rows)
        else:
            world = self.world
            self.compiled(listed(rows), world.state, self.record, world.walls, None, self.obs, self.outcome)

    def _begin_gusts(self, rows: np.ndarray) -> None:
        """Draw new phases of the wind's gusts in worlds `rows`, if the scene has gusts."""
        count = gust_phases(self.world.plan)
        if count:
            begin_gusts(self.world, rows, np.array([self.generators[world].random(count) for world in rows]))

    def move(self, rows: np.ndarray, values: Mapping[str, np.ndarray], chosen: Mapping[str, np.ndarray]) -> None:
        """Write poses and physical parameters of new episodes into the world; after an error nothing has changed.

        Parameters
        ----------
        rows : (n,) int64
            Worlds in which the episodes begin.
        values : mapping of str to (n,) or (n, k) array
            Drawn values of the episodes, by name.
        chosen : mapping
            Those of `values` that options of `start` fix.
        """
        told = self.episodes.varying | chosen.keys()
        changed = {name: values[name] for name in self.episodes.parameters if name in told}
        what = f"options {', '.join(self.place_options)}" if chosen else f"place of {type(self).__name__}"
        try:
            start_anew(self.world, rows, self._starts(values), self._arguments(rows, changed), what)
        except ValueError as error:
            if str(error).startswith(what):
                raise
            raise ValueError(f"{what}: {error}") from None

    def _arguments(self, rows: np.ndarray, values: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Arguments of `World.set_parameters` for worlds `rows`, from physical parameters by name."""
        return world_arguments(values, self._parameters_of(rows), self.world.scene) if values else {}

    def _parameters_of(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """Present physical parameters of worlds `rows` by name: (n, bodies) or (n, bodies, 3), gravity (n, 3).

        Those of walls are (n, walls); a scene whose walls have no coefficients has none of these.
        """
        world = self.world
        params = world.params.reshape(self.worlds, world.body_count, -1)[rows]
        return {
            "mass": masses_of(params),
            "size": 2.0 * params[..., at.DIMENSIONS : at.DIMENSIONS + 3],
            "friction": params[..., at.FRICTION],
            "restitution": params[..., at.RESTITUTION],
            "gravity": world.gravity[rows],
            **{f"wall_{name}": table for name, table in wall_coefficients(params[:, 0], world.plan).items()},
        }

    def _unlike_scene(self) -> set[str]:
        """Names of physical parameters whose value differs from the scene's."""
        one = np.zeros(1, dtype=np.int64)
        taken = replaced(self.effects)
        of: Any = parameter_of
        names = [name for name in self.episodes.parameters if of(name)[0] not in taken]
        fixed = {name: self.drawn[name][:1] for name in names}
        found = set()
        for name, value in fixed.items():
            ((parameter, now),) = self._arguments(one, {name: value}).items()
            if not np.allclose(now, self._parameters_of(one)[parameter], PARAMETER_ROUNDING, 0.0, equal_nan=True):
                found.add(name)
        return found

    def _starts(self, values: Mapping[str, np.ndarray]) -> dict[str, Any]:
        """Arguments of `World.set_state` for new episodes: the scene's poses and velocities, or those of `place`."""
        given = self.place(values)
        if not isinstance(given, Mapping) or not set(given) <= set(self._own_starts):
            raise ValueError(
                f"place of {type(self).__name__} gave {reprlib.repr(given)}; allowed is a dict with keys of "
                f"{', '.join(self._own_starts)}"
            )
        return {**self._own_starts, **given}

    def _check_starts(self) -> None:
        """Raise a ValueError if some draws lead to impossible starts; a subclass that knows its draws overrides it."""

    @property
    def place_options(self) -> tuple[str, ...]:
        """Options of `start` that decide where bodies are placed, for errors."""
        return self.option_names

    def _note_parameters(self, rows: np.ndarray) -> None:
        """Update bodies' weights and the limits of actions in worlds `rows`, from masses, sizes and gravity."""
        self.weights[rows] = weights = self._weights(rows)
        params = self.world.params.reshape(self.worlds, self.world.body_count, -1)[rows]
        reach = params[..., at.DIMENSIONS : at.DIMENSIONS + 3].max(axis=2)
        self.limits[rows] = self._table.limits(weights, reach, self.world.dt)

    def _weights(self, rows: np.ndarray) -> np.ndarray:
        """Weights m g (n, bodies) of the bodies in worlds `rows` [N]; 0 of fixed ones."""
        gravity = np.linalg.norm(self.world.gravity[rows], axis=1)
        gravity[gravity == 0.0] = UNIT_GRAVITY
        masses = masses_of(self.world.params.reshape(self.worlds, self.world.body_count, -1)[rows])
        return np.where(np.isinf(masses), 0.0, masses) * gravity[:, None]

    def hold(self, name: str, value) -> None:
        """Hold a drawn value in all worlds, without drawing it again.

        A physical parameter changes at once, any other value from the next episode on.

        Parameters
        ----------
        name : str
            Name of the draw.
        value : array_like or None
            One value for all worlds or one for each; None: draw again from the next episode on.

        Raises
        ------
        ValueError
            A value out of range, or a size with which a body would reach deep into a wall. Nothing has changed then.
        """
        refuse_replaced(self.effects, (name,))
        if value is not None:
            value = self.episodes.read(name, name, value, self.worlds)
            if name in self.episodes.parameters:
                self._change(name, value)
        self.episodes.hold(name, value)
        self._note_parameters(np.arange(self.worlds))

    def _change(self, name: str, value: np.ndarray) -> None:
        """Set a physical parameter in all worlds to values (worlds,) or (worlds, k); an error changes nothing."""
        try:
            arguments: Any = self._arguments(np.arange(self.worlds), {name: value})
            self.world.set_parameters(**arguments)
        except ValueError as error:
            raise ValueError(f"{name} is {reprlib.repr(value.tolist())}: {error}") from None

    @cached_property
    def may_fail(self) -> bool:
        """True if a user's code, which may raise an error, runs at the start of an episode."""
        parts = [getattr(type(self), name) for name in AT_STARTS]
        is_of_users = any(not str(part.__module__).startswith("rigid_env.") for part in parts)
        return not self.compiled or is_of_users or any(map(is_of_user, self.distributions.values()))

    @cached_property
    def own_draws(self) -> tuple[str, ...]:
        """Names of the draws that infos report: all that `effects` do not fix."""
        taken = replaced(self.effects)
        return tuple(name for name in self.drawn if name not in taken)

    @property
    def option_names(self) -> tuple[str, ...]:
        """Names of the options that `start` takes: all draws."""
        return tuple(self.drawn)

    def _scene(self, distributions: Mapping[str, Distribution]) -> physics.Scene:
        scene = self.make_scene(distributions)
        validation.instance(scene, physics.Scene, f"scene of {type(self).__name__}", "a physics.Scene")
        given = {type(effect) for effect in self.effects}
        kept = [effect for effect in scene.effects if type(effect) not in given]
        return replace_fields(scene, effects=(*kept, *self.effects)) if given else scene


def distributions_of(declared: Mapping[str, Any], given: Mapping[str, Any] | None) -> dict[str, Distribution]:
    """Distributions of a task by name: the declared ones, some replaced by a user's (`given`) of the same lengths."""
    declared = require_known(declared, declared, "draws")
    given = require_known(given, tuple(declared), "draws")
    found = {}
    for name, value in declared.items():
        field, parameter = f"draws {name}", parameter_of(name)
        own = as_distribution(field, value, DRAWN_LENGTHS[parameter[0]] if parameter else None)
        found[name] = as_distribution(field, given[name], own.length) if name in given else own
    return found
