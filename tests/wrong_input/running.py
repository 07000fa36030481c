"""Wrong input to running worlds: it is refused, and the world goes on as if it had not been given."""

from __future__ import annotations

import dataclasses

import numpy as np

import physics as p
from tests.wrong_input.case import Case

NAN = float("nan")
BODIES, WORLDS = 2, 3


def one_body() -> p.World:
    """A block that has fallen for a little while."""
    scene = p.Scene(
        [p.Block((1, 1, 1), 1.0, pos=(0, 2, 0))],
        p.three_walls(),
        [p.Gravity(), p.Contact(0.5), p.Friction(), p.Push((0, 1, 0))],
    )
    world = p.World(scene)
    world.step(steps=10)
    return world


def batch() -> p.World:
    """Three worlds of two spheres that pass through each other, behind an actuator that remembers."""
    scene = p.Scene(
        [p.Sphere(0.5, 1.0, pos=(2 * b, 2, 0)) for b in range(BODIES)],
        p.three_walls(),
        [p.Gravity(), p.Contact(between_bodies=False), p.Actuator(lag=0.1, delay=0.02)],
    )
    world = p.World(scene, worlds=WORLDS)
    for _ in range(4):
        world.step(np.full((WORLDS, BODIES, 6), 0.1))
    return world


SUBJECTS = {"one": one_body, "batch": batch}


def state_of(world: p.World) -> tuple:
    """Everything that decides how a world goes on, and what it shows."""
    actuation = None if world.actuation is None else (world.actuation.kept(), world.actuation.applied)
    return world.kept(), world.time, actuation, world.recorder, world.plan.key


def rows(subject: str, *cases) -> list[Case]:
    """Rows about one of the `SUBJECTS`."""
    return [Case(*case, on=subject) for case in cases]


def other_snapshot(world: p.World) -> p.Snapshot:
    """A snapshot of the first world alone."""
    snapshot = world.snapshot()
    return dataclasses.replace(snapshot, arrays=tuple(array[:1] for array in snapshot.arrays))


def poisoned(world: p.World) -> p.Snapshot:
    """A snapshot of the right sizes that holds text."""
    snapshot = world.snapshot()
    return dataclasses.replace(snapshot, arrays=tuple(array.astype(str) for array in snapshot.arrays))


ONE_SHAPES = "shape (6,) or (1, 6) or (1, 1, 6)"
BATCH_SHAPES = "shape (2, 6) or (3, 2, 6)"

# fmt: off
STEPS = rows(
    "one",
    ("step-wrench-of-three", lambda w: w.step((1, 2, 3)), ("wrench has shape (3,)", ONE_SHAPES)),
    ("step-wrench-scalar", lambda w: w.step(1.0), ("wrench is 1.0", ONE_SHAPES)),
    ("step-wrench-two-bodies", lambda w: w.step(np.zeros((1, 2, 6))), ("wrench has shape (1, 2, 6)", ONE_SHAPES)),
    ("step-wrench-nan", lambda w: w.step([0, 0, NAN, 0, 0, 0]), ("wrench is ", "nan", "finite")),
    ("step-wrench-infinite", lambda w: w.step(np.full((1, 1, 6), np.inf)), ("wrench is ", "inf", "finite")),
    ("step-wrench-string", lambda w: w.step("push"), ("wrench is 'push'", "numbers in shape")),
    ("step-wrench-strings", lambda w: w.step(["1"] * 6), ("wrench is ['1', '1'", "numbers in shape")),
    ("step-wrench-complex", lambda w: w.step(np.zeros((1, 1, 6), complex)), ("wrench is ", "0.j", "numbers in")),
    ("step-wrench-bools", lambda w: w.step(np.ones((1, 1, 6), bool)), ("wrench is ", "True", "numbers in")),
    ("step-wrench-objects", lambda w: w.step(np.array([[[None] * 6]])), ("wrench is ", "None", "numbers in")),
    ("step-wrench-ragged", lambda w: w.step([[1, 2], [3]]), ("wrench is [[1, 2], [3]]", "numbers in")),
    ("step-steps-zero", lambda w: w.step(steps=0), ("steps is 0", "at least 1")),
    ("step-steps-float", lambda w: w.step(steps=2.0), ("steps is 2.0", "integers of at least 1")),
    ("step-steps-bool", lambda w: w.step(steps=True), ("steps is True", "integers")),
    ("step-steps-huge", lambda w: w.step(steps=10**30), ("steps is 1000", "to 2147483647")),
    ("step-dt-negative", lambda w: w.step(dt=-1), ("dt is -1.0", "greater than 0")),
    ("step-dt-nan", lambda w: w.step(dt=NAN), ("dt is nan", "finite")),
    ("step-dt-string", lambda w: w.step(dt="1"), ("dt is '1'", "one number")),
    ("step-dt-after-wrench", lambda w: w.step(np.ones(6), dt=0), ("dt is 0.0", "greater than 0")),
)

