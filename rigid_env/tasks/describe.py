"""Write the documentation of any task as Markdown: sections and tables, made from the task's declaration.

The docstring of `rigid_env.envs.block_reach` is the model: sections with Gymnasium's titles, in Gymnasium's order.
"""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from physics import Body
from physics.scene.body_names import body_label
from physics.summary import counted
from rigid_env.tasks.actions import FORCE, IMPULSE, TORQUE
from rigid_env.tasks.arguments import constructor_arguments
from rigid_env.tasks.block import BlockTask
from rigid_env.tasks.declaration import Declaration
from rigid_env.tasks.goal import GoalTask
from rigid_env.tasks.meanings import (
    ARGUMENTS,
    OF_ENVIRONMENTS,
    OWN_CAMERA,
    argument_meaning,
    draw_meaning,
    explanations_of,
)
from rigid_env.tasks.task import Task
from rigid_env.tasks.written import Part, sentences, written_parts

WIDTH = 79  # largest length of a line of text [characters]

REACH = "the reach of the body (longest half extent, of a hull the farthest along a body axis from the centre of mass)"
"""Length in the unit of torques."""

HALF_EDGE = "the longest half edge of the body"
"""This length where all bodies are blocks."""

ROTATION = "R is the rotation matrix from body to world, by rows."
"""Explanation of entries such as R[0, 0]."""

NO_DRAWS = (
    "There is no argument `draws`: `mass`, `size`, `friction`, `restitution` and `gravity` take a pair (low, high) or "
    "a distribution instead, and `reset(options=...)` fixes any draw of an episode."
)
"""Note about the block's tasks."""


@dataclass(frozen=True)
class Section:
    """A section of a task's documentation: a title, paragraphs and one table.

    Attributes
    ----------
    title : str
    before, after : tuple of str
        Paragraphs before and after the table.
    columns : tuple of str
        Titles of the table's columns; empty if there is no table.
    rows : tuple of tuple of str
        Cells of the table, row by row.
    """

    title: str
    before: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()
    after: tuple[str, ...] = ()

    @property
    def markdown(self) -> str:
        """Section in Markdown: heading, paragraphs and table."""
        parts = [f"## {self.title}", *map(_wrapped, self.before)]
        if self.rows:
            lines = (self.columns, ("---",) * len(self.columns), *self.rows)
            parts.append(
                "\n".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |" for row in lines)
            )
        return "\n\n".join([*parts, *map(_wrapped, self.after)])

    def to_dict(self) -> dict[str, Any]:
        """Section as a dict for JSON, with the keys title, text, columns and rows."""
        return {"title": self.title, "text": [*self.before, *self.after], "columns": self.columns, "rows": self.rows}


def describe(task: Task) -> str:
    """Documentation of a task as Markdown.

    For an environment, `RigidEnv.describe` also documents the environment's arguments.
    """
    return markdown(sections(task))


def markdown(found: Iterable[Section]) -> str:
    """Markdown of several sections, one below the other."""
    return "\n\n".join(section.markdown for section in found) + "\n"


def sections(
    task: Task,
    documented: type | None = None,
    added: Mapping[str, Any] | None = None,
    registered: Mapping[str, Any] | None = None,
) -> tuple[Section, ...]:
    """Sections of a task's documentation, in Gymnasium's order.

    Parameters
    ----------
    task : Task
    documented : type, optional
        Class whose docstring describes the task; None: the task's class. If this docstring has sections with
        Gymnasium's titles, their paragraphs replace generated ones, and their meanings of arguments are used.
    added : mapping, optional
        Arguments that an environment adds to those of the task, with their defaults.
    registered : mapping, optional
        Defaults that the environment is registered with in Gymnasium; they replace those of the class.
    """
    found = (
        _description(task, documented or type(task)),
        _actions(task),
        _observation(task),
        _rewards(task),
        _starts(task),
        *_disturbances(task),
        _end(task),
        _arguments(task, added or {}, registered or {}),
    )
    parts = written_parts(documented or type(task))
    known = {section.title for section in found}
    own = (Section(title, part.text) for title, part in parts.items() if title not in known)
    merged = (_merged(section, parts[section.title]) if section.title in parts else section for section in found)
    return tuple(_named(section, task.world.names) for section in (*merged, *own))


# --- sections ---------------------------------------------------------------------------------------------------------


def _description(task: Task, documented: type) -> Section:
    scene, doc = task.world.scene, inspect.cleandoc(documented.__doc__ or "")
    bodies = "; ".join(f"{_kind(i, body)}{_mass(task, i, body)}" for i, body in enumerate(scene.bodies))
    effects = counted(type(effect).__name__ for effect in scene.effects)
    text = f"Bodies: {bodies}. Walls: {len(scene.walls)}. Effects: {effects}."
    return Section("Description", tuple(_paragraphs(doc)), after=(text,))


