"""Base class of force fields, and the compilation of a user's own fields.

A field is a frozen dataclass with a compiled function, which computes force and torque on a body from its state, the
field's parameters and the time. The built-in fields are in `physics.scene.force_fields`. This is a whole field of a
user's own::

    @physics.field_function
    def pull(state, p, t):
        return (-p[0] * state.x[0], 0.0, 0.0), (0.0, 0.0, 0.0)

    @dataclass(frozen=True)
    class Trough(physics.Field):
        stiffness: float = 1.0  # [N/m]
        function: ClassVar = pull
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from physics.annotations import Effect
from physics.compiler.decorators import is_kernel, plain_function, user_kernel
from physics.html_table import fields_table
from physics.kernels.forces.force_field_dispatch import AIR, LOAD, Term
from physics.scene import field_check
from physics.scene.field_digest import as_it_is, digest

if TYPE_CHECKING:
    from typing_extensions import Self

field_function = user_kernel


class OfShapes(NamedTuple):
    """Functions of a built-in field in scenes with bodies whose half axes do not tell their shape.

    They read the shapes behind the numbers of `Field.columns` (`physics.kernels.forces.body_shapes`).
    """

    function: Any
    rates: Any
    soften: Any
    energy: Any = None


@dataclass(frozen=True)
class Field(Effect):
    """A force field: force and torque on every body from its state and the time. Subclass it to make one.

    A subclass is a frozen dataclass, or overrides `columns`. A subclass with fields that does neither raises a
    ValueError when an object of it is made. Its functions are checked when a `World` is made: see
    `physics.scene.field_check`.

    Attributes
    ----------
    function : compiled function, of the class
        ``(state, p, t) -> (force, torque)`` with a `physics.kernels.forces.force_field_state.FieldState`, the numbers
        of `columns` and the time [s]; force [N] and torque about the centre of mass [N m] are tuples of three, world
        frame. It is made by `physics.field_function`, and may call other functions made so.
    energy : compiled function or None, of the class
        ``(state, p, t) -> potential energy`` [J], which `physics.diagnose` reports. None: the field has no potential.
    has_many : bool, of the class
        Whether a scene may hold several fields of this class.
    is_air : bool, of the class
        Whether `function` gives the velocity of the air (a tuple of three) instead of a load.
    is_linked : bool, of the class
        Whether `function` depends on another body, too. Only the built-in `Spring` between two bodies supports it.
    needs_axes : bool, of the class
        Whether `function` reads the shape and the half axes in the state. A hull, capsule, cylinder or compound has no
        half axes, so that a scene with one refuses such a field.
    """

    function: ClassVar[Any] = None
    energy: ClassVar[Any] = None
    has_many: ClassVar[bool] = False
    is_air: ClassVar[bool] = False
    is_linked: ClassVar[bool] = False
    needs_axes: ClassVar[bool] = False
    _rates: ClassVar[Any] = None  # of the built-in ones: see `physics.kernels.forces.implicit_loads`
    _soften: ClassVar[Any] = None
    _mean: ClassVar[Any] = None
    _of_shapes: ClassVar[OfShapes | None] = None

    _repr_html_ = fields_table

    def __new__(cls, *values: Any, **named: Any) -> Self:
        field_check.check_class(cls, Field)
        return super().__new__(cls)

    @property
    def knows_shapes(self) -> bool:
        """True if other functions of this built-in field serve bodies whose half axes do not tell their shape."""
        return _has_functions_of_shapes(self.kind)

    @property
    def kind(self) -> type[Field]:
        """Class whose functions are compiled for this field; by default the field's own class."""
        return type(self)

    def columns(self, body: int, worlds: NDArray[np.int64]) -> NDArray[np.float64]:
        """Numbers that `function` gets as p, for one body of the scene.

        Parameters
        ----------
        body : int
            Index of the body in the scene.
        worlds : (k,) int64
            Indices of the worlds of a batch.

        Returns
        -------
        (n,) or (k, n) float64
            The n numbers for all worlds alike, or a row for each of `worlds`; n is the same for every body. By default
            the values of the dataclass's fields, one after the other.

        Raises
        ------
        ValueError
            A field of the dataclass is neither a finite number nor an array of finite numbers.
        """
        numbers = [field_check.numbers_in(self, field.name) for field in fields(self)]
        return np.concatenate(numbers) if numbers else np.empty(0)

    def check(self, body_count: int) -> None:
        """Raise a ValueError if the field does not fit a scene of `body_count` bodies; by default every scene fits."""

    @property
    def takes_energy(self) -> bool | None:
        """Effect of the field on energy: True if it only removes energy, False if it conserves it, None if unknown.

        The energy is the mechanical energy of the bodies plus the potential energy of the field.
        """
        return None

    @property
    def is_steady(self) -> bool:
        """True if the field's effect on a resting body is constant in time; False by default, as for users' fields.

        No body of a scene sleeps (`Sleeping`) if one of its fields is not steady.
        """
        return False

    @property
    def label(self) -> str:
        """Name of the field in the explanation of a plan: its class in lower-case words, as "angular drag"."""
        name = type(self).__name__
        return "".join(f" {c.lower()}" if c.isupper() and k else c.lower() for k, c in enumerate(name))


