"""Errors in a user's field name class, function and line before anything moves; no index reads foreign memory."""

from __future__ import annotations

import copy
import inspect
import math
import pickle
from dataclasses import dataclass
from typing import ClassVar

import numba
import numpy as np
import pytest

import physics

BALL = physics.Sphere(0.1, 1.0)
NO_TORQUE = (0.0, 0.0, 0.0)
LISTED = [1.0, 2.0]


def made(plain, is_air=False, energy=None, columns=None):
    """A field `Own` with this function and one number, `strength`."""
    parts = {"function": physics.field_function(plain), "is_air": is_air, "energy": energy, "strength": 1.0}
    parts["__annotations__"] = {
        "function": ClassVar, "is_air": ClassVar, "energy": ClassVar, "strength": float,
    }  # fmt: skip
    if columns is not None:
        parts["columns"] = columns
    return dataclass(frozen=True)(type("Own", (physics.Field,), parts))()


def world_with(*effects, **options) -> physics.World:
    return physics.World(physics.Scene([BALL], effects=effects), **options)


# --- functions that no step must meet: each with the line that the error shows, and words of the message ------------


def plain_helper(x):
    return 2.0 * x


@numba.njit
def unchecked(p, k):
    return p[k]


@physics.field_function
def reads_the_last_but_one(q):
    return q[-2]


def gives_a_number(state, p, t):
    return p[0]


def gives_a_force_alone(state, p, t):
    return state.x


def gives_two_numbers(state, p, t):
    return p[0], t


def gives_none(state, p, t):
    pass


def gives_none_at_times(state, p, t):
    if t > 1.0:
        return None
    return state.x, NO_TORQUE


def gives_a_view(state, p, t):
    return p[0:3], NO_TORQUE


def gives_four(state, p, t):
    return (p[0], 0.0, 0.0, 0.0), NO_TORQUE


def asks_for_a_velocity(state, p, t):
    return state.velocity, NO_TORQUE


def calls_what_is_not_compiled(state, p, t):
    return (plain_helper(p[0]), 0.0, 0.0), NO_TORQUE


def names_nothing(state, p, t):
    return (nothing_like_it(p[0]), 0.0, 0.0), NO_TORQUE  # noqa: F821


def multiplies_a_tuple(state, p, t):
    return 2.0 * state.x, NO_TORQUE


def makes_an_array(state, p, t):
    return np.zeros(3), NO_TORQUE


def reads_a_list(state, p, t):
    return (LISTED[0], 0.0, 0.0), NO_TORQUE


def takes_two(state, p):
    return state.x, NO_TORQUE


def reads_too_far(state, p, t):
    return (p[5], 0.0, 0.0), NO_TORQUE


def reads_too_far_from_the_end(state, p, t):
    return (p[-2], 0.0, 0.0), NO_TORQUE


def hands_p_on(state, p, t):
    return (reads_the_last_but_one(p), 0.0, 0.0), NO_TORQUE


def hands_p_to_numba(state, p, t):
    return (unchecked(p, 0), 0.0, 0.0), NO_TORQUE


def writes_to_p(state, p, t):
    p[0] = 2.0
    return state.x, NO_TORQUE


FORM = r"allowed is \(\(fx, fy, fz\), \(tx, ty, tz\)\)"

WRONG = [
    (gives_a_number, "return p[0]", f"returns a number; {FORM}"),
    (gives_a_force_alone, "return state.x", f"returns a tuple of 3 numbers; {FORM}"),
    (gives_two_numbers, "return p[0], t", f"returns a tuple of 2 numbers; {FORM}"),
    (gives_none, "pass", f"returns None; {FORM}"),
    (gives_none_at_times, "def gives_none_at_times(state, p, t):", f"or None; {FORM}"),
    (gives_a_view, "return p[0:3], NO_TORQUE", f"returns .an array, .*; {FORM}"),
    (gives_four, "return (p[0], 0.0, 0.0, 0.0), NO_TORQUE", f"a tuple of 4 numbers, .*; {FORM}"),
    (asks_for_a_velocity, "return state.velocity, NO_TORQUE", "no 'velocity'; allowed are x, v, w, R, center, air,"),
    (calls_what_is_not_compiled, "return (plain_helper(p[0]), 0.0, 0.0), NO_TORQUE", "plain_helper is not compiled; "
     "allowed are functions under @physics.field_function"),
    (names_nothing, "return (nothing_like_it(p[0]), 0.0, 0.0), NO_TORQUE  # noqa: F821", "'nothing_like_it' is not"),
    (multiplies_a_tuple, "return 2.0 * state.x, NO_TORQUE", "there is no mul.*; allowed are numbers, tuples"),
    (makes_an_array, "return np.zeros(3), NO_TORQUE", "there is no zeros.*arrays, lists and other objects cannot be"),
    (reads_a_list, "return (LISTED[0], 0.0, 0.0), NO_TORQUE", "LISTED .*; allowed are numbers"),
    (takes_two, "def takes_two(state, p):", r"takes \(state, p\); allowed is \(state, p, t\)"),
    (reads_too_far, "return (p[5], 0.0, 0.0), NO_TORQUE", r"reads p\[5\]; allowed is p\[0\]: the fields of Own, str"),
    (reads_too_far_from_the_end, "return (p[-2], 0.0, 0.0), NO_TORQUE", r"reads p\[-2\]; allowed is p\[0\]"),
    (hands_p_on, "return q[-2]", r"reads p\[-2\]; allowed is p\[0\]"),
    (hands_p_to_numba, "return (unchecked(p, 0), 0.0, 0.0), NO_TORQUE", "array to unchecked, .* check its indices"),
    (writes_to_p, "p[0] = 2.0", "writes to p; allowed is to read it"),
]  # fmt: skip


