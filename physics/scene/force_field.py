"""Base class of force fields, and the compilation of a user's own ones.

A field is a frozen dataclass with a compiled function: force and torque on a body from its state, the field's
parameters and the time. The built-in ones stand in `physics.scene.force_fields`; your own needs nothing beyond these::

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
from typing import TYPE_CHECKING, Any, ClassVar

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


@dataclass(frozen=True)
class Field(Effect):
    """A force field: force and torque on every body from its state and the time. Subclass it to make one.

    A subclass is a frozen dataclass, or gives its numbers by `columns`; one that does neither is a ValueError when an
    object of it is made. Its functions are checked when a `World` is: see `physics.scene.field_check`.

    Attributes
    ----------
    function : compiled function, of the class
        ``(state, p, t) -> (force, torque)`` with a `physics.kernels.forces.force_field_state.FieldState`, the numbers
        of `columns` and the time [s]; force [N] and torque about the centre of mass [N m] are tuples of three, world
        frame. Made by `physics.field_function`; it may call others that are.
    energy : compiled function or None, of the class
        ``(state, p, t) -> potential energy`` [J], of a field that has one: for `physics.diagnose`.
    has_many : bool, of the class
        Whether a scene may hold several.
    is_air : bool, of the class
        Whether `function` gives the velocity of the air (a tuple of three) instead of a load.
    is_linked : bool, of the class
        Whether `function` depends on another body, too; only the built-in `Spring` between bodies knows how.
    needs_axes : bool, of the class
        Whether `function` makes something of the shape and the half axes in the state: a hull has none.
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

    _repr_html_ = fields_table

    def __new__(cls, *values: Any, **named: Any) -> Self:
        field_check.check_class(cls, Field)
        return super().__new__(cls)

    @property
    def kind(self) -> type[Field]:
        """Class whose functions are compiled for the field: its own."""
        return type(self)

    def columns(self, body: int, worlds: NDArray[np.int64]) -> NDArray[np.float64]:
        """Numbers for `function`, for one body of the scene.

        Parameters
        ----------
        body : int
        worlds : (k,) int64

        Returns
        -------
        (n,) or (k, n) float64
            By default the dataclass's own fields, one after the other; the same n for every body and world.

        Raises
        ------
        ValueError
            A field of the dataclass is no finite number, nor an array of them.
        """
        numbers = [field_check.numbers_in(self, field.name) for field in fields(self)]
        return np.concatenate(numbers) if numbers else np.empty(0)

    def check(self, body_count: int) -> None:
        """Raise a ValueError if the field does not fit a scene of so many bodies."""

    @property
    def takes_energy(self) -> bool | None:
        """True if the field only removes mechanical energy, False if it conserves it with its own, else None."""
        return None

    @property
    def is_steady(self) -> bool:
        """True if the field's effect on a resting body is constant in time; unknown for a user's own fields.

        `Sleeping` needs this: under a load that may change on its own nothing sleeps.
        """
        return False

    @property
    def label(self) -> str:
        """Name in a plan: the class in words."""
        name = type(self).__name__
        return "".join(f" {c.lower()}" if c.isupper() and k else c.lower() for k, c in enumerate(name))


class Checked(Field):
    """Built-in field, which sets checked values on a frozen dataclass."""

    @property
    def is_steady(self) -> bool:
        return True

    def _set(self, name: str, check: Callable[..., Any], shape: tuple[int, ...] = ()) -> None:
        value = check(getattr(self, name), shape, f"{type(self).__name__}.{name}")
        object.__setattr__(self, name, tuple(value.tolist()) if shape else float(value))


@dataclass(frozen=True)
class FieldSlot:
    """A kind of field in a scene: its term in the kernel, and the scene's effects of that kind.

    Attributes
    ----------
    kind : type
    term : Term
    first : int
        Its first column among the fields' [1].
    effects : tuple of Field
    is_users : bool
        Whether it is none of the built-in ones.
    may_raise : bool
        Whether a step in which its function is called may end in an exception.
    """

    kind: type[Field]
    term: Term
    first: int
    effects: tuple[Field, ...]
    is_users: bool = False
    may_raise: bool = False


def field_slots(effects: Iterable[Any], body_count: int) -> tuple[FieldSlot, ...]:
    """Fields among a scene's effects, by kind; the order of declaration does not matter.

    Raises
    ------
    ValueError
        A field without a compiled function, or with another number of columns for another body or effect; a user's
        function that does not fit (`physics.scene.field_check.check_function`).
    """
    kinds: dict[type[Field], list[Field]] = {}
    for effect in effects:
        if isinstance(effect, Field):
            kinds.setdefault(effect.kind, []).append(effect)
    slots, first = [], 0
    for kind, found in sorted(kinds.items(), key=lambda item: _name(item[0])):
        size = _column_count(kind, found, body_count)
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


def _column_count(kind: type[Field], found: list[Field], body_count: int) -> int:
    world = np.arange(1)
    sizes = {field_check.numbers_of(effect, b, world).shape[-1] for effect in found for b in range(body_count)}
    if len(sizes) != 1:
        raise ValueError(f"{kind.__name__}.columns gives {sorted(sizes)} numbers; allowed is one length for all bodies")
    return sizes.pop()


def _check_functions(kind: type[Field], term: Term) -> bool:
    """Check a user's functions; return whether the function of a step may raise an exception."""
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
    """Name that identifies this kind of field: its function's, with a digest for a user's own."""
    function = _compiled(kind, "function")
    name = plain_function(function).__name__.replace("_", "")
    if _is_built_in(function):
        return name
    return f"{name}{digest(function, _compiled(kind, 'energy'))}"


def write_columns(slots: Sequence[FieldSlot], params: np.ndarray, body_count: int, worlds: np.ndarray) -> None:
    """Write the parameters of all fields into their columns.

    Parameters
    ----------
    slots : tuple of FieldSlot
    params : (len(worlds) * body_count, n) float64, out
        The columns of fields alone.
    body_count : int
    worlds : (k,) int64
        Which worlds these rows are.

    Raises
    ------
    ValueError
        A parameter that is not finite, or others in number than in the scene.
    """
    for slot in slots:
        size = slot.term.size
        for k, effect in enumerate(slot.effects):
            first = slot.first + k * size
            for body in range(body_count):
                numbers = field_check.numbers_of(effect, body, worlds)
                if numbers.shape[-1] != size:
                    name = f"{type(effect).__name__}.columns"
                    raise ValueError(f"{name} gives {numbers.shape[-1]} numbers; allowed are {size}, as in the scene")
                params[body::body_count, first : first + size] = numbers
