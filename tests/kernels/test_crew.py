"""Nobody is forgotten, and nothing is done twice, however threads come and go.

The order in which the threads of a crew look at what a member is, and change it, is up to chance. A model of it, one
line for each such look or change of `physics.kernels.parallel.spin_wait_workers`, goes through all orders; the kernels
themselves go through thousands of runs in which members go at about the time when they are called.
"""

from __future__ import annotations

import os
from typing import NamedTuple

import numpy as np
import pytest

from physics.compiler.decorators import kernel
from physics.compiler.fused.atomics import call_address, spin_pause
from physics.kernels.parallel.spin_wait_workers import IDLE, RUNNING, SPINNING, STOPPING, WOKEN
from physics.kernels.parallel.work_stealing import TAKEN_COUNT, begin_taking, next_world
from physics.parallel import processors, thread_team
from physics.parallel.bound_call import bound
from physics.parallel.team import Team

RUNS = 3


class Moment(NamedTuple):
    """States of a leader and of one member; of the member there may be two threads, one that is going."""

    state: int = IDLE
    left: int = 0  # worlds that nobody has taken: a run has one
    done: int = 0  # worlds stepped, in all runs
    run: int = 0
    leader: str = "begin"
    is_interrupted: bool = False
    threads: tuple[str, ...] = ()


def of_leader(m: Moment) -> list[Moment]:
    """Moments that may follow by the leader, which runs out of patience at any time, and may be interrupted."""
    match m.leader:
        case "begin":
            return [m._replace(left=1, leader="summon")] if m.run < RUNS else []
        case "summon":
            sent = (*m.threads, "look") if m.state == IDLE else m.threads
            return [m._replace(state=WOKEN, leader="perform", threads=sent)]
        case "perform":
            performed = m._replace(left=0, done=m.done + m.left, leader="take back")
            return [performed, m._replace(leader="dismiss", is_interrupted=True)]
        case "take back":
            return [m._replace(state=SPINNING if m.state == WOKEN else m.state, leader="wait")]
        case "wait":
            return [m._replace(leader="end")] if m.state != RUNNING else [m, m._replace(leader="dismiss")]
        case "dismiss":
            return [m._replace(leader="dismiss called" if m.state in (SPINNING, WOKEN, RUNNING) else "join")]
        case "dismiss called":
            return [m._replace(state=IDLE if m.state == WOKEN else m.state, leader="dismiss waiting")]
        case "dismiss waiting":
            return [m._replace(state=IDLE if m.state == SPINNING else m.state, leader="dismiss busy")]
        case "dismiss busy":
            return [m._replace(state=STOPPING if m.state == RUNNING else m.state, leader="dismiss")]
        case "join":
            return [] if m.threads else [m._replace(leader="end")]
        case "end":
            if m.is_interrupted:  # what is left of the run is given up
                m = m._replace(done=m.run + 1, left=0, is_interrupted=False)
            assert m.done == m.run + 1
            assert not {"perform", "hold", "made"} & set(m.threads)
            return [m._replace(run=m.run + 1, leader="begin")]


def of_thread(m: Moment, k: int) -> list[Moment]:
    """Moments that may follow by thread k of the member, which runs out of patience at any time."""

    def then(what: str | None, **more) -> Moment:
        rest = m.threads[:k] + ((what,) if what else ()) + m.threads[k + 1 :]
        return m._replace(threads=rest, **more)

    match m.threads[k]:
        case "look":
            seen = {WOKEN: "take call", IDLE: None}.get(m.state, "look")
            return [then(seen), then("look"), then("go")]  # it may be on the leader's processor
        case "take call":
            return [then("perform", state=RUNNING) if m.state == WOKEN else then("look")]
        case "perform":
            return [then("hold" if m.left else "made", left=0)]
        case "hold":
            return [then("made", done=m.done + 1)]
        case "made":
            return [then("look", state=SPINNING) if m.state == RUNNING else then("leave")]
        case "leave":
            return [then(None, state=IDLE)]
        case "go":
            return [then(None if m.state == IDLE else "go or begin")]
        case "go or begin":
            return [then("perform", state=RUNNING) if m.state == WOKEN else then("go away")]
        case "go away":
            return [then(None, state=IDLE) if m.state == SPINNING else then("go")]


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
            assert len({"perform", "hold", "made"} & set(each.threads)) <= 1, f"two are the member: {each}"
            if each not in found:
                found.add(each)
                left.append(each)
    assert Moment(state=IDLE, done=RUNS, run=RUNS) in found
    assert Moment(state=SPINNING, done=RUNS, run=RUNS, threads=("look",)) in found


@kernel
def visit(visits, turns, taken, k, pauses):
    for _ in range(pauses[k]):
        spin_pause()
    world = begin_taking(turns, taken)
    while True:
        world = next_world(world, turns, taken)
        if world < 0:
            break
        visits[world] += 1


@pytest.mark.parametrize("gives_way", [False, True])
@pytest.mark.parametrize(("patience", "stay"), [(2e-4, 2e-6), (2e-6, 2e-5), (1e-3, 0.0), (5e-6, 5e-6)])
@pytest.mark.parametrize("size", [2, 4])
def test_many_runs(size, patience, stay, gives_way, monkeypatch):
    """4,000 runs; the mistakes that were made in it showed after some thousands."""
    monkeypatch.setattr(thread_team, "PATIENCE", patience)
    monkeypatch.setattr(thread_team, "STAY", stay)
    monkeypatch.setattr(thread_team, "BETWEEN", 1e-6)
    monkeypatch.setattr(processors, "usable", lambda: size)
    if not gives_way:
        monkeypatch.setattr(processors, "giving_way", lambda: 0)
        monkeypatch.setattr(processors, "telling", lambda: 0)
    team, rng = Team(size, 100), np.random.default_rng(size)
    visits, pauses = np.zeros(100, dtype=np.int64), np.zeros(size, dtype=np.int64)
    calls = [bound(visit, visits, team.turns, taken, k, pauses) for k, taken in enumerate(team.taken)]
    for run in range(1, 4001):
        pauses[:] = rng.integers(0, 300, size)
        team.run(calls)
        assert (visits == run).all()
        assert team.taken[:, TAKEN_COUNT].sum() == 100
    team.close()


@kernel
def answer(address):
    return call_address(address)


def test_asking_the_system():
    assert answer(0) == -1
    if processors.telling():
        assert 0 <= answer(processors.telling()) < os.cpu_count() + 1024


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="nothing binds a thread to a processor here")
def test_a_member_on_the_processor_of_the_leader_does_not_begin(monkeypatch):
    """The leader makes all steps if all threads have the same processor."""
    monkeypatch.setattr(processors, "usable", lambda: 2)
    monkeypatch.setattr(thread_team, "STAY", 10.0)
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})
    try:
        team = Team(2, 100)
        visits, pauses = np.zeros(100, dtype=np.int64), np.full(2, 2000)
        calls = [bound(visit, visits, team.turns, taken, k, pauses) for k, taken in enumerate(team.taken)]
        for run in range(1, 101):
            team.run(calls)
            assert (visits == run).all()
            assert team.taken[1, TAKEN_COUNT] == 0
        team.close()
    finally:
        os.sched_setaffinity(0, before)
