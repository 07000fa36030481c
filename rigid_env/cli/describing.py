"""Command `describe`, which documents a task."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rigid_env.cli import names
from rigid_env.cli.common import Json, app, tell_file, told_errors, write
from rigid_env.cli.files import make_parents, output_option
from rigid_env.terminal import Column, Table, make_console

if TYPE_CHECKING:
    from rigid_env.envs.env import RigidEnv
    from rigid_env.tasks.describe import Section

NUMBERS = ("Num", "Min", "Max", "Numbers")  # columns that hold numbers


@app.command(short_help="Document a task: spaces, rewards, draws, episode end, arguments.")
def describe(
    task: Annotated[
        str,
        typer.Argument(
            metavar="TASK",
            help="Id of an environment, module:id, module:Class of a task, or a scene: that of rigid_env/Scene-v0.",
            autocompletion=names.complete_scene,
        ),
    ],
    markdown: Annotated[Path | None, output_option("--markdown", ".md", help="Write it as Markdown, too.")] = None,
    json: Json = None,
) -> None:
    """Document a task by the tables of an environment's docstring.

    Modules of the working folder are found, after those that are installed.
    """
    with told_errors():
        make_parents(markdown, json)
        console = make_console()
        env = _make(task)
        sections = env.documentation()
        for section in sections:
            console.print(_shown(section.title), style="bold")
            for paragraph in section.before:
                console.print(_shown(paragraph))
            if section.rows:
                console.print(_table(section))
            for paragraph in section.after:
                console.print(_shown(paragraph))
            console.print()
        if markdown is not None:
            markdown.write_text(env.describe(), encoding="utf-8")
            tell_file(markdown, console)
        write(json, {"task": task, "sections": [section.to_dict() for section in sections]}, console)


def _make(task: str) -> RigidEnv:
    """Make the environment of an id, of a task's class, or of a scene.

    Without a scene `rigid_env/Scene-v0` has one body and a goal, as in its docstring.

    Raises
    ------
    ValueError
        There is no such environment, or it is not of this package.
    """
    from physics import scenes
    from rigid_env.envs.named import make_named
    from rigid_env.envs.registration import SCENE_ID
    from rigid_env.envs.scene import SceneEnv

    if task in scenes.SCENES or Path(task).suffix.lower() in names.SCENE_FILES:
        return SceneEnv(task)
    if task.split(":")[-1] == SCENE_ID:
        return SceneEnv("rest", goal={"pos": (3.0, 1.5, 0.0), "tolerance": 0.5})
    return make_named(task, "task", scenes.SCENES).unwrapped


def _table(section: Section) -> Table:
    """Table of a section of the documentation; columns with numbers are never broken."""
    table = Table([Column(name, is_number=name in NUMBERS) for name in map(_shown, section.columns)])
    for row in section.rows:
        table.add_row(*map(_shown, row))
    return table


def _shown(text: str) -> str:
    """Text without the backticks of Markdown."""
    return text.replace("`", "")