@pytest.mark.parametrize(("plain", "line", "words"), WRONG, ids=[each[0].__name__ for each in WRONG])
def test_an_error_in_a_function_names_class_file_line_and_what_is_allowed(plain, line, words):
    field = made(plain)
    with pytest.raises(ValueError, match=f"^Own.function .*{words}") as caught:
        world_with(field)
    first, place, shown = str(caught.value).split("\n")
    source, start = inspect.getsourcelines(reads_the_last_but_one.py_func if plain is hands_p_on else plain)
    number = start + [each.strip() for each in source].index(line)
    name = "reads_the_last_but_one" if plain is hands_p_on else plain.__name__
    assert (place, shown) == (f'  File "{inspect.getsourcefile(plain)}", line {number}, in {name}', f"    {line}")
    assert "cannot be compiled" not in first or caught.value.__cause__ is not None


def test_energy_and_air_have_forms_of_their_own():
    def air(state, p, t):
        return state.v, state.v

    with pytest.raises(ValueError, match=r"Own.function returns \(a tuple of 3 .*; allowed is \(vx, vy, vz\)"):
        world_with(made(air, is_air=True), physics.Drag())
    energy = physics.field_function(gives_a_force_alone)
    with pytest.raises(ValueError, match=r"Own.energy returns a tuple of 3 numbers; allowed is one number: potential"):
        world_with(made(push, energy=energy))


def push(state, p, t):
    return (p[0], 0, 0), (0, 0, 0)


# --- classes and their numbers ---------------------------------------------------------------------------------------


class OwnInit(physics.Field):
    """No dataclass: its number is nowhere to be found."""

    function: ClassVar = physics.field_function(push)

    def __init__(self, strength):
        object.__setattr__(self, "strength", strength)


class Undecorated(physics.Field):
    """The decorator is forgotten."""

    function: ClassVar = physics.field_function(push)
    strength: float = 2.0


class WithColumns(OwnInit):
    """No dataclass, but it says what its numbers are."""

    def columns(self, body, worlds):
        return np.array([self.strength])


@dataclass(frozen=True)
class Pushing(physics.Field):
    """As it should be."""

    strength: float = 2.0
    function: ClassVar = physics.field_function(push)


class Heir(Pushing):
    """Adds nothing to a dataclass."""


@pytest.mark.parametrize(("kind", "values", "why"), [
    (OwnInit, (1.0,), "has an __init__ of its own"), (Undecorated, (), "has the fields strength"),
    (Undecorated, (1.0,), "has the fields strength"),
])  # fmt: skip
def test_a_class_whose_numbers_cannot_be_found_is_refused_when_it_is_made(kind, values, why):
    with pytest.raises(ValueError, match=f"^{kind.__name__} {why}.*allowed is a class under @dataclass"):
        kind(*values)


def test_a_class_with_columns_or_an_heir_of_a_dataclass_is_one():
    for field in (WithColumns(2.0), Heir(), Pushing(2.0)):
        world = world_with(field, dt=1.0)
        world.step()
        assert world.linvel[0, 0].tolist() == [2.0, 0.0, 0.0]
    assert copy.copy(Pushing(3.0)) == pickle.loads(pickle.dumps(Pushing(3.0))) == Pushing(3.0)
    assert list(inspect.signature(Pushing).parameters) == ["strength"]


@pytest.mark.parametrize("value", ["strong", math.nan, math.inf, None, [[1.0], [2.0, 3.0]], 1j, object])
def test_a_parameter_that_is_no_finite_number_is_named(value):
    with pytest.raises(ValueError, match=r"^Pushing.strength is .*; allowed are finite numbers") as caught:
        world_with(Pushing(value))
    assert repr(value) in str(caught.value)


@pytest.mark.parametrize("given", [np.zeros((2, 3, 1)), np.zeros((2, 1)), "abc", 1.0, [math.nan]])
def test_columns_of_the_wrong_kind_are_named(given):
    with pytest.raises(ValueError, match=r"^Own.columns (gives|is) .*; allowed (is|are) "):
        world_with(made(push, columns=lambda self, body, worlds: given))


