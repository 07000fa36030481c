"""Stored truths: made here, kept in ``data``, each with the command that made it and an estimate of its error.

    python -m tests.reference.truths vertex_drop
    python -m tests.reference.truths drop
    python -m tests.reference.truths closed_box

Of `vertex_drop` and `drop` the error is the largest difference between two runs of `tests.reference.hybrid`, at the
tolerances `FINE` and `COARSE`; the finer run is stored. Of `closed_box` it is the difference between two runs of
`tests.reference.closed_box` with different digits, order and step; there is also the sensitivity: how far the start's
own rounding, one part in 2⁵² of each component in turn, carries the state after the last hit.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import mpmath
import numpy as np

from physics import scenes
from tests.reference import closed_box, hybrid

DATA = Path(__file__).with_name("data")
COMMAND = "python -m tests.reference.truths"
FINE = hybrid.Options()
COARSE = hybrid.Options(rtol=1e-12, turn=0.08, zeno=4e-9, snap=4e-11, together=4e-12, ahead=3e-6)
STATE = {"pos": slice(0, 3), "quat": slice(3, 7), "linvel": slice(7, 10), "angvel": slice(10, 13)}
COUNTED = 1e-6  # impulse below which the last hops are not compared one by one: the thresholds differ [N s]
HITS, AFTER = 20, 1e-3  # of the closed box: hits, and the time after the last of them [s]
DIGITS = 30  # that are stored


def load(name: str) -> dict:
    """A stored truth."""
    return json.loads((DATA / f"{name}.json").read_text(encoding="utf-8"))


def event_driven(name: str, duration: float, sample_dt: float) -> dict:
    """The truth of a scene with impacts, friction and rest."""
    problem, y = hybrid.from_scene(scenes.by_name(name))
    times = np.linspace(0.0, duration, round(duration / sample_dt) + 1)
    fine, coarse = (hybrid.simulate(problem, y, duration, times, options) for options in (FINE, COARSE))
    off = np.abs(fine.samples - coarse.samples)
    return {
        "scene": name,
        "command": f"{COMMAND} {name}",
        "units": "SI; quaternion (w, x, y, z); world frame; samples just after an event at their time",
        "error": {key: float(off[:, columns].max()) for key, columns in STATE.items()} | events_error(fine, coarse),
        "flights_left_out_s": fine.left_out,
        "laws": "tests/reference/hybrid/__init__.py",
        "t": times.tolist(),
        **{key: fine.samples[:, columns].tolist() for key, columns in STATE.items()},
        "events": [[float(e.t), e.kind, *e.contact, *e.impulse] for e in fine.events],
        "event_columns": ["t", "kind", "vertex", "wall", "impulse normal", "tangent 1", "tangent 2"],
        "tangents_of_walls": problem.frames[:, 1:].tolist(),
    }


def events_error(fine: hybrid.Result, coarse: hybrid.Result) -> dict:
    """Largest difference in time and impulse of impacts of more than `COUNTED`, and how many there are."""
    lists = [[e for e in run.events if e.kind == "impact" and e.impulse[0] > COUNTED] for run in (fine, coarse)]
    assert [e.contact for e in lists[0]] == [e.contact for e in lists[1]], "the two runs differ in what happens"
    pairs = list(zip(*lists))
    return {
        "impacts_compared": len(pairs),
        "impact_time": float(max(abs(a.t - b.t) for a, b in pairs)),
        "impulse": float(max(np.abs(np.subtract(a.impulse, b.impulse)).max() for a, b in pairs)),
        "end": float(abs(fine.events[-1].t - coarse.events[-1].t)),
    }


def box_run(start: list, digits: int, order: int, step: float):
    """([Hit], state `AFTER` the last) of the closed box, ω in the world frame."""
    problem, _ = hybrid.from_scene(scenes.closed_box())
    with mpmath.workdps(digits):
        hits, end = closed_box.ElasticBlock(problem, order, step).run(start, HITS, AFTER)
        return [hit._replace(state=closed_box.world_frame(hit.state)) for hit in hits], closed_box.world_frame(end)


def perturbed_starts() -> list:
    """[(component, start)]: each of the 13 larger by one part in 2⁵², of itself, or of 1 where it is zero."""
    body = scenes.closed_box().bodies[0]
    exact = [float(a) for a in (*body.pos, *body.quat, *body.linvel, *body.angvel)]
    starts = []
    for k, value in enumerate(exact):
        moved = [mpmath.mpf(a) for a in exact]
        moved[k] += mpmath.mpf(2) ** -52 * (abs(value) or 1)
        starts.append((k, closed_box.start_of(moved)))
    return starts


def distance(a: list, b: list) -> float:
    """Largest difference of two states."""
    return float(max(abs(x - y) for x, y in zip(a, b)))


def chaotic_box() -> dict:
    """The truth of the closed box, with its sensitivity."""
    with mpmath.workdps(60):
        start = closed_box.start(scenes.closed_box().bodies[0])
        shifted = perturbed_starts()
    hits, end = box_run(start, 50, 40, 0.04)
    other, other_end = box_run(start, 42, 34, 0.03)
    spread = {}
    for k, begin in shifted:
        moved, _ = box_run(begin, 30, 24, 0.04)
        assert [hit.contact for hit in moved] == [hit.contact for hit in hits]
        spread[k] = distance(moved[-1].state, hits[-1].state)
        print(f"component {k}: {spread[k]:.3e}", flush=True)
    problem, _ = hybrid.from_scene(scenes.closed_box())
    with mpmath.workdps(60):
        error = max(distance(a.state, b.state) for a, b in zip(hits, other))
        return {
            "scene": "closed_box",
            "command": f"{COMMAND} closed_box",
            "units": "SI; pos, quat (w, x, y, z), linvel, angvel; world frame; each state right after its hit",
            "error": {
                "state": max(error, distance(end, other_end)),
                "time": float(max(abs(a.t - b.t) for a, b in zip(hits, other))),
            },
            "sensitivity": {
                "of": "state after the last hit, to one part in 2^52 of each start component (of 1 where it is zero)",
                "components": [spread[k] for k in range(13)],
                "largest": max(spread.values()),
            },
            "hits": [[mpmath.nstr(h.t, DIGITS), *problem.name(h.contact)] for h in hits],
            "hit_columns": ["t", "vertex", "wall"],
            "states": [[mpmath.nstr(a, DIGITS) for a in h.state] for h in hits],
            "after_s": AFTER,
            "state_after": [mpmath.nstr(a, DIGITS) for a in end],
        }


MAKE = {
    "vertex_drop": lambda: event_driven("vertex_drop", 6.0, 0.05),
    "drop": lambda: event_driven("drop", 3.0, 0.05),
    "closed_box": chaotic_box,
}


def write(name: str) -> None:
    """Make a truth and store it, a line per row."""
    lines = []
    for key, value in MAKE[name]().items():
        text = json.dumps(value)
        if isinstance(value, list) and value and isinstance(value[0], list):
            text = "[\n" + ",\n".join(json.dumps(row) for row in value) + "\n]"
        lines.append(f"{json.dumps(key)}: {text}")
    DATA.mkdir(exist_ok=True)
    (DATA / f"{name}.json").write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    for argument in sys.argv[1:] or MAKE:
        write(argument)
