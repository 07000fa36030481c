"""Measure the same work in our engine and in MuJoCo, in turns, as rows of a throughput table."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from rigid_env.lab.measure import mujoco_scene, workloads
from rigid_env.lab.measure.timing import Row, Spread, fastest, interleave
from rigid_env.lab.measure.workloads import Sizes

ACCURACIES = ("fast", "balanced")
UNIT = "steps/s"
MUJOCO = "MuJoCo mj_step"
LARGEST_RESIDUAL = 1e-6  # largest valid residual of the block at rest, relative

# Row: (description, target for the ratio to MuJoCo, class in `workloads` and `mujoco_scene`)
SINGLE = {
    "flight": ("free flight", 25.0, "Flight"),
    "rest": ("at rest, 4 contacts", 12.0, "Rest"),
    "shove": ("shoved about", 10.0, "Shove"),
}
BATCH_TARGET = 8.0

Tick = Callable[[str], None]


def engine_rows(sizes: Sizes, repeats: int, with_peer: bool, tick: Tick | None = None) -> Iterator[list[Row]]:
    """Measure flight, rest, shoves and the batch; yield the rows of each as soon as they are measured.

    Parameters
    ----------
    sizes : Sizes
        Work of one run.
    repeats : int
        Repeats of every measurement, in turns.
    with_peer : bool
        Whether MuJoCo is measured, too.
    tick : callable, optional
        Called before each run with its name.
    """
    for key in SINGLE:
        yield _single_rows(key, sizes, repeats, with_peer, tick)
    yield _batch_rows(sizes, repeats, with_peer, tick)


def paired_rows(spreads: dict[str, Spread], peers: dict[str, str], notes: dict | None = None, **common) -> list[Row]:
    """Make a row for each accuracy of our engine, compared with the fastest other engine.

    Parameters
    ----------
    spreads : dict of str to Spread
        Measurements, ours by accuracy, others by the keys of `peers`.
    peers : dict of str to str
        Name of each other engine for the table, by its key in `spreads`.
    notes : dict of str to dict, optional
        `Row.notes` of each accuracy.
    common
        Fields of `Row` that are the same for all rows.
    """
    peer = fastest(spreads, list(peers)) if peers else None
    return [
        Row(
            ours=spread, accuracy=name, peer_name=peers[peer] if peer else "",
            peer=spreads[peer] if peer else None, notes=(notes or {}).get(name, {}), **common,
        )
        for name, spread in spreads.items()
        if name not in peers
    ]  # fmt: skip


def run_count(repeats: int, with_peer: bool) -> int:
    """Number of calls of `tick` by `engine_rows`."""
    batch_peers = 1 + mujoco_scene.has_batch()
    contestants = 4 * len(ACCURACIES) + (len(SINGLE) + batch_peers if with_peer else 0)
    return contestants * (repeats + 1)


def told(tick: Tick | None, what: str) -> Tick | None:
    """Make a function that calls `tick` with `what` before the given name; None if `tick` is None."""
    return None if tick is None else lambda name: tick(f"{what}: {name}")


def _single_rows(key, sizes, repeats, with_peer, tick) -> list[Row]:
    what, target, work = SINGLE[key]
    runners = {accuracy: getattr(workloads, work)(accuracy, sizes) for accuracy in ACCURACIES}
    peers = {}
    if with_peer:
        runners["mujoco"] = getattr(mujoco_scene, work)(sizes)
        peers["mujoco"] = MUJOCO
    spreads = interleave(runners, repeats, told(tick, what))
    notes = {name: runner.notes() for name, runner in runners.items() if hasattr(runner, "notes")}
    for name in ACCURACIES if "mujoco" in notes else ():
        notes[name]["peer"] = notes["mujoco"]
    rows = paired_rows(spreads, peers, notes, key=key, what=what, unit=UNIT, target=target)
    return [_held_to_residual(row) for row in rows] if key == "rest" else rows


def _held_to_residual(row: Row) -> Row:
    is_small = row.notes["residual"] <= LARGEST_RESIDUAL and row.notes["status"] == "ok"
    return Row(**{**vars(row), "is_valid": is_small and row.notes["contacts"] == 4})


def _batch_rows(sizes, repeats, with_peer, tick) -> list[Row]:
    what = f"{sizes.worlds:,} worlds, {sizes.threads} threads"
    runners = {accuracy: workloads.Batch(accuracy, sizes) for accuracy in ACCURACIES}
    peers = {}
    if with_peer:
        landed = mujoco_scene.landed_states(sizes)
        runners["rollout"], peers["rollout"] = mujoco_scene.Rollout(sizes, landed), "mujoco.rollout"
        if mujoco_scene.has_batch():
            runners["batch"], peers["batch"] = mujoco_scene.Batch(sizes, landed), "mujoco.batch"
    spreads = interleave(runners, repeats, told(tick, what))
    all_peers = {"peers": {peers[name]: spreads[name].to_dict() for name in peers}}
    notes = {name: dict(all_peers) for name in ACCURACIES} if peers else None
    return paired_rows(spreads, peers, notes, key="batch", what=what, unit="world steps/s", target=BATCH_TARGET)
