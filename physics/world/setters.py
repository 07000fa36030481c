"""Changes of states and parameters of worlds by a user: all values are checked first, then all are written."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from physics import validation
from physics.kernels.half_space.gap_queries import write_angular_momenta
from physics.kernels.state import layout as at
from physics.kernels.state.contact_law_dispatch import LAW_STIFFNESS
from physics.scene.body_names import body_index, body_label
from physics.scene.effects import RESISTANCES, Contact, Friction
from physics.scene.force_field import Field, FieldSlot, write_columns
from physics.scene.groups import may_meet
from physics.scene.springs import check_ends, with_indices
from physics.summary import shown
from physics.world import choice, materials, motions, parameters
from physics.world.batch import Batch
from physics.world.wall_distance import geometric_centres, wall_gaps

# Largest depth in a wall, in bounding radii, at which a body may be put: the error of a rounded or hand-typed pose.
START_DEPTH = 1e-2

# Largest depth in a wall with springs, which carry a body by its depth: the centre of mass stays outside.
SOFT_DEPTH = 1.0

# The centres of two bodies count as equal within this share of the smaller bounding radius, which allows for rounding.
SAME_PLACE = 1e-12

# Names of the arguments of `World.set_parameters` that are numbers of bodies, walls and effects.
PARAMETERS = (
    "mass", "size", "inertia_body", "friction", "restitution", "wall_friction", "wall_restitution", "effects",
)  # fmt: skip

# Direction along which bodies are sorted to find equal centres; scenes hardly ever use it.
SKEW = np.array([0.5257311121191336, 0.3090169943749474, 0.7925309171246312])


def set_state(world: Batch, pos, quat, linvel, angvel, worlds) -> None:
    """Set the state of bodies in some worlds; `World.set_state` documents arguments and errors."""
    chosen = _chosen(world, worlds)
    rows = _rows(world, chosen)
    state = _new_state(world, chosen, rows, pos, quat, linvel, angvel)
    motions.check_tables_kept(world, chosen, world.state[rows], state, world.params[rows])
    _adopt(world, chosen, rows, state, world.params[rows], "set_state")
    if world.actuation is not None:
        world.actuation.forget(chosen)


def set_parameters(world: Batch, given: Mapping, worlds) -> None:
    """Set physical parameters of some worlds, `given` by name; `World.set_parameters` documents them and all errors."""
    chosen = _chosen(world, worlds)
    rows = _rows(world, chosen)
    given = dict(given)
    gravity = given.pop("gravity")
    params = _new_parameters(world, chosen, rows, given)
    field = None if gravity is None else _new_gravity(world, chosen, gravity)
    _adopt(world, chosen, rows, world.state[rows], params, "set_parameters", keep_memory=given["size"] is None)
    if field is not None:
        world.gravity[chosen] = field


def set_motion(world: Batch, body, motion, numbers: tuple, worlds) -> None:
    """Give a fixed body of some worlds a motion; `World.set_motion` documents arguments and errors.

    `numbers` are velocity, spin and surface velocity.
    """
    chosen, b = _chosen(world, worlds), body_index(body, "body", world.scene)
    label = body_label(b, world.names)
    if not world.scene.bodies[b].fixed:
        raise ValueError(f"body is {label}, which is not fixed; allowed are bodies with fixed=True")
    if not world.plan.motion_columns:
        raise ValueError(
            f"body is {label}, but no body of the scene has a motion, so its kernels leave motions out; give one of "
            "them motion=physics.Motion()"
        )
    motions.check_one_way(motion, numbers)
    rows = _rows(world, chosen)
    state, params = world.state[rows], world.params[rows]
    own, columns = state[b :: world.body_count], motions.motion_columns(params, world.plan)[b :: world.body_count]
    if motion is None:
        columns[:] = motions.changed_columns(columns, *numbers)
    else:
        columns[:] = motions.new_columns(motion, world.plan, own, world.time)
    motions.write_motion_state(own, columns)
    has_jumped = (own[:, : at.LINVEL] != world.state[rows][b :: world.body_count, : at.LINVEL]).any()
    _adopt(world, chosen, rows, state, params, "set_motion", keep_memory=not has_jumped)


def start_anew(world: Batch, worlds, state: Mapping, given: Mapping, what: str = "start") -> None:
    """Give some worlds new states and new parameters at once; after an error nothing has changed.

    New states are checked with the new parameters: the old state need not fit the new sizes.

    Parameters
    ----------
    world : Batch
        Batch to change.
    worlds : (k,) int array_like
        Indices of the worlds to change.
    state : mapping
        Arguments of `World.set_state` by name.
    given : mapping
        Arguments of `World.set_parameters` by name.
    what : str
        First words of an error about the place of a body.
    """
    chosen = _chosen(world, worlds)
    rows = _rows(world, chosen)
    given = dict(given)
    gravity = given.pop("gravity", None)
    new = _new_state(world, chosen, rows, **{**dict.fromkeys(("pos", "quat", "linvel", "angvel")), **state})
    params = world.params[rows]
    if given:
        params = _new_parameters(world, chosen, rows, {**dict.fromkeys(PARAMETERS), **given})
    field = None if gravity is None else _new_gravity(world, chosen, gravity)
    motions.write_scene_motions(world.scene, world.plan, new, params, world.time)
    _adopt(world, chosen, rows, new, params, what)
    if field is not None:
        world.gravity[chosen] = field
    if world.actuation is not None:
        world.actuation.forget(chosen)


def _new_state(world: Batch, chosen, rows, pos, quat, linvel, angvel) -> np.ndarray:
    """Make the new rows of `state` for the chosen worlds: arguments that are not None replace the old columns."""
    state = world.state[rows]
    given = (("pos", pos, at.POS, 3), ("quat", quat, at.QUAT, 4), ("linvel", linvel, at.LINVEL, 3),
             ("angvel", angvel, at.ANGVEL, 3))  # fmt: skip
    for name, value, first, size in given:
        if value is None:
            continue
        shape = (len(chosen), world.body_count, size)
        check = validation.unit_quaternion if name == "quat" else validation.finite
        value = check(validation.batch(value, shape, name), shape, name)
        if name in ("linvel", "angvel"):
            value = _check_still(world, chosen, name, value)
        state[:, first : first + size] = value.reshape(-1, size)
    return state


def _check_still(world: Batch, chosen, name: str, value: np.ndarray) -> np.ndarray:
    """Refuse velocities (k, bodies, 3) of the chosen worlds, called `name`, that are neither 0 nor a fixed body's own.

    Returned are the velocities, with the fixed bodies' own ones.
    """
    own = getattr(world, name)[chosen]
    bad = np.argwhere(value.any(axis=-1) & (value != own).any(axis=-1) & _fixed(world))
    if len(bad):
        k, b = bad[0].tolist()
        raise ValueError(
            f"{name} is {value[k, b].tolist()} for body {body_label(b, world.names)} in world {int(chosen[k])}, which "
            "is fixed; allowed is (0, 0, 0), or World.set_motion"
        )
    return np.where(_fixed(world)[:, None], own, value)


def _fixed(world: Batch) -> np.ndarray:
    """True (bodies,) for fixed bodies."""
    return np.array([body.fixed for body in world.scene.bodies])


def _new_parameters(world: Batch, chosen, rows, given: Mapping) -> np.ndarray:
    """Make the new rows of `params` for the chosen worlds: parameters `given` that are not None replace old columns."""
    params = world.params[rows]
    plan, shape = world.plan, (len(chosen), world.body_count)
    mass, size, inertia_body, friction, restitution, wall_friction, wall_restitution, effects = (
        given[name] for name in PARAMETERS
    )
    if mass is not None or size is not None or inertia_body is not None:
        parameters.change_inertia(params, world.scene.bodies, plan, mass, size, inertia_body, shape)
    if friction is not None:
        _needs("friction", plan.friction, "physics.Friction(...)")
        params[:, at.FRICTION] = validation.non_negative(*parameters.spread(friction, shape, "friction")).ravel()
    if restitution is not None:
        _needs("restitution", plan.restitution, "physics.Contact(restitution=...)")
        params[:, at.RESTITUTION] = validation.share(*parameters.spread(restitution, shape, "restitution")).ravel()
    materials.write_wall_coefficients(params, shape, plan, wall_friction, wall_restitution)
    if effects is not None:
        _write_effects(world, chosen, params, effects)
    return params


def _write_effects(world: Batch, chosen, params, effects) -> None:
    """Write the numbers of the given effects (contact laws, force fields) into rows `params` of the chosen worlds."""
    if isinstance(effects, (str, bytes)):
        raise ValueError(f"effects is {shown(effects)}; allowed is a list of effects")
    effects = tuple(effects) if isinstance(effects, Iterable) else (effects,)
    effects = tuple(with_indices(effect, world.scene) for effect in effects)
    laws = [effect for effect in effects if isinstance(effect, (*RESISTANCES, Friction))]
    for effect in laws:
        if sum(type(effect) is type(other) for other in laws) > 1:
            raise ValueError(f"effects holds several {type(effect).__name__}; allowed is one")
        _needs(type(effect).__name__, world.scene.effect(type(effect)), f"physics.{type(effect).__name__}(...)")
        if isinstance(effect, Friction):
            _check_settings(effect, world.scene.effect(Friction))
            materials.write_scene_friction(params, world.scene, effect)
    parameters.write_laws(params, world.plan, laws)
    fields = [effect for effect in effects if effect not in laws]
    write_columns(_changed_slots(world, fields), params[:, at.PARAM_SIZE :], world.body_count, chosen)


def _new_gravity(world: Batch, chosen, gravity) -> np.ndarray:
    """Check the gravity given for the chosen worlds; return it as (k, 3) [m/s²]."""
    _needs("gravity", world.plan.gravity, "physics.Gravity(...)")
    field = validation.batch(gravity, (len(chosen), 1, 3), "gravity")[:, 0]
    return validation.finite(field, field.shape, "gravity")


def check_place(world: Batch, state: np.ndarray, params: np.ndarray, chosen: np.ndarray, what: str) -> None:
    """Refuse states with a body deep inside a wall, or with the centres of two touching bodies in the same place.

    Parameters and errors are those of `check_depth`.
    """
    check_depth(world, state, params, chosen, what)
    if world.plan.meeting:
        _check_centres(world, state, params, chosen, what)


def _check_centres(world: Batch, state: np.ndarray, params: np.ndarray, chosen: np.ndarray, what: str) -> None:
    """Refuse two convex bodies with their centres in the same place, since no direction separates them best.

    Bodies are sorted along the direction `SKEW`. Equal centres are neighbours along any direction; other centres hardly
    ever coincide along this one. So later neighbours are compared only while some that touch nothing share a place.
    """
    bodies, contact = world.scene.bodies, world.scene.effect(Contact)
    shape = (len(chosen), world.body_count)
    centres = geometric_centres(world, state, params).reshape(*shape, 3)
    radii = params[:, at.RADIUS].reshape(shape)
    with np.errstate(over="ignore", invalid="ignore"):  # the report of a step tells about numbers that are too large
        order = np.argsort(centres @ SKEW, axis=1, kind="stable")
        centres, radii = (np.take_along_axis(each, order[..., None], axis=1) for each in (centres, radii[..., None]))
        for lag in range(1, world.body_count):
            apart = np.abs(centres[:, lag:] - centres[:, :-lag]).max(axis=2)
            found = np.argwhere(apart <= SAME_PLACE * np.minimum(radii[:, lag:, 0], radii[:, :-lag, 0]))
            if not len(found):
                return
            for k, i in found:
                pair = sorted((int(order[k, i]), int(order[k, i + lag])))
                if any(bodies[b].kind == "compound" for b in pair):
                    continue  # whose centre may lie outside of all its parts
                if may_meet(bodies[pair[0]], bodies[pair[1]], contact.between_bodies):
                    raise _same_place(world, state, int(chosen[k]), k * world.body_count, pair, what)


def _same_place(world: Batch, state, world_index: int, first: int, pair: list[int], what: str) -> ValueError:
    """Make the error about the `pair` of bodies of a world, whose rows of `state` begin at `first`."""
    places = [state[first + body, at.POS : at.POS + 3].tolist() for body in pair]
    first_label, second_label = (body_label(body, world.names) for body in pair)
    return ValueError(
        f"{what}: bodies {first_label} and {second_label} in world {world_index} have their centres in the "
        f"same place, pos {places[0]} and {places[1]}; allowed are different places (what overlaps otherwise is "
        "lifted apart)"
    )


def check_depth(world: Batch, state: np.ndarray, params: np.ndarray, chosen: np.ndarray, what: str) -> None:
    """Refuse states with a body deeper inside a wall than allowed; a fixed body may be at any depth.

    Parameters
    ----------
    world : Batch
        Batch with the scene of these states.
    state, params : (k * bodies, STATE_SIZE | PARAM_SIZE) float64
        States and parameters to check, a row for each body.
    chosen : (k,) int64
        Indices of the worlds that the rows belong to.
    what : str
        First words of the message.

    Raises
    ------
    ValueError
        A body is too deep inside a wall. The message names the first such body, its place and the allowed depth.
    """
    if not world.plan.contact:
        return
    gaps, which = wall_gaps(world, state, params)
    allowed = (SOFT_DEPTH if LAW_STIFFNESS in world.plan.laws else START_DEPTH) * params[:, at.RADIUS]
    bad = np.flatnonzero((gaps < -allowed) & ~np.tile(_fixed(world), len(chosen)))
    if len(bad):
        k = int(bad[0])
        body = body_label(k % world.body_count, world.names)
        raise ValueError(
            f"{what}: pos {state[k, at.POS : at.POS + 3].tolist()} of body {body} in world "
            f"{int(chosen[k // world.body_count])} is {-gaps[k]:.6g} m inside walls[{which[k]}]; allowed is at most "
            f"{allowed[k]:.3g} m"
        )


def _adopt(world: Batch, chosen, rows, state, params, what, keep_memory=False) -> None:
    """Check new rows of state and parameters of the chosen worlds, then write them into the batch.

    Contact memory is cleared unless `keep_memory`. Sleeping bodies wake, and the recorder is notified.
    """
    check_place(world, state, params, chosen, what)
    write_angular_momenta(np.arange(len(rows)), state, params)
    world.state[rows] = state
    world.params[rows] = params
    if world.plan.sleeping:
        world.sleep[rows] = 0.0
    if world.plan.contact and not keep_memory:
        world.memory.reshape(world.worlds, -1)[chosen] = 0.0
        world.forget_impacts(chosen)
    if world.recorder is not None:
        world.recorder.changed(chosen)


def _needs(field: str, is_on, effect: str) -> None:
    if not is_on:
        raise ValueError(f"{field} was given, but the scene does not declare it; add {effect} to Scene.effects")


def _check_settings(friction: Friction, declared: Friction) -> None:
    """Refuse a `Friction` that differs from the scene's in a setting that all worlds share."""
    for name in ("axis", "rule", "pairs", "body_axes"):
        given, own = getattr(friction, name), getattr(declared, name)
        if given != own:
            raise ValueError(
                f"Friction.{name} is {shown(given)}; allowed is the scene's, {shown(own)}: it is the same in all worlds"
            )


