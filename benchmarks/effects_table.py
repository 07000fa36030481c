"""Write the table of effects, schemes and shapes: ``python -m benchmarks.effects_table [PAGE.md]``.

Each effect is declared in a small scene of each kind, for each shape. The plan of the scene tells whether the effect
acts; where a scheme or a scene refuses it, the message is the reason of an empty field. Nothing is compiled or stepped.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

import physics
from benchmarks import machine
from physics.plan.plan import make_plan

PAGE = Path(__file__).parents[1] / "docs" / "effects-table.md"

HEAD = "<!-- written by python -m benchmarks.effects_table -->"
INTRO = """# Effects, schemes and shapes

Which [effects](effects.md) act where. `python -m benchmarks.effects_table` writes this page: it declares each effect in
small scenes and asks their plans. Each scene has a body of the shape of the column:

| letter | scene |
| --- | --- |
{letters}

A field says where the effect acts: **all** of these scenes, or those of its letters. A number in brackets is the reason
why it does not act in the others, from the list below each table."""


@dataclass(frozen=True)
class Row:
    """Row of the table: an effect as a user declares it.

    Attributes
    ----------
    name : str
        Text of the first column.
    effects : tuple
        Effects of the scene besides gravity, contact and friction; they take the place of those of the same class.
    acts : str
        Name of its row in `Plan.rows`, which tells whether it is on.
    """

    name: str
    effects: tuple
    acts: str


GRAVITY, CONTACT, FRICTION = physics.Gravity(), physics.Contact(), physics.Friction(0.5)

ROWS = (
    Row("`Gravity`", (), "gravity"),
    Row("`Contact`", (), "contact"),
    Row("`Contact(restitution=...)`", (physics.Contact(0.5),), "restitution"),
    Row("`Contact(tangential=...)`", (physics.Contact(0.5, tangential=0.5),), "tangential restitution"),
    Row("`Contact(stiffness=..., damping=...)`", (physics.Contact(stiffness=1e5, damping=10.0),), "compliance"),
    Row("`Friction`", (), "friction"),
    Row("`Friction((μ1, μ2), axis)`", (physics.Friction((0.2, 0.5), axis=(1, 0, 0)),), "friction"),
    Row("`RollingFriction`", (physics.RollingFriction(0.01),), "rolling friction"),
    Row("`SpinFriction`", (physics.SpinFriction(0.01),), "spin friction"),
    Row("`Drag`", (physics.Drag(),), "drag"),
    Row("`AngularDrag`", (physics.AngularDrag(),), "angular drag"),
    Row("`Magnus`", (physics.Magnus(),), "magnus"),
    Row("`Wind`", (physics.Drag(), physics.Wind()), "wind"),
    Row("`Buoyancy`", (physics.Buoyancy(),), "buoyancy"),
    Row("`Spring`", (physics.Spring(anchor=(0, 3, 0)),), "spring"),
    Row("`Push`", (physics.Push(force=(1, 0, 0)),), "push"),
    Row("`Actuator`", (physics.Actuator(lag=0.1),), "actuator"),
    Row("`Sleeping`", (physics.Sleeping(),), "sleeping"),
)

BALLS = [physics.Sphere(0.5, 1.0, pos=(x, 0, 0)) for x in (-0.4, 0.4)]
CORNERS = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]

# A shape is a name and a function that makes a body half a metre above `pos`, with the given arguments.
SHAPES: dict[str, Callable[..., physics.Body]] = {
    "block": lambda **given: physics.Block((1, 1, 1), 2.0, **given),
    "sphere": lambda **given: physics.Sphere(0.5, 2.0, **given),
    "ellipsoid": lambda **given: physics.Ellipsoid((0.6, 0.5, 0.4), 2.0, **given),
    "hull": lambda **given: physics.Hull(CORNERS, 2.0, **given),
    "capsule": lambda **given: physics.Capsule(0.5, 1.0, 2.0, quat=(0.6, 0, 0, 0.8), **given),
    "cylinder": lambda **given: physics.Cylinder(0.5, 1.0, 2.0, **given),
    "compound": lambda **given: physics.Compound(BALLS, **given),
}

FLOOR = physics.HalfSpace((0, 1, 0))
TABLE = physics.Block((8, 1, 8), fixed=True, pos=(0, -0.5, 0))
TIE = physics.Spring(other=1)


@dataclass(frozen=True)
class Kind:
    """Kind of scene: its letter, its description, and functions of a shape that make bodies, walls and more effects."""

    letter: str
    about: str
    bodies: Callable[[Callable[..., physics.Body]], list[physics.Body]]
    walls: tuple = ()
    effects: tuple = ()


def _two(make: Callable[..., physics.Body]) -> list[physics.Body]:
    return [make(pos=(0, 0.5, 0)), make(pos=(4, 0.5, 0))]


KINDS = (
    Kind("W", "the body at a wall", lambda make: [make(pos=(0, 0.5, 0))], (FLOOR,)),
    Kind("S", "two at a wall, tied by a spring", _two, (FLOOR,), (TIE,)),
    Kind("F", "the body on a fixed block", lambda make: [make(pos=(0, 0.5, 0)), TABLE]),
    Kind("B", "two that may touch each other", _two),
)

PRESETS = {
    "balanced": "Time stepping: `fast`, `balanced`, and every `scheme` but `events`",
    "precise": "Event-driven: `precise`, `reference`",
}

_PLACE = re.compile(r"Scene\.bodies\[\d+\] is an? \w+")


def reason(row: Row, kind: Kind, make: Callable[..., physics.Body], preset: str) -> str:
    """Reason why an effect does not act in a scene of this kind, for a shape at a preset; "" if it acts."""
    replaced = {type(effect) for effect in row.effects}
    usual = [effect for effect in (GRAVITY, CONTACT, FRICTION) if type(effect) not in replaced]
    try:
        scene = physics.Scene(kind.bodies(make), kind.walls, [*usual, *row.effects, *kind.effects])
        rows = make_plan(scene, preset).rows
    except ValueError as error:
        return _PLACE.sub("a body has this shape", str(error))
    found = [each for each in rows if each.effect.endswith(row.acts)]
    return "" if any(each.is_on for each in found) else found[0].reason


def _cell(row: Row, make: Callable[..., physics.Body], preset: str, reasons: list[str]) -> str:
    """Field of the table; reasons that are new are appended to `reasons`."""
    whys = {kind.letter: reason(row, kind, make, preset) for kind in KINDS}
    acting = "".join(letter for letter, why in whys.items() if not why)
    if len(acting) == len(KINDS):
        return "all"
    reasons += [why for why in dict.fromkeys(whys.values()) if why and why not in reasons]
    numbers = sorted({reasons.index(why) + 1 for why in whys.values() if why})
    return f"{acting} ({', '.join(map(str, numbers))})".strip()


def part(preset: str) -> str:
    """Return the table of a preset with its reasons, as Markdown."""
    reasons: list[str] = []
    rows = [(row.name, *(_cell(row, make, preset, reasons) for make in SHAPES.values())) for row in ROWS]
    table = machine.markdown_table(("effect", *SHAPES), rows)
    listed = "\n".join(f"{k}. {why}." for k, why in enumerate(reasons, 1))
    return "\n\n".join(text for text in (f"## {PRESETS[preset]}", table, listed) if text)


def page() -> str:
    """Return the whole page as Markdown."""
    letters = "\n".join(f"| {kind.letter} | {kind.about} |" for kind in KINDS)
    return "\n\n".join([HEAD, INTRO.format(letters=letters), *map(part, PRESETS)]) + "\n"


def main(path: Annotated[Path, typer.Argument(help="File that is written.")] = PAGE) -> None:
    """Write the table of effects, schemes and shapes."""
    path.write_text(page(), encoding="utf-8")
    typer.echo(f"written to {path}")


if __name__ == "__main__":
    typer.run(main)
