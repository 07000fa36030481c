"""Read models that others wrote: ``python -m benchmarks.mjcf_files FOLDER [--json FILE]``.

Every file in MJCF or URDF below a folder is compiled by MuJoCo. Of those whose joints are all free, `physics.load_mjcf`
reads some and refuses the others. A scene that is read is held against MuJoCo's own masses, inertia, poses, friction in
touch and first acceleration (`tests.reference.mujoco_model`).
"""

from __future__ import annotations

import re
import warnings
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import typer

import physics
from benchmarks import machine
from physics.optional import load_optional
from rigid_env.lab.measure.machine import write_json
from rigid_env.lab.measure.mujoco_scene import elsewhere
from rigid_env.terminal import Table, make_console, number_columns, run_program

ENDINGS = (".xml", ".urdf")
SAME = 1e-6  # largest relative difference that counts as none: meshes are in single precision

# Kinds of files.
NO_MODEL, FIXED, MIXED, READ, REFUSED = "no model", "no free body", "other joints, too", "read", "refused"


@dataclass(frozen=True)
class Row:
    """One file: its kind, and why it is refused, or by how much the scene differs from MuJoCo's."""

    file: str
    kind: str
    reason: str = ""
    difference: float | None = None


def examine(folder: Path) -> list[Row]:
    """One row for each file below the folder."""
    files = sorted(path for path in folder.resolve().rglob("*") if path.suffix.lower() in ENDINGS)
    name = {path: path.relative_to(folder.resolve()).as_posix() for path in files}
    with elsewhere(), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of MuJoCo, about attributes that it will remove
        return [Row(name[path], *_examine(path)) for path in files]


def _examine(path: Path) -> tuple:
    """Kind, reason and difference of a file."""
    mujoco = load_optional("mujoco", "the comparison")
    from tests.reference import mujoco_model

    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except (ValueError, mujoco.FatalError):
        return (NO_MODEL,)
    free = int(mujoco.mjtJoint.mjJNT_FREE)
    if free not in model.jnt_type:
        return (FIXED,)
    if any(model.jnt_type != free):
        return (MIXED,)
    try:
        scene = physics.load_mjcf(path)
    except ValueError as error:
        return REFUSED, str(error).removeprefix(str(path)).lstrip(", :")
    return READ, "", max(mujoco_model.differences(model, scene).values())


def alike(reason: str) -> str:
    """A reason without lines, names and numbers."""
    told = re.sub(r"^line \d+: ", "", reason).split("; ")[0]
    told = re.sub(r" '[^']*'>", ">", told)
    told = re.sub(r"(?<=>) of <body>", "", told)
    told = re.sub(r"of (\d+) corners", "of more corners than are allowed", told)
    return re.sub(
        r" \d[\d. e+-]*(?= geoms)", " several", re.sub(r"(armature|frictionloss|gap|density) [\d.e-]+", r"\1", told)
    )


def main(
    folder: Annotated[Path, typer.Argument(help="With models, also in folders below.", exists=True, file_okay=False)],
    json: Annotated[Path | None, typer.Option(help="Where to write the result.")] = None,
) -> None:
    """Count which files are read, and why others are not."""
    console = make_console()
    console.print(machine.headline())
    rows = examine(folder)
    alone = [row for row in rows if row.kind in (READ, REFUSED)]
    for row in alone:
        told = row.reason if row.kind == REFUSED else f"read, differs by {row.difference:.1e}"
        console.print(f"{row.file}: {told}", soft_wrap=True)
    kinds = Counter(row.kind for row in rows)
    reasons = Counter(alike(row.reason) for row in rows if row.kind == REFUSED)
    different = [row.file for row in rows if row.kind == READ and not row.difference <= SAME]
    table = Table([*number_columns("files"), "why it is refused"])
    for reason, count in reasons.most_common():
        table.add_row(str(count), reason)
    console.print(table)
    console.print(f"{len(rows)} files: {', '.join(f'{kind}: {count}' for kind, count in kinds.most_common())}")
    console.print(
        f"of {len(alone)} with free bodies alone {kinds[READ]} are read, {len(different)} of them silently another"
    )
    if json:
        content = {"name": "mjcf_files", "settings": {"same": SAME}, "kinds": dict(kinds), "reasons": dict(reasons)}
        write_json(json.resolve(), {**content, "rows": [asdict(row) for row in alone]})


if __name__ == "__main__":
    run_program(main)