def _actions(task: Task) -> Section:
    agents = {place: agent for agent, places in task.agents.items() for place in places.tolist()}
    has_agents, has_bodies = len(task.agents) > 1, task.world.body_count > 1
    rows: list[tuple[str, ...]] = []
    for vector in task.action_vectors:
        where = f" of body {vector.body}" if has_bodies else ""
        if vector.point is not None:
            where += f" at ({', '.join(f'{x:g}' for x in vector.point)}) m"
        for name in vector.names:
            agent = (agents[len(rows)],) if has_agents else ()
            rows.append((str(len(rows)), name + where, "-1", "1", vector.unit, *agent))
    kinds = {vector.kind for vector in task.action_vectors}
    has_loads = bool(kinds & {FORCE, TORQUE, IMPULSE})
    notes = ["m is the mass of the body, g gravity (9.81 m/s² where there is none)"] if has_loads else []
    if TORQUE in kinds:
        has_blocks_only = all(body.kind == "block" for body in task.world.scene.bodies)
        notes += [f"a is {HALF_EDGE if has_blocks_only else REACH}"]
    notes += ["Each number is clipped to ±1, then a vector is shortened to length 1 where it is longer"]
    text = f"{'. '.join(notes)}."
    text += " An impulse acts in the first physics step." if IMPULSE in kinds else ""
    before = f"`Box(-1, 1, ({task.action_size},), float32)`, held for one control step ({1e3 * task.control_dt:g} ms)."
    columns = ("Num", "Action", "Min", "Max", "Unit", *(("Agent",) if has_agents else ()))
    return Section("Action Space", (before,), columns, tuple(rows), (text,))


def _observation(task: Task) -> Section:
    parts = {"": task.observed}
    if isinstance(task, GoalTask):
        parts = {"observation": task.observed, "goal": task.goals}
    views = task.observed.views
    rows = tuple(
        (
            str(k),
            f"{part}: {name}" if part else name,
            f"{entry.low:.12g}",
            f"{entry.high:.12g}",
            entry.told_unit,
            *((", ".join(agent for agent, view in views.items() if k in view),) if views else ()),
        )
        for part, entries in parts.items()
        for k, (name, entry) in enumerate((name, entry) for entry in entries.entries for name in entry.names)
    )
    text = f"`Box` of {task.observed.size} float32."
    if isinstance(task, GoalTask):
        text = (
            f"`Dict` of `observation`, {task.observed.size} float32, and `achieved_goal` and `desired_goal`, "
            f"{task.goals.size} float32 each."
        )
    text += " Each number is told in its unit and clipped to its bounds."
    text += f" {ROTATION}" if any("R[" in row[1] for row in rows) else ""
    columns = ("Num", "Observation", "Min", "Max", "Unit", *(("Agents",) if views else ()))
    return Section("Observation Space", (text,), columns, rows)


def _rewards(task: Task) -> Section:
    text = "The sum of the terms." if task.terms else "Always 0: the task has no terms."
    rows = tuple((term, f"`reward_{term}`") for term in task.terms)
    return Section("Rewards", (*_own_text(task, "rewards"), text), ("Term", "In `info`"), rows)


def _starts(task: Task) -> Section:
    meanings = explanations_of(task)
    rows = tuple(
        (f"`{name}`", each.describe(), str(each.length), meanings.get(name, draw_meaning(name)))
        for name, each in task.distributions.items()
        if name in task.own_draws
    )
    text = "The same in every episode."
    if rows:
        text = (
            "Each episode draws the values of the table. `reset(options=...)` fixes what it names, for this episode; "
            "the other draws of a seed stay the same. Every `info` tells all of them."
        )
    return Section("Starting State", (*_own_text(task, "place"), text), ("Option", "Drawn", "Numbers", "Meaning"), rows)


def _disturbances(task: Task) -> tuple[Section, ...]:
    rows = []
    for kind in task.disturbances:
        if hasattr(kind, "speed"):
            size = f"speed {kind.speed.describe()} m/s"
        else:
            size = f"force {kind.force.describe()} m g, lasts {kind.lasts.describe()} s"
        rows.append(
            (type(kind).__name__, body_label(kind.body, task.world.names), size, kind.axes, f"{kind.every:g} s")
        )
    text = "They begin and end with control steps: in each quiet one with the same probability, and past any actuator."
    columns = ("Kind", "Body", "Size", "Axes", "Mean wait")
    return (Section("Disturbances", (text,), columns, tuple(rows)),) if rows else ()