def _changed_slots(world: Batch, effects) -> list[FieldSlot]:
    """Field slots of the scene with the fields that `effects` replace; ValueError for a field without a slot."""
    kinds: dict[type, list[Field]] = {}
    for effect in effects:
        if not isinstance(effect, Field):
            raise ValueError(
                f"effects holds {shown(effect)}; allowed are force fields, Friction, RollingFriction and SpinFriction "
                "(the rest has arguments of its own, or is the same in all worlds)"
            )
        effect.check(world.body_count)
        check_ends(effect, world.scene.bodies)
        if world.plan.sleeping and not effect.is_steady:
            raise ValueError(
                f"effects holds {effect!r}, which may change on its own, in a scene in which bodies sleep; allowed is "
                "what is steady, or a scene that declares such a field, in which nothing sleeps"
            )
        kinds.setdefault(effect.kind, []).append(effect)
    slots = {slot.kind: slot for slot in world.plan.fields}
    for kind, given in kinds.items():
        name = type(given[0]).__name__ + (" between bodies" if kind.is_linked else "")
        _needs(name, kind in slots, f"physics.{type(given[0]).__name__}(...)")
        slot = slots[kind]
        if len(given) != len(slot.effects):
            raise ValueError(f"effects holds {len(given)} {name}; allowed are {len(slot.effects)}, as in the scene")
        slots[kind] = replace(slot, effects=tuple(given))
    return [slots[kind] for kind in kinds]


def _chosen(world: Batch, worlds) -> np.ndarray:
    """Indices (k,) int64 of the worlds that a user chose; None: all."""
    return np.arange(world.worlds) if worlds is None else choice.world_indices(worlds, world.worlds)


def _rows(world: Batch, chosen: np.ndarray) -> np.ndarray:
    """Indices (k * bodies,) of the rows of the chosen worlds in arrays with a row for each body."""
    return (chosen[:, None] * world.body_count + np.arange(world.body_count)).ravel()
