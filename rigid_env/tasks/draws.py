"""Drawn values of episodes: drawn at the start, fixed by an option of `reset`, or held at a value by the user."""

from __future__ import annotations

import re
from collections.abc import Mapping
from difflib import get_close_matches

import numpy as np

from physics.keywords import nearest_first
from physics.scene.scene import Scene
from physics.summary import shown
from physics.world.world import World
from rigid_env.tasks.distribution import Distribution, is_of_user
from rigid_env.tasks.distributions import is_elementwise
from rigid_env.tasks.parameters import CHECKS, DRAWN_LENGTHS, WALL_PARAMETERS

SEED = 0
"""Seed of the uniform numbers for values before the first episode; any fixed number serves."""

NEAR = 0.8
"""Smallest similarity, from 0 to 1, at which a name counts as a misspelling of another."""

DOWN = (0.0, -1.0, 0.0)
"""Direction of gravity in a world whose gravity is zero."""

_PARAMETER = re.compile(rf"({'|'.join(DRAWN_LENGTHS)})(?:\[([^]]+)\])?$")


def parameter_of(name: str) -> tuple[str, str | None] | None:
    """Split a draw's name such as ``mass[1]`` or ``friction[die]`` into a physical parameter and a body or wall.

    Returns ``("mass", "1")``, with None for the body if the name means all bodies, and None alone for a name that is no
    physical parameter.
    """
    found = _PARAMETER.match(name)
    return None if found is None else (found[1], found[2])


def place_of(name: str, scene: Scene) -> int | None:
    """Index of the body or wall that the name of a physical parameter refers to; None for all bodies or walls.

    The name contains the index or the name of that body or wall.

    Raises
    ------
    ValueError
        The scene has no such body or wall.
    """
    kind, part = parameter_of(name) or ("", None)
    if part is None:
        return None
    what, items = ("walls", scene.walls) if kind in WALL_PARAMETERS else ("bodies", scene.bodies)
    names = {item.name: k for k, item in enumerate(items) if item.name is not None}
    if part in names:
        return names[part]
    if part.isdecimal() and int(part) < len(items):
        return int(part)
    known = "".join(f"{each}, " for each in nearest_first(part, names))
    raise ValueError(f"{part!r} in {name!r} is none of the {what}; allowed are {known}and 0 to {len(items) - 1}")