BATCH_STEPS = rows(
    "batch",
    ("batch-wrench-of-one", lambda w: w.step(np.zeros(6)), ("wrench has shape (6,)", BATCH_SHAPES)),
    ("batch-wrench-of-worlds", lambda w: w.step(np.zeros((3, 6))), ("wrench has shape (3, 6)", BATCH_SHAPES)),
    ("batch-wrench-nan", lambda w: w.step(np.full((3, 2, 6), NAN)), ("wrench[0, 0, 0] is nan", "finite")),
    ("batch-steps-negative", lambda w: w.step(steps=-3), ("steps is -3", "at least 1")),
)

STATES = rows(
    "one",
    ("pos-of-two", lambda w: w.set_state(pos=(1, 2)), ("pos has shape (2,)", "shape (3,) or (1, 3) or (1, 1, 3)")),
    ("pos-nan", lambda w: w.set_state(pos=(0, NAN, 0)), ("pos is ", "nan", "finite")),
    ("pos-string", lambda w: w.set_state(pos="up"), ("pos is 'up'", "numbers in shape (3,)")),
    ("pos-inside", lambda w: w.set_state(pos=(0, -5, 0)), ("pos [0.0, -5.0, 0.0] of body 0", "inside", "at most")),
    ("quat-zero", lambda w: w.set_state(quat=(0, 0, 0, 0)), ("quat is [0., 0., 0., 0.] of norm 0", "within 0.0001")),
    ("quat-of-three", lambda w: w.set_state(quat=(1, 0, 0)), ("quat has shape (3,)", "shape (4,)")),
    ("good-pos-bad-quat", lambda w: w.set_state((1, 2, 0), (2, 0, 0, 0)), ("of norm 2;", "divide it by its norm")),
    ("linvel-infinite", lambda w: w.set_state(linvel=(np.inf, 0, 0)), ("linvel is ", "inf", "finite")),
    ("angvel-bools", lambda w: w.set_state(angvel=[True, False, True]), ("angvel is [True", "numbers in shape")),
    ("state-keyword", lambda w: w.set_state(position=(1, 2, 3)), ("World.set_state", "'position'", "allowed are pos,")),
)

BATCH_STATES = rows(
    "batch",
    ("pos-of-worlds", lambda w: w.set_state(pos=np.ones((3, 3))), ("pos has shape (3, 3)", "(2, 3) or (3, 2, 3)")),
    ("pos-nan-in-one-world", lambda w: w.set_state(pos=np.full((3, 2, 3), NAN)), ("pos[0, 0, 0] is nan", "finite")),
    ("quat-bad-in-one-world", lambda w: w.set_state(quat=[[[1, 0, 0, 0], [3, 0, 0, 0]]] * 3),
     ("quat is [3., 0., 0., 0.] of norm 3", "norm 1 within 0.0001")),
    ("worlds-too-high", lambda w: w.set_state(pos=np.ones((2, 3)), worlds=[0, 3]), ("worlds is [0, 3]", "from 0 to 2")),
    ("worlds-negative", lambda w: w.set_state(pos=np.ones((2, 3)), worlds=[-1]), ("worlds is [-1]", "from 0 to 2")),
    ("worlds-number", lambda w: w.set_state(pos=np.ones((2, 3)), worlds=1), ("worlds is 1", "a list of indices")),
    ("worlds-floats", lambda w: w.set_state(pos=np.ones((2, 3)), worlds=[0.5]), ("worlds is [0.5]", "a list of")),
    ("worlds-short-mask", lambda w: w.set_state(pos=np.ones((2, 3)), worlds=[True]), ("worlds is [True]", "3 bools")),
    ("worlds-twice", lambda w: w.set_state(pos=np.ones((2, 3)), worlds=[1, 1]), ("worlds is [1, 1]", "world once")),
    ("worlds-ragged", lambda w: w.set_state(pos=np.ones((2, 3)), worlds=[[0], 1]), ("worlds is [[0], 1]", "a list of")),
)

