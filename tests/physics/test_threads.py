"""Threads take the worlds of a batch in turn: each world once, whoever is slow, and what is raised is raised."""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import physics
from physics import scenes
from physics.compiler.decorators import kernel
from physics.compiler.fused.atomics import atomic_add, atomic_load, spin_pause
from physics.kernels.parallel import spin_wait_workers, work_stealing
from physics.kernels.parallel.work_stealing import TAKEN_COUNT, TAKEN_FIRST_WORLD, next_world
from physics.kernels.parallel.work_stealing import begin_taking as turns_begin
from physics.parallel import processors, thread_team
from physics.parallel.bound_call import bound
from physics.parallel.team import Team, listed
from physics.world.stepper import kernel_calls


def taken_by(team: Team) -> list[list[int]]:
    """The worlds of each thread."""
    return [each[TAKEN_FIRST_WORLD : TAKEN_FIRST_WORLD + each[TAKEN_COUNT]].tolist() for each in team.taken]


def tied() -> physics.Scene:
    """Two balls and a spring between them, without walls."""
    balls = [physics.Sphere(0.5, mass=1.0, pos=(x, 0.0, 0.0)) for x in (-1.0, 1.0)]
    return physics.Scene(bodies=balls, effects=[physics.Spring(stiffness=5.0, body=0, other=1)])


@pytest.mark.parametrize("scene", [scenes.shove, lambda: scenes.tower(2), tied])
@pytest.mark.parametrize(("worlds", "count"), [(1, 1), (1, 3), (5, 2), (7, 7), (40, 3), (200, 2)])
def test_each_world_is_taken_once(scene, worlds, count):
    world = physics.World(scene(), worlds=worlds, dt=0.01, accuracy="fast", threads=count)
    assert len(world.team.taken) == min(worlds, count)
    for _ in range(3):
        world.step()
        assert sorted(np.concatenate(taken_by(world.team))) == list(range(worlds))


def test_a_thread_that_is_alone_deals_for_itself():
    """So that calls that it makes one after another each find all worlds."""
    world, twin = (physics.World(scenes.shove(), worlds=3, dt=0.01) for _ in range(2))
    call = kernel_calls(world, world.no_wrench(), 1, 0.01)[0]
    call.then(call)()
    twin.step(steps=2)
    assert np.array_equal(world.state, twin.state)


def test_events_are_taken_in_turn_as_well():
    world = physics.World(scenes.shove(), worlds=20, dt=0.01, accuracy="precise", threads=2)
    world.step()
    assert sorted(np.concatenate(taken_by(world.team))) == list(range(20))


def test_worlds_listed_for_a_kernel():
    team = Team(1, 9)
    team.taken[0][: TAKEN_FIRST_WORLD + 3] = listed(np.array([2, 5, 7]))
    assert taken_by(team) == [[2, 5, 7]]