class Checked(Field):
    """Base of the built-in fields: steady by default, with a method that checks and sets values when one is made."""

    @property
    def is_steady(self) -> bool:
        return True

    def _set(self, name: str, check: Callable[..., Any], shape: tuple[int, ...] = ()) -> None:
        value = check(getattr(self, name), shape, f"{type(self).__name__}.{name}")
        object.__setattr__(self, name, tuple(value.tolist()) if shape else float(value))


@dataclass(frozen=True)
class FieldSlot:
    """All fields of one kind in a scene: their common term in the kernel, and their columns of numbers.

    Attributes
    ----------
    kind : type
        Class of the fields, `Field.kind`.
    term : Term
        Description of the kind for the compiler: its functions and the count of its numbers.
    first : int
        Index of the first column of these fields in the table of all fields' numbers.
    effects : tuple of Field
        The scene's fields of this kind.
    is_users : bool
        Whether the kind is a user's own, not a built-in one.
    may_raise : bool
        Whether a step may raise an exception in the kind's function.
    shapes : (bodies, n) float64, optional
        Columns of the bodies' shapes behind those of each field; None: the fields read none.
    """

    kind: type[Field]
    term: Term
    first: int
    effects: tuple[Field, ...]
    is_users: bool = False
    may_raise: bool = False
    shapes: np.ndarray | None = None


def field_slots(effects: Iterable[Any], body_count: int, shapes: np.ndarray | None = None) -> tuple[FieldSlot, ...]:
    """Group the fields among a scene's effects by kind, with one slot for each kind.

    The order of the slots does not depend on the order in which the scene declares its fields. `shapes` are those of
    `physics.scene.field_shapes` if half axes do not tell the shapes of all bodies; else None.

    Raises
    ------
    ValueError
        A field has no compiled function, or its `columns` gives different counts of numbers for different bodies or
        effects; or a user's function fails `physics.scene.field_check.check_function`.
    """
    kinds: dict[type[Field], list[Field]] = {}
    for effect in effects:
        if isinstance(effect, Field):
            kinds.setdefault(effect.kind, []).append(effect)
    slots, first = [], 0
    for kind, found in sorted(kinds.items(), key=lambda item: _name(item[0])):
        size = _column_count(kind, found, body_count)
        if shapes is not None and _has_functions_of_shapes(kind):
            slots.append(FieldSlot(kind, _term_of_shapes(kind, size, shapes), first, tuple(found), shapes=shapes))
            first += slots[-1].term.size
            continue
        marker = f"{AIR if kind.is_air else LOAD}_{_name(kind)}_{len(found)}x{size}"
        functions: list[Any] = [_compiled(kind, name) for name in ("function", "energy")]
        is_users = not _is_built_in(functions[0])
        if is_users:
            functions = [each and as_it_is(each) for each in functions]
        function, energy = functions
        term = Term(marker, function, energy, size, len(found), kind.is_linked, kind._rates, kind._soften, kind._mean)
        may_raise = is_users and _check_functions(kind, term)
        slots.append(FieldSlot(kind, term, first, tuple(found), is_users, may_raise))
        first += size * len(found)
    return tuple(slots)


