"""Nobody is forgotten, and nothing is done twice, however threads come and go.

The order in which the threads of a crew look at what a member is, and change it, is up to chance. A model of it, one
line for each such look or change of `physics.kernels.crew`, goes through all orders; the kernels themselves go through
thousands of runs in which members go at about the time when they are called.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from physics import threads
from physics.kernels.atomic import add, pause
from physics.kernels.compiler import kernel
from physics.kernels.crew import AWAY, CALLED, CALLED_LAST, WAITING
from physics.machine_code import bound
from physics.threads import Team

RUNS = 3


class Moment(NamedTuple):
    """What one who leads and one member are at; of the member there may be two threads, one that is going."""

    state: int = AWAY
    finished: int = 0
    done: int = 0  # calls that the member has made
    run: int = 0
    leader: str = "begin"
    threads: tuple[str, ...] = ()


def of_leader(m: Moment) -> list[Moment]:
    """What may follow by the one that leads, who runs out of patience at any time."""
    match m.leader:
        case "begin":
            return [m._replace(finished=0, leader="summon")] if m.run < RUNS else []
        case "summon":
            sent = (*m.threads, "perform") if m.state == AWAY else m.threads
            return [m._replace(state=CALLED, leader="wait", threads=sent)]
        case "wait":
            return [m._replace(leader="end" if m.finished == 1 else "wait"), m._replace(leader="dismiss")]
        case "dismiss":
            return [m._replace(leader="last" if m.state in (CALLED, WAITING) else "join")]
        case "last":
            return [m._replace(state=CALLED_LAST if m.state == CALLED else m.state, leader="away")]
        case "away":
            return [m._replace(state=AWAY if m.state == WAITING else m.state, leader="dismiss")]
        case "join":
            return [] if m.threads else [m._replace(leader="end")]
        case "end":
            assert m.done == m.run + 1
            return [m._replace(run=m.run + 1, leader="begin")]


def of_thread(m: Moment, k: int) -> list[Moment]:
    """What may follow by thread k of the member, which runs out of patience at any time."""

    def then(what: str | None, **more) -> Moment:
        rest = m.threads[:k] + ((what,) if what else ()) + m.threads[k + 1 :]
        return m._replace(threads=rest, **more)

    match m.threads[k]:
        case "perform":
            return [then("stay", done=m.done + 1)]
        case "stay":
            return [then("finish", state=WAITING) if m.state == CALLED else then("leave")]
        case "leave":
            return [then("finish and go", state=AWAY)]
        case "finish and go":
            return [then(None, finished=m.finished + 1)]
        case "finish":
            return [then("look", finished=m.finished + 1)]
        case "look":
            return [then("go"), then("look" if m.state == WAITING else "go")]
        case "go":
            return [then(None, state=AWAY) if m.state == WAITING else then("look again")]
        case "look again":
            return [then("perform" if m.state != AWAY else None)]


def test_all_orders_of_looks_and_changes():
    found = {Moment()}
    left = list(found)
    while left:
        moment = left.pop()
        following = of_leader(moment)
        for k in range(len(moment.threads)):
            following += of_thread(moment, k)
        assert following or moment.run == RUNS, f"nobody can go on: {moment}"
        for each in following:
            assert each.done <= each.run + 1, f"done twice: {each}"
            if each not in found:
                found.add(each)
                left.append(each)
    assert Moment(state=AWAY, finished=1, done=RUNS, run=RUNS) in found


@kernel
def visit(visits, k, pauses):
    for _ in range(pauses[k]):
        pause()
    add(visits, 0, k, 1)


@pytest.mark.parametrize(("patience", "stay"), [(2e-4, 2e-6), (2e-6, 2e-5), (1e-3, 0.0), (5e-6, 5e-6)])
@pytest.mark.parametrize("size", [2, 4])
def test_many_runs(size, patience, stay, monkeypatch):
    """4,000 runs; the mistakes that were made in it showed after some thousands."""
    monkeypatch.setattr(threads, "PATIENCE", patience)
    monkeypatch.setattr(threads, "STAY", stay)
    monkeypatch.setattr(threads, "_cores", lambda: size)  # else nobody stays where there are fewer
    team, rng = Team(size, 100), np.random.default_rng(size)
    visits, pauses = np.zeros((1, size), dtype=np.int64), np.zeros(size, dtype=np.int64)
    calls = [bound(visit, visits, k, pauses) for k in range(size)]
    for run in range(1, 4001):
        pauses[:] = rng.integers(0, 300, size)
        team.run(calls)
        assert (visits == run).all()
    team.close()