@given(st.integers(1, 5), st.integers(1, 60), st.integers(1, 9), st.randoms(use_true_random=False))
def test_whoever_is_fast_each_world_is_taken_once(size, worlds, chunk, random):
    """And a thread takes those of its own range first."""
    table, lists = work_stealing.make_ranges(size, worlds, chunk), work_stealing.make_taken_lists(size, worlds)
    work_stealing.reset_ranges(table)
    for taken in lists:
        work_stealing.begin_taking(table, taken)
    last, busy = [-1] * size, list(range(size))
    while busy:
        k = random.choice(busy)
        last[k] = work_stealing.next_world(last[k], table, lists[k])
        if last[k] < 0:
            busy.remove(k)
    each = [taken[TAKEN_FIRST_WORLD : TAKEN_FIRST_WORLD + taken[TAKEN_COUNT]].tolist() for taken in lists]
    assert sorted(np.concatenate(each)) == list(range(worlds))
    for k, mine in enumerate(each):
        is_own = [worlds * k // size <= world < worlds * (k + 1) // size for world in mine]
        assert is_own == sorted(is_own, reverse=True)


@kernel
def visit(visits, k, pauses, begun):
    """Wait, and note it. The one that leads waits until all have begun.

    Instead of a number of pauses, -1 raises, and -2 (HELD) waits until something else stands there.
    """
    atomic_add(begun, 0, 0, 1)
    while k == 0 and atomic_load(begun, 0, 0) % visits.shape[1] != 0:
        spin_pause()
    while atomic_load(pauses, 0, k) == -2:
        spin_pause()
    if pauses[0, k] < 0:
        raise ZeroDivisionError("this thread")
    for _ in range(pauses[0, k]):
        spin_pause()
    atomic_add(visits, 0, k, 1)


def visitors(size: int, pauses=0) -> tuple[list, np.ndarray, np.ndarray]:
    """Calls for so many threads; what they note, and how long each waits."""
    visits, pauses, begun = np.zeros((1, size), np.int64), np.full((1, size), pauses), np.zeros((1, 1), np.int64)
    return [bound(visit, visits, k, pauses, begun) for k in range(size)], visits, pauses[0]


@pytest.fixture
def sent(monkeypatch) -> list:
    """Grows by one for each thread that is sent for."""
    found, submit = [], ThreadPoolExecutor.submit

    def noted(pool, *arguments):
        found.append(arguments)
        return submit(pool, *arguments)

    monkeypatch.setattr(ThreadPoolExecutor, "submit", noted)
    monkeypatch.setattr(processors, "usable", lambda: 100)  # else there are not more threads than processors
    monkeypatch.setattr(processors, "telling", lambda: 0)  # else nobody begins on the processor of the one that leads
    return found


SLOW = 2_000_000  # pauses: some hundredths of a second
HELD = -2  # until it is let go: for tests that would fail if the one that leads were the slower one


@pytest.mark.parametrize(("patience", "stay"), [(0.0, 0.0), (10.0, 0.0), (0.0, 10.0), (10.0, 10.0)])
@pytest.mark.parametrize("slow", [0, 1, 2])
def test_a_run_ends_when_the_slowest_is_done(slow, patience, stay, sent, monkeypatch):
    monkeypatch.setattr(thread_team, "PATIENCE", patience)
    monkeypatch.setattr(thread_team, "STAY", stay)
    team, (calls, visits, pauses) = Team(3, 100), visitors(3)
    pauses[slow] = SLOW
    for times in range(1, 4):
        team.run(calls)
        assert visits.tolist() == [[times] * 3]
    team.close()


def test_who_stays_is_not_sent_for_again(sent, monkeypatch):
    """Also for other calls; who is gone is, and who leads does not wait for those who stay when all is over."""
    monkeypatch.setattr(thread_team, "PATIENCE", 10.0)
    monkeypatch.setattr(thread_team, "STAY", 100.0)
    team, (calls, visits, _), (others, seen, _) = Team(3, 100), visitors(3), visitors(3)
    for _ in range(5):
        team.run(calls)
        team.run(others)
    assert len(sent) == 2
    start = time.perf_counter()
    team.close()
    assert time.perf_counter() - start < 50.0
    team.run(calls)  # it begins anew
    assert len(sent) == 4
    assert visits.tolist() == [[6] * 3]
    assert seen.tolist() == [[5] * 3]
    team.close()


def test_who_is_not_called_soon_goes(sent, monkeypatch):
    monkeypatch.setattr(thread_team, "PATIENCE", 10.0)
    monkeypatch.setattr(thread_team, "STAY", 0.0)
    team, (calls, visits, _) = Team(2, 100), visitors(2)
    for times in range(1, 4):
        team.run(calls)
        for future in team._futures.values():
            future.result(timeout=60)
        assert team._crew[1, spin_wait_workers.WORKER_STATE] == spin_wait_workers.IDLE
        assert len(sent) == times
    assert visits.tolist() == [[3, 3]]
    team.close()


@pytest.mark.parametrize("stay", [0.0, 10.0])
@pytest.mark.parametrize("guilty", [0, 1])
def test_what_a_thread_raises_is_raised_and_the_team_goes_on(guilty, stay, sent, monkeypatch):
    monkeypatch.setattr(thread_team, "STAY", stay)
    team, (calls, visits, pauses) = Team(2, 100), visitors(2)
    for times in (1, 2):
        pauses[guilty] = -1
        with pytest.raises(ZeroDivisionError, match="this thread"):
            team.run(calls)
        assert visits[0, [guilty, 1 - guilty]].tolist() == [times - 1, 2 * times - 1]
        pauses[guilty] = 0
        team.run(calls)
        assert visits[0, [guilty, 1 - guilty]].tolist() == [times, 2 * times]
    team.close()


@pytest.mark.parametrize("delay", [0.0, 0.05])
def test_after_an_interrupt_the_team_waits_for_who_is_busy(delay, sent, monkeypatch):
    """Ctrl-C while the one that leads sleeps until the others, who may not have begun, have finished; then there is
    something else to do.
    """
    be_member = Team._be_member
    monkeypatch.setattr(thread_team, "PATIENCE", 0.0)
    monkeypatch.setattr(Team, "_be_member", lambda team, member: (time.sleep(delay), be_member(team, member)))
    team, (calls, visits, pauses) = Team(2, 100), visitors(2)
    team.run(calls)
    pauses[1] = HELD
    with monkeypatch.context() as patch:
        patch.setattr(Team, "_let_go", interrupt)
        with pytest.raises(KeyboardInterrupt):
            team.run(calls)
    others, seen, _ = visitors(2)
    threading.Timer(0.05, pauses.__setitem__, (1, 0)).start()
    team.run(others)
    assert visits.tolist() == [[2, 2]]
    assert seen.tolist() == [[1, 1]]
    team.close()


def interrupt(team: Team) -> None:
    raise KeyboardInterrupt


@kernel
def take_all(turns, taken, visits, failing):
    world = turns_begin(turns, taken)
    while True:
        world = next_world(world, turns, taken)
        if world < 0:
            break
        visits[world] += 1
    if failing[0]:
        raise ValueError("the one that leads")


def test_nobody_waits_for_a_thread_that_has_not_begun(sent, monkeypatch):
    """Its list is empty then, also where it was not before, and it is sent for once."""
    monkeypatch.setattr(thread_team, "STAY", 0.0)
    team, (calls, _, pauses), visits = Team(2, 100), visitors(2), np.zeros(100, dtype=np.int64)
    pauses[1] = -1
    with pytest.raises(ZeroDivisionError):  # the member's call has raised the last time that it was made
        team.run(calls)
    team._let_go()
    held, be_member = threading.Event(), Team._be_member
    monkeypatch.setattr(Team, "_be_member", lambda team, member: (held.wait(60), be_member(team, member)))
    failing = np.zeros(1, dtype=np.int64)
    alone = [bound(take_all, team.turns, taken, visits, failing) for taken in team.taken]
    team.taken[1, TAKEN_COUNT] = 5
    for times in range(1, 4):
        team.run(alone)
        assert (visits == times).all()
        assert [len(taken) for taken in taken_by(team)] == [100, 0]
    assert len(sent) == 2
    failing[0] = 1
    with pytest.raises(ValueError, match="the one that leads"):
        team.run([alone[0], calls[1]])
    held.set()
    team.close()


def test_what_was_raised_is_not_raised_again(sent, monkeypatch):
    """By a call that is left out in the next run, in which another one is not finished soon."""
    monkeypatch.setattr(thread_team, "PATIENCE", 0.0)
    monkeypatch.setattr(thread_team, "STAY", 0.0)
    team, (calls, _, pauses), (others, visits, slow) = Team(3, 100), visitors(3), visitors(2)
    pauses[2], slow[1] = -1, SLOW
    with pytest.raises(ZeroDivisionError):
        team.run(calls)
    team._let_go()
    held, be_member = threading.Event(), Team._be_member
    monkeypatch.setattr(Team, "_be_member", lambda team, k: (k == 2 and held.wait(60), be_member(team, k)))
    threading.Timer(0.3, held.set).start()
    team.run([*others, calls[2]])
    assert visits.tolist() == [[1, 1]]
    team.close()


@pytest.mark.parametrize(("switch", "others"), [("", 1), ("fixed", 3)])
def test_no_more_threads_than_processors(switch, others, sent, monkeypatch):
    monkeypatch.setattr(processors, "usable", lambda: 2)
    monkeypatch.setenv(thread_team.SWITCH, switch)
    monkeypatch.setattr(thread_team, "STAY", 100.0)
    world = physics.World(scenes.shove(), worlds=40, dt=0.01, accuracy="fast", threads=4)
    for _ in range(3):
        world.step()
        assert sorted(np.concatenate(taken_by(world.team))) == list(range(40))
    assert len(sent) == others
    assert (world.team._crew[0, spin_wait_workers.CREW_YIELD_ADDRESS] == 0) == (switch == "fixed")
    assert world.team._crew[0, spin_wait_workers.CREW_PROCESSOR_ADDRESS] == 0
    assert not world.team.taken[1 + others :, TAKEN_COUNT].any()
    world.team.close()


@kernel
def follow(taken, state, visits, heights):
    for k in range(taken[TAKEN_COUNT]):
        world = taken[TAKEN_FIRST_WORLD + k]
        visits[world] += 1
        heights[world] = state[world, 1]


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("effects", [(), (physics.Actuator(lag=0.1),)])
def test_what_follows_a_step_follows_it_in_every_world_once(effects, count):
    """Also where an actuator is asked at each of the steps of a call."""
    scene = scenes.shove()
    scene = physics.Scene(bodies=scene.bodies, walls=scene.walls, effects=[*scene.effects, *effects])
    world = physics.World(scene, worlds=50, dt=0.01, accuracy="fast", threads=count)
    visits, heights = np.zeros(50, dtype=np.int64), np.zeros(50)
    stepper = physics.Stepper(world, 3, then=lambda taken: bound(follow, taken, world.state, visits, heights))
    for times in (1, 2):
        stepper()
        assert (visits == times).all()
        np.testing.assert_array_equal(heights, world.state[:, 1])  # of the last step
