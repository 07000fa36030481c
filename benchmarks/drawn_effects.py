"""Energy of worlds with drawn effects: ``python -m benchmarks.drawn_effects``.

Every effect of the catalogue and every two, in flight and on a floor, at `fast` and `balanced`: see
`benchmarks.drawn_worlds` for what is drawn and for the law. Draws that break it are listed with what makes
them again: ``--pair "spring,drag" --seed 17``. A file of results grows by seeds that are not in it yet: ``--seed 20``.
"""

from __future__ import annotations

import itertools
import json as json_module
import math
import zlib
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.progress import track

from benchmarks import drawn_worlds
from rigid_env.lab.measure.machine import write_json

PRESETS = ("fast", "balanced")
WORLDS_PER_DRAW = 4


def one(names: tuple[str, ...], on_floor: bool, preset: str, seed: int) -> drawn_worlds.Outcome | None:
    """One draw; None where its effects cannot be had together."""
    rng = np.random.default_rng([zlib.crc32("+".join(names).encode()), on_floor, seed])
    try:
        scene = drawn_worlds.draw_scene(rng, names, on_floor)
        return None if scene is None else drawn_worlds.run(rng, scene, preset, WORLDS_PER_DRAW)
    except ValueError as error:
        if "allowed" not in str(error):  # as every refusal of two effects together says
            raise
        return None


def run_kind(names: tuple[str, ...], on_floor: bool, preset: str, seeds: range) -> dict:
    """Some draws of one kind: counts, and the draws that break the law."""
    row = {"effects": list(names), "floor": on_floor, "preset": preset, "seeds": [seeds.start, seeds.stop]}
    row |= {"worlds": 0, "told": 0, "beyond": []}
    for seed in seeds:
        outcome = one(names, on_floor, preset, seed)
        if outcome is None:
            row["refused"] = True
            break
        row["worlds"] += len(outcome.excess)
        row["told"] += int(outcome.is_told.sum())
        if ((outcome.excess > 0) | ~outcome.is_finite).any():
            row["beyond"].append({"seed": seed, "excess": float(outcome.excess.max())})
    return row


def kinds(pair: str, presets: tuple[str, ...]) -> list[tuple[tuple[str, ...], bool, str]]:
    """(effects, on a floor, preset) of all kinds of draws."""
    chosen = [tuple(pair.split(","))] if pair else drawn_worlds.pairs()
    return [
        (names, on_floor, preset)
        for names, on_floor, preset in itertools.product(chosen, (False, True), presets)
        if on_floor or not any(name in drawn_worlds.ON_FLOOR for name in names)
    ]


def main(
    worlds: Annotated[int, typer.Option(help="Worlds in all, about.")] = 100_000,
    pair: Annotated[str, typer.Option(help="Only these effects, by names with a comma between.")] = "",
    preset: Annotated[str, typer.Option(help="Only this preset.")] = "",
    seed: Annotated[int, typer.Option(help="First seed.")] = 0,
    json: Annotated[
        str, typer.Option(help="File for the result, kept as it grows; what it holds is not run again.")
    ] = "",
) -> None:
    """Run them, and print those that break the law."""
    presets = (preset,) if preset else PRESETS
    todo = kinds(pair, presets)
    per_kind = worlds / len(kinds(pair, PRESETS))
    seeds = range(seed, seed + max(1, math.ceil(per_kind / WORLDS_PER_DRAW)))
    rows = read_json(json) if json and Path(json).exists() else []
    done = {(tuple(row["effects"]), row["floor"], row["preset"]) for row in rows if seed in range(*row["seeds"])}
    for kind in track([kind for kind in todo if kind not in done], description="pairs of effects"):
        row = run_kind(*kind, seeds)
        rows.append(row)
        for draw in row["beyond"]:
            place = "floor" if row["floor"] else "flight"
            print(f"{','.join(row['effects'])} {place} {row['preset']} --seed {draw['seed']}: {draw['excess']:.3g}")
        if json:
            write_json(json, {"name": "drawn_effects", "rows": rows})
    count, beyond = sum(row["worlds"] for row in rows), sum(len(row["beyond"]) for row in rows)
    told = sum(row["told"] for row in rows)
    print(f"{count} worlds, {beyond} draws beyond the law, {told} worlds with a report that is not OK")


def read_json(path: str) -> list[dict]:
    """Rows of an earlier run."""
    return json_module.loads(Path(path).read_text())["rows"]


if __name__ == "__main__":
    typer.run(main)