def _has_functions_of_shapes(kind: type[Field]) -> bool:
    """True for a built-in field with an `OfShapes`; a user's subclass with a function of its own has none."""
    return kind._of_shapes is not None and _is_built_in(_compiled(kind, "function"))


def _term_of_shapes(kind: type[Field], size: int, shapes: np.ndarray) -> Term:
    """Term of the one field of a kind that reads the shapes of bodies, behind its `size` columns."""
    assert kind._of_shapes is not None
    made, size = kind._of_shapes, size + shapes.shape[1]
    name = plain_function(made.function).__name__.replace("_", "")
    return Term(f"{LOAD}_{name}_1x{size}", made.function, made.energy, size, 1, False, made.rates, made.soften)


def _column_count(kind: type[Field], found: list[Field], body_count: int) -> int:
    world = np.arange(1)
    sizes = {field_check.numbers_of(effect, b, world).shape[-1] for effect in found for b in range(body_count)}
    if len(sizes) != 1:
        raise ValueError(f"{kind.__name__}.columns gives {sorted(sizes)} numbers; allowed is one length for all bodies")
    return sizes.pop()


def _check_functions(kind: type[Field], term: Term) -> bool:
    """Check `energy` and `function` of a user's field class; return whether `function` may raise an exception."""
    numbers = field_check.describe(kind, Field, term.size)
    form = field_check.AIR if kind.is_air else field_check.LOAD
    if term.energy is not None:
        field_check.check_function(f"{kind.__name__}.energy", term.energy, field_check.ENERGY, term.size, numbers)
    return field_check.check_function(f"{kind.__name__}.function", term.function, form, term.size, numbers)


def _is_built_in(function: Callable) -> bool:
    return (plain_function(function).__module__ or "").startswith("physics.kernels.")


def _compiled(kind: type[Field], name: str) -> Any:
    function = vars(kind).get(name, getattr(kind, name))
    if is_kernel(function) or (function is None and name == "energy"):
        return function
    raise ValueError(f"{kind.__name__}.{name} is {function!r}; allowed is a function under @physics.field_function")


def _name(kind: type[Field]) -> str:
    """Name that identifies a kind of field: its function's name; in a user's field also a digest of the functions."""
    function = _compiled(kind, "function")
    name = plain_function(function).__name__.replace("_", "")
    if _is_built_in(function):
        return name
    return f"{name}{digest(function, _compiled(kind, 'energy'))}"


def write_columns(slots: Sequence[FieldSlot], params: np.ndarray, body_count: int, worlds: np.ndarray) -> None:
    """Write the numbers of all fields of a scene into the columns of a parameter table.

    Parameters
    ----------
    slots : tuple of FieldSlot
        The fields of the scene.
    params : (k * body_count, n) float64, out
        Columns of the fields only, with a row for each body of each of the k worlds.
    body_count : int
        Bodies of the scene.
    worlds : (k,) int64
        Indices of the worlds that the rows belong to.

    Raises
    ------
    ValueError
        A number is not finite, or a field gives another count of numbers than when the scene was planned.
    """
    for slot in slots:
        size = slot.term.size
        for k, effect in enumerate(slot.effects):
            first = slot.first + k * size
            for body in range(body_count):
                numbers = field_check.numbers_of(effect, body, worlds)
                if slot.shapes is not None:
                    numbers = np.concatenate((numbers, slot.shapes[body]))
                if numbers.shape[-1] != size:
                    name = f"{type(effect).__name__}.columns"
                    raise ValueError(f"{name} gives {numbers.shape[-1]} numbers; allowed are {size}, as in the scene")
                params[body::body_count, first : first + size] = numbers