class Draws:
    """Drawn values of the running episodes, by name, for every world of a batch.

    Parameters
    ----------
    distributions : mapping of str to Distribution
        Distribution of each value. The names ``mass``, ``size``, ``radius`` (of spheres), ``friction``, ``restitution``
        and ``gravity`` mean physical parameters of all bodies, ``mass[1]`` that of body 1 alone, ``mass[die]`` that of
        the body of this name. ``wall_friction`` and ``wall_restitution`` are those of the walls, in the same way.
    worlds : int
        Number of worlds.

    Attributes
    ----------
    now : dict of str to (worlds,) or (worlds, k) float64
        Values of the running episodes. Before the first episode each value is the middle of its distribution; a value
        of a user's distribution, which may have no middle, is drawn with a fixed seed instead.
    uniforms : int
        Uniform numbers that an episode takes.
    held : dict of str to (worlds,) or (worlds, k) float64
        Values that new episodes take instead of draws, see `hold`.
    changes : int
        Number of times that `now` has changed, by which holders of copies see that theirs are old.
    varying : set of str
        Physical parameters that are written into the world at the start of an episode; all others have the scene's
        values in every episode.
    """

    def __init__(self, distributions: Mapping[str, Distribution], worlds: int):
        self.distributions = dict(distributions)
        ends = np.cumsum([0, *(each.uniforms for each in self.distributions.values())]).tolist()
        self._places = {name: slice(*pair) for name, *pair in zip(self.distributions, ends, ends[1:])}
        self.uniforms = ends[-1]
        self.parameters = [name for name in self.distributions if parameter_of(name)]
        self._order = [*self.parameters, *(name for name in self.distributions if name not in self.parameters)]
        self._of_user = {name for name, each in self.distributions.items() if is_of_user(each)}
        self.held: dict[str, np.ndarray] = {}
        self.varying = {name for name in self.parameters if not self.distributions[name].is_fixed}
        shares = np.full((worlds, self.uniforms), 0.5)
        for name in self._of_user:
            shares[:, self._places[name]] = self.rehearsal()[:, self._places[name]]
        middle = self.draw(np.arange(worlds), shares, {})
        self.now = {name: np.array(values, dtype=np.float64) for name, values in middle.items()}
        self.changes = 0

    def draw(self, rows: np.ndarray, shares: np.ndarray, options: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Draw the values of new episodes, and return them; the values of the running episodes stay.

        Parameters
        ----------
        rows : (n,) int64
            Worlds in which the episodes begin.
        shares : (n, uniforms) float64
            Uniform numbers in [0, 1), a row for each episode.
        options : mapping of str to (n,) or (n, k) float64
            Values that options of `reset` fix; they replace drawn and held ones.

        Returns
        -------
        dict of str to (n,) or (n, k) float64

        Raises
        ------
        ValueError
            A user's distribution returns values of a wrong shape or type, or values that are not finite.
        """
        values: dict[str, np.ndarray] = {}
        for name in self._order:
            if name in options:
                values[name] = options[name].copy()
            elif name in self.held:
                values[name] = self.held[name][rows]
            else:
                values[name] = self.distributions[name].at(shares[:, self._places[name]], values)
                if name in self._of_user:
                    self._check(name, values[name], len(rows))
        return values

    def rehearsal(self) -> np.ndarray:
        """Fixed uniform numbers (1, uniforms) of one episode, for values that are needed before the first episode."""
        return np.random.default_rng(SEED).random((1, self.uniforms))

    def _check(self, name: str, values, count: int) -> None:
        """Raise a ValueError if the `count` values of a user's distribution are not finite or of a wrong shape."""
        length = self.distributions[name].length
        shape = (count,) if length == 1 else (count, length)
        what = f"at of {type(self.distributions[name]).__name__}, draws {name},"
        if not isinstance(values, np.ndarray) or values.shape != shape or values.dtype.kind not in "fiub":
            given = f"{values.dtype} of shape {values.shape}" if isinstance(values, np.ndarray) else shown(values)
            raise ValueError(f"{what} gave {given}; allowed are numbers of shape {shape}")
        if not np.isfinite(values).all():
            raise ValueError(f"{what} gave {values[~np.isfinite(values)][0]}; allowed are finite numbers")

    def begin(self, rows: np.ndarray, values: Mapping[str, np.ndarray], options: Mapping[str, np.ndarray]) -> None:
        """Store the values of episodes that begin in worlds `rows`; `options` has those that options of `reset` fix."""
        self.changes += 1
        for name, value in values.items():
            self.now[name][rows] = value
        self.varying.update(name for name in self.parameters if name in options)

    def hold(self, name: str, values: np.ndarray | None) -> None:
        """Hold a value for later episodes, without drawing it again.

        Parameters
        ----------
        name : str
            Name of the draw.
        values : (worlds,) or (worlds, k) float64 or None
            A physical parameter also replaces the value of the running episodes. None: draw again from the next episode
            on.
        """
        if values is None:
            self.held.pop(name, None)
            return
        self.held[name] = np.array(values)
        if name in self.parameters:
            self.changes += 1
            self.now[name][...] = values
            self.varying.add(name)

    def read(self, name: str, field: str, value, worlds: int) -> np.ndarray:
        """Check a user's value for the draw `name`: shape, finite numbers, and the range of a physical parameter.

        `field` is the name of the value in an error.
        """
        values = self.distributions[name].read(field, value, worlds)
        parameter = parameter_of(name)
        if parameter is not None:
            CHECKS[parameter[0]](values, values.shape, field)
        return values


def world_arguments(
    values: Mapping[str, np.ndarray], before: Mapping[str, np.ndarray], scene: Scene
) -> dict[str, np.ndarray]:
    """Arguments of `World.set_parameters` from values of physical parameters.

    Parameters
    ----------
    values : mapping of str to (n,) or (n, k) array
        New values in n worlds, by names such as ``mass`` and ``mass[1]``.
    before : mapping of str to (n, bodies) or (n, bodies, 3) array
        Present values of all bodies, or walls, by parameter; gravity (n, 3) as a vector [m/s²].
    scene : Scene
        Scene of the worlds, which has the names of bodies and walls.

    Returns
    -------
    dict of str to (n, bodies), (n, bodies, 3) or (n, 3) array
        Present values with the new ones written into them.
    """
    arguments: dict[str, np.ndarray] = {}
    for name, value in values.items():
        (parameter, _), place = parameter_of(name), place_of(name, scene)
        if parameter == "gravity":
            strength = np.linalg.norm(before["gravity"], axis=1, keepdims=True)
            is_on = strength > 0.0
            down = np.where(is_on, before["gravity"] / np.where(is_on, strength, 1.0), DOWN)
            arguments[parameter] = value[:, None] * down
            continue
        if parameter == "radius":  # three equal diameters
            parameter, value = "size", np.repeat(2.0 * value[:, None], 3, axis=1)
        table = arguments.setdefault(parameter, before[parameter].copy())
        if place is None:
            table[...] = value[:, None]
        else:
            table[:, place] = value
    return arguments


def check_draws(task: str, distributions: Mapping[str, Distribution], world: World) -> None:
    """Check the physical parameters among a task's draws: the scene must have them, and their ranges must be allowed.

    Parameters
    ----------
    task : str
        Name of the task, for errors.
    distributions : mapping of str to Distribution
        Draws of the task, by name.
    world : physics.World
        World of the task.

    Raises
    ------
    ValueError
        Naming the draw, the value and what is allowed.
    """
    needs = {
        "friction": (world.plan.friction, "physics.Friction(...)"),
        "restitution": (world.plan.restitution, "physics.Contact(restitution=...)"),
        "gravity": (world.plan.gravity, "physics.Gravity(...)"),
        "wall_friction": (world.plan.material_columns, "a friction of its own, physics.HalfSpace(..., friction=...),"),
        "wall_restitution": (
            world.plan.material_columns and world.plan.restitution,
            "a restitution of its own, physics.HalfSpace(..., restitution=...),",
        ),
    }
    meant: dict[tuple[str, int], str] = {}
    for name, distribution in distributions.items():
        parameter = parameter_of(name)
        if parameter is None:
            near = get_close_matches(name.lower(), DRAWN_LENGTHS, 1, NEAR)
            if near:
                raise ValueError(f"draws of {task} has {name!r}, which is no {near[0]!r}; allowed is another name")
            continue
        kind, body = parameter
        is_on, effect = needs.get(kind, (True, ""))
        if not is_on:
            raise ValueError(
                f"draws of {task} has {name!r}, but its scene does not declare it; add {effect} to its "
                f"{'walls' if kind in WALL_PARAMETERS else 'effects'}"
            )
        if body is not None:
            if kind == "gravity":
                raise ValueError(f"draws of {task} has {name!r}; allowed is 'gravity', which is of all bodies")
            try:
                key = kind, place_of(name, world.scene) or 0
            except ValueError as error:
                raise ValueError(f"draws of {task}: {error}") from None
            if meant.setdefault(key, name) != name:
                raise ValueError(f"draws of {task} has {meant[key]!r} and {name!r}; allowed is one of the two")
            if kind in distributions:
                raise ValueError(f"draws of {task} has {kind!r} and {name!r}; allowed is one of the two")
        if kind in ("size", "radius"):
            _check_spheres(task, distributions, world, name)
        ends = distribution.ends()
        CHECKS[kind](ends, ends.shape, f"draws {name} of {task}")


def _check_spheres(task: str, distributions: Mapping[str, Distribution], world: World, name: str) -> None:
    """Check the draw `name`, a size or radius, against the shapes of the bodies that it means.

    A ValueError refuses a radius for a body that is no sphere, a radius beside a size for the same body, and a size
    with three independent numbers for a sphere, capsule or cylinder.
    """
    kind = (parameter_of(name) or ("",))[0]
    bodies, place = world.scene.bodies, place_of(name, world.scene)
    meant = range(len(bodies)) if place is None else (place,)
    for index in meant:
        is_sphere = bodies[index].kind == "sphere"
        if kind == "radius" and not is_sphere:
            allowed = "'radius[b]' for a sphere b, or another name"
            told = f"and body {index} is a {type(bodies[index]).__name__}"
            raise ValueError(f"draws of {task} has {name!r}, {told}; allowed is {allowed}")
        other = next((f"size{place}" for place in ("", f"[{index}]") if f"size{place}" in distributions), None)
        if kind == "radius" and other:
            raise ValueError(f"draws of {task} has {other!r} and {name!r} of body {index}; allowed is one of the two")
        if kind != "size" or not is_elementwise(distributions[name]):
            continue
        told = f"draws {name} of {task} is {distributions[name]!r}, and body {index}"
        if is_sphere:
            allowed = f"'radius[{index}]' with a number, a pair or a distribution"
            raise ValueError(f"{told} is a Sphere, of one diameter; allowed is {allowed}")
        if bodies[index].kind in ("capsule", "cylinder"):
            shape = type(bodies[index]).__name__
            raise ValueError(f"{told} is a {shape}, of two equal diameters; allowed is Choice([...]) of whole sizes")