def _end(task: Task) -> Section:
    ends = [name for name in ("success", "failure") if getattr(type(task), name) is not getattr(Declaration, name)]
    told = [name for name in ends if name != "success" or task.ends_on_success]
    text = f"Termination: {' and '.join(f'on {name}' for name in told) or 'never'}."
    if task.compiled is not None:
        text = "Termination: on success and on failure, as the compiled function decides."
    elif told != ends:
        text += " Success does not end an episode."
    own = (paragraph for name in ends for paragraph in _own_text(task, name))
    steps = task.max_episode_steps
    limit = (
        "none" if steps is None else f"after {steps} control steps ({steps * task.control_dt:g} s), by `gymnasium.make`"
    )
    meanings = explanations_of(task)
    keys = [("is_success", "whether the task is solved")]
    keys += [(name, meanings.get(name, "measured by the task")) for name in task.measures]
    keys += [(key, meanings.get(key, "term of the reward")) for key in (f"reward_{term}" for term in task.terms)]
    keys += [("physics_status", "a `physics.Status`: 0 when nothing went wrong")]
    rows = tuple((f"`{key}`", meaning) for key, meaning in keys)
    return Section("Episode End", (" ".join([text, *own]), f"Truncation: {limit}."), ("In `info`", "Meaning"), rows)


def _arguments(task: Task, added: Mapping[str, Any], registered: Mapping[str, Any]) -> Section:
    kind = type(task)
    known = {name: each.default for name, each in constructor_arguments(kind).items()}
    meanings = {**{name: argument_meaning(kind, name) for name in known}, **ARGUMENTS, **OF_ENVIRONMENTS}
    if task.camera is not None:
        meanings["camera"] = OWN_CAMERA
    defaults = {**known, **added}
    rows = tuple((f"`{name}`", _default(registered.get(name, defaults[name])), meanings[name]) for name in defaults)
    notes = (NO_DRAWS,) if isinstance(task, BlockTask) else ()
    return Section("Arguments", (), ("Argument", "Default", "Meaning"), rows, notes)


# --- sections that a docstring contains -------------------------------------------------------------------------------


def _merged(section: Section, part: Part) -> Section:
    """Generated section with the paragraphs that a docstring has in `part`; generated tables and time limits stay."""
    title = section.title
    if title == "Description":
        return replace(section, before=(*section.before, *part.text))
    if title in ("Action Space", "Observation Space"):
        told = " ".join(section.before)
        words = sentences(part.text, lambda text: "float32" not in text and text[-1] != ":" and text not in told)
        return replace(section, after=words)
    if title == "Episode End":
        words = sentences(part.text, lambda text: not text.startswith("Truncation"))
        return replace(section, before=(*words, *section.before[1:]))
    if title == "Arguments":
        meanings = {row[0]: row[-1] for row in part.rows}
        meanings.setdefault("`threads`", ARGUMENTS["threads"])  # an argument of batches alone
        rows = tuple((*row[:-1], meanings[row[0]]) for row in section.rows if row[0] in meanings)
        rows = rows if part.rows else section.rows
        return replace(section, rows=rows, before=part.before, after=(*part.after, *section.after))
    return replace(section, before=part.text)


# --- parts of sections ------------------------------------------------------------------------------------------------


def _mass(task: Task, index: int, body: Body) -> str:
    """Mass of a body in the list of bodies; "mass drawn" if episodes draw it from a range."""
    if body.motion is not None:
        return ", which moves as prescribed"
    draws = (task.distributions.get(name) for name in ("mass", f"mass[{index}]", f"mass[{body.name}]"))
    if any(each is not None and not each.is_fixed for each in draws):
        return ", mass drawn"
    return ", fixed" if body.fixed else f" of {body.mass:g} kg"


def _kind(index: int, body: Body) -> str:
    """Label of a body in the list of bodies: its index, its name if it has one, and its class."""
    kind = type(body).__name__
    return f"{index} {kind}" if body.name is None else f"{index} {body.name} ({kind})"


def _named(section: Section, names: tuple[str, ...]) -> Section:
    """Section whose table has the names of bodies after their indices, such as "body 1 (ball)"."""

    def label(found: re.Match) -> str:
        return f"body {body_label(int(found[1]), names)}"

    rows = tuple(tuple(re.sub(r"\bbody (\d+)", label, cell) for cell in row) for row in section.rows)
    return replace(section, rows=rows)


def _default(value: Any) -> str:
    if value is inspect.Parameter.empty:
        return "required"
    return f'`"{value}"`' if isinstance(value, str) else repr(value)


def _own_text(task: Task, name: str) -> tuple[str, ...]:
    """First paragraph of the docstring of the task's own function `name`, in a tuple; empty if there is none."""
    function = getattr(type(task), name)
    doc = function.__doc__ if function is not getattr(Declaration, name) else None
    return tuple(_paragraphs(inspect.cleandoc(doc))[:1]) if doc else ()


def _paragraphs(doc: str) -> list[str]:
    """Paragraphs of a docstring before its first heading, each as one line."""
    head = re.split(r"^(?:## .*|\w+\n-+)$", doc, maxsplit=1, flags=re.MULTILINE)[0]
    return [" ".join(part.split()) for part in head.split("\n\n") if part.strip()]


def _wrapped(text: str) -> str:
    return textwrap.fill(text, WIDTH, break_long_words=False, break_on_hyphens=False)