PARAMETERS = rows(
    "one",
    ("mass-zero", lambda w: w.set_parameters(mass=0), ("mass is ", "0.", "greater than 0")),
    ("mass-subnormal", lambda w: w.set_parameters(mass=5e-324), ("mass is ", "5e-324", "1e-150")),
    ("mass-string", lambda w: w.set_parameters(mass="heavy"), ("mass is 'heavy'", "numbers in shape")),
    ("mass-of-two", lambda w: w.set_parameters(mass=[1, 2]), ("mass has shape (2,)", "shape (1, 1)")),
    ("size-negative", lambda w: w.set_parameters(size=(1, -1, 1)), ("size is ", "-1.", "greater than 0")),
    ("size-tiny", lambda w: w.set_parameters(size=(1e-200,) * 3), ("moments of inertia are [0., 0., 0.]", "1e-150")),
    ("size-into-the-wall", lambda w: w.set_parameters(size=(9, 9, 9)), ("inside walls[0]", "at most")),
    ("inertia-triangle", lambda w: w.set_parameters(inertia_body=np.diag([1, 1, 5])), ("inertia_body is", "triangle")),
    ("friction-negative", lambda w: w.set_parameters(friction=-1), ("friction is ", "-1.", "at least 0")),
    ("restitution-two", lambda w: w.set_parameters(restitution=2), ("restitution is ", "2.", "from 0 to 1")),
    ("gravity-scalar", lambda w: w.set_parameters(gravity=-9.81), ("gravity is -9.81", "shape (3,)")),
    ("gravity-infinite", lambda w: w.set_parameters(gravity=(0, np.inf, 0)), ("gravity is ", "inf", "finite")),
    ("effect-string", lambda w: w.set_parameters(effects="Push"), ("effects is 'Push'", "a list of effects")),
    ("effect-number", lambda w: w.set_parameters(effects=[3]), ("effects holds 3", "force fields")),
    ("effect-undeclared", lambda w: w.set_parameters(effects=p.Drag()), ("Drag was given", "add physics.Drag(...)")),
    ("effect-twice", lambda w: w.set_parameters(effects=[p.Friction(1), p.Friction(2)]), ("Friction", "is one")),
    ("effect-too-many", lambda w: w.set_parameters(effects=[p.Push()] * 2), ("effects holds 2 Push", "are 1, as in")),
    ("good-mass-bad-friction", lambda w: w.set_parameters(mass=2, friction=NAN), ("friction is ", "nan", "finite")),
    ("parameter-keyword", lambda w: w.set_parameters(masss=2), ("'masss' (given: 2)", "allowed are mass,")),
)

BATCH_PARAMETERS = rows(
    "batch",
    ("undeclared-friction", lambda w: w.set_parameters(friction=1), ("friction was given", "add physics.Friction")),
    ("undeclared-restitution", lambda w: w.set_parameters(restitution=1), ("restitution was", "physics.Contact(rest")),
    ("gravity-of-bodies", lambda w: w.set_parameters(gravity=np.ones((2, 3))), ("gravity has shape (2, 3)", "(3, 3)")),
    ("sphere-of-three-sizes", lambda w: w.set_parameters(size=(1, 1, 2)), ("size is [1.0, 1.0, 2.0] for a", "equal")),
)

LOOKS = rows(
    "batch",
    ("restore-none", lambda w: w.restore(None), ("snapshot is None", "a physics.Snapshot")),
    ("restore-tuple", lambda w: w.restore(w.kept()), ("snapshot is (", "a physics.Snapshot")),
    ("restore-world", lambda w: w.restore(w), ("snapshot is World(", "a physics.Snapshot")),
    ("restore-other-size", lambda w: w.restore(other_snapshot(w)), ("snapshot is Snapshot(", "of 3 worlds")),
    ("restore-text", lambda w: w.restore(poisoned(w)), ("snapshot is Snapshot(", "numbers")),
    ("contacts-99", lambda w: w.contacts(99), ("world is 99", "from 0 to 2")),
    ("contacts-negative", lambda w: w.contacts(-1), ("world is -1", "from 0 to 2")),
    ("contacts-float", lambda w: w.contacts(1.0), ("world is 1.0", "from 0 to 2")),
    ("contacts-string", lambda w: w.contact_ends("a"), ("world is 'a'", "from 0 to 2")),
    ("touching-none", lambda w: w.touching(None), ("world is None", "from 0 to 2")),
    ("wrench-at-nan", lambda w: p.wrench_at(w, (NAN, 0, 0)), ("force is ", "nan", "finite")),
    ("wrench-at-shape", lambda w: p.wrench_at(w, np.ones((4, 3))), ("force has shape (4, 3)", "(3, 2, 3)")),
    ("stepper-steps", lambda w: p.Stepper(w, steps=1.5), ("steps is 1.5", "integers")),
    ("stepper-then", lambda w: p.Stepper(w, then=3), ("then is 3", "a function")),
    ("recorder", lambda w: p.Recorder(w), ("Actuator(", "without lag and delay")),
)
# fmt: on

CASES = STEPS + BATCH_STEPS + STATES + BATCH_STATES + PARAMETERS + BATCH_PARAMETERS + LOOKS