def test_another_number_of_columns_later_changes_nothing():
    world = world_with(Pushing((1.0, 2.0)))
    before = world.params.copy()
    with pytest.raises(ValueError, match=r"Pushing.columns gives 1 numbers; allowed are 2, as in the scene"):
        world.set_parameters(effects=[Pushing(3.0)])
    assert (world.params == before).all()


# --- while it runs ---------------------------------------------------------------------------------------------------


@physics.field_function
def chosen(p, k):
    return p[k]


@physics.field_function
def far_reaching(state, p, t):
    k = int(p[1])
    if state.v[1] > 20.0:
        k += 100
    return (chosen(p, k), p[-1], state.x[k]), NO_TORQUE


@physics.field_function
def far_reaching_energy(state, p, t):
    return p[int(p[0]) + int(p[1])]


@dataclass(frozen=True)
class Reaching(physics.Field):
    """Reads the element that it is told to."""

    strength: float = 1.0
    index: float = 0.0
    last: float = 7.0
    function: ClassVar = far_reaching
    energy: ClassVar = far_reaching_energy


@pytest.mark.parametrize("threads", [1, 2])
def test_a_computed_index_counts_from_the_end_or_is_an_error_and_nothing_has_moved(threads):
    world = world_with(Reaching(), dt=1.0, worlds=3, threads=threads)
    for index, force in ((0, 1.0), (-1, 7.0), (-3, 1.0), (2, 7.0)):
        world.set_state(pos=np.zeros((3, 1, 3)), linvel=np.zeros((3, 1, 3)))
        world.set_parameters(effects=[Reaching(1.0, index)])
        world.step()
        assert world.linvel[:, 0].tolist() == [[force, 7.0, 0.0]] * 3
    recorder = physics.Recorder(world)
    velocity = np.zeros((3, 1, 3))
    velocity[1, 0, 1] = 50.0  # the second world alone asks for too much: the first has been advanced by then
    world.set_state(linvel=velocity)
    before, time = [array.copy() for array in world.kept()], world.time
    for step in (world.step, physics.Stepper(world)):
        with pytest.raises(IndexError, match=r"^index is out of bounds in a function of Reaching") as caught:
            step()
        assert f'File "{inspect.getsourcefile(made)}", line ' in str(caught.value)
        assert str(caught.value).endswith("in chosen\n    return p[k]")
        assert isinstance(caught.value.__cause__, IndexError)
        assert all((now == then).all() for now, then in zip(world.kept(), before, strict=True))
        assert world.time == time
    for index in (3, -4, 1e15, -1e300):
        world.set_parameters(effects=[Reaching(1.0, index)])
        with pytest.raises(IndexError, match="Reaching"):
            world.step()
    world.set_state(pos=np.zeros((3, 1, 3)), linvel=np.zeros((3, 1, 3)))
    world.set_parameters(effects=[Reaching(1.0, 0)])
    world.step()
    assert world.linvel[:, 0].tolist() == [[1.0, 7.0, 0.0]] * 3
    assert recorder.recording(1).replay().is_identical
    world.set_parameters(effects=[Reaching(3.0, 0)])
    with pytest.raises(IndexError, match=r"Reaching.*\n.*in far_reaching_energy"):
        physics.diagnose(world)


def test_only_a_function_that_may_raise_costs_copies():
    def by_length(state, p, t):
        return (p[3] if len(p) > 3 else 0.0, 0.0, 0.0), NO_TORQUE

    def sums(state, p, t):
        s = 0.0
        for a in state.x:
            s += math.sqrt(abs(a)) * p[-1]
        x, y, z = state.v
        return (s + x, y, z), NO_TORQUE

    def stops(state, p, t):
        if t > 1e9:
            raise ValueError("it is late")
        return state.x, NO_TORQUE

    assert not world_with(made(push)).plan.may_raise
    assert not world_with(made(sums)).plan.may_raise
    assert world_with(made(by_length)).plan.may_raise
    assert world_with(made(stops)).plan.may_raise
    assert world_with(Reaching()).plan.may_raise
    assert not world_with(physics.Drag(), physics.Buoyancy(), physics.Wind(gust=1.0)).plan.may_raise


FACTOR = 2.0


@physics.field_function
def scaled(x):
    return FACTOR * x


@physics.field_function
def scaled_push(state, p, t):
    return (scaled(p[0]), 0.0, 0.0), NO_TORQUE


@dataclass(frozen=True)
class Scaled(physics.Field):
    """Reads a number by way of another function."""

    strength: float = 1.0
    function: ClassVar = scaled_push


def test_an_edit_within_a_process_takes_effect(monkeypatch):
    """And the machine code of before is not kept on disk as that of after."""
    for factor in (2.0, 3.0, 2.0):
        monkeypatch.setitem(globals(), "FACTOR", factor)
        world = world_with(Scaled(), dt=1.0)
        world.step()
        assert world.linvel[0, 0, 0] == factor
