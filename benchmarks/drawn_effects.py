"""Energy of worlds with drawn effects: ``python -m benchmarks.drawn_effects``.

Every effect of the catalogue and every two, in flight and on a floor, at `fast` and `balanced`: see
`rigid_env.measure.drawn_effects` for what is drawn and for the law. Draws that break it are listed with what makes them
again: ``--pair "spring,drag" --seed 17``.
"""

from __future__ import annotations

import itertools
import zlib
from typing import Annotated

import numpy as np
import typer
from rich.progress import track

from benchmarks import machine
from rigid_env.measure import drawn_effects
from rigid_env.measure.machine import write_json

PRESETS = ("fast", "balanced")
WORLDS_PER_DRAW = 4


def one(names: tuple[str, ...], on_floor: bool, preset: str, seed: int) -> drawn_effects.Outcome | None:
    """One draw; None where its effects cannot be had together."""
    rng = np.random.default_rng([zlib.crc32("+".join(names).encode()), on_floor, seed])
    try:
        scene = drawn_effects.draw_scene(rng, names, on_floor)
        return None if scene is None else drawn_effects.run(rng, scene, preset, WORLDS_PER_DRAW)
    except ValueError as error:
        if "allowed" not in str(error):  # as every refusal of two effects together says
            raise
        return None


def main(
    worlds: Annotated[int, typer.Option(help="Worlds in all, about.")] = 100_000,
    pair: Annotated[str, typer.Option(help="Only these effects, by names with a comma between.")] = "",
    seed: Annotated[int, typer.Option(help="First seed.")] = 0,
    json: Annotated[str, typer.Option(help="File for the result.")] = "",
) -> None:
    """Run them, and print those that break the law."""
    chosen = [tuple(pair.split(","))] if pair else drawn_effects.pairs()
    kinds = list(itertools.product(chosen, (False, True), PRESETS))
    kinds = [kind for kind in kinds if kind[1] or not any(name in drawn_effects.ON_FLOOR for name in kind[0])]
    draws = max(1, round(worlds / WORLDS_PER_DRAW / len(kinds)))
    found, count, told, refused = [], 0, 0, []
    for names, on_floor, preset in track(kinds, description="pairs of effects"):
        for k in range(seed, seed + draws):
            outcome = one(names, on_floor, preset, k)
            if outcome is None:
                refused.append((names, preset, on_floor))
                break
            count, told = count + len(outcome.excess), told + int(outcome.is_told.sum())
            bad = (outcome.excess > 0) | ~outcome.is_finite
            if bad.any():
                worst = float(outcome.excess.max())
                found.append({"effects": names, "floor": on_floor, "preset": preset, "seed": k, "excess": worst})
                print(f"{','.join(names)} {'floor' if on_floor else 'flight'} {preset} --seed {k}: {worst:.3g}")
    print(f"{count} worlds, {len(found)} draws beyond the law, {told} worlds with a report that is not OK")
    if json:
        result = {"worlds": count, "beyond": found, "told": told, "refused": sorted({r[0] for r in refused})}
        write_json(json, {**result, "machine": machine.describe()})


if __name__ == "__main__":
    typer.run(main)
