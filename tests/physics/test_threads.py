"""Threads take the worlds of a batch in turn: each world once, whoever is slow, and what is raised is raised."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

import physics
from physics import scenes, threads
from physics.kernels.turns import FIRST, TAKEN
from physics.threads import Team, listed


def taken_by(team: Team) -> list[list[int]]:
    """The worlds of each thread."""
    return [each[FIRST : FIRST + each[TAKEN]].tolist() for each in team.taken]


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
        assert all(each == sorted(each) for each in taken_by(world.team))


def test_events_are_taken_in_turn_as_well():
    world = physics.World(scenes.shove(), worlds=20, dt=0.01, accuracy="precise", threads=2)
    world.step()
    assert sorted(np.concatenate(taken_by(world.team))) == list(range(20))


def test_worlds_listed_for_a_kernel():
    team = Team(1, 9)
    team.taken[0][: FIRST + 3] = listed(np.array([2, 5, 7]))
    assert taken_by(team) == [[2, 5, 7]]


@pytest.mark.parametrize("patience", [1, threads.PATIENCE])
@pytest.mark.parametrize("slow", [0, 1, 2])
def test_a_run_ends_when_the_slowest_is_done(slow, patience, monkeypatch):
    monkeypatch.setattr(threads, "PATIENCE", patience)
    team, done = Team(3, 100), []

    def call(k):
        if k == slow:
            time.sleep(0.05)
        done.append((k, threading.get_ident()))

    for _ in range(3):
        done.clear()
        team.run([lambda k=k: call(k) for k in range(3)])
        assert sorted(k for k, _ in done) == [0, 1, 2]
        assert dict(done)[0] == threading.get_ident()  # the caller is the first of the team
        assert len({ident for _, ident in done}) >= 2
    team.close()


@pytest.mark.parametrize("guilty", [0, 1])
def test_what_a_thread_raises_is_raised_and_the_team_goes_on(guilty):
    team, done = Team(2, 100), []

    def call(k, fails):
        if fails and k == guilty:
            raise ZeroDivisionError(f"thread {k}")
        done.append(k)

    for fails in (True, False, True, False):
        done.clear()
        if fails:
            with pytest.raises(ZeroDivisionError, match=f"thread {guilty}"):
                team.run([lambda k=k: call(k, True) for k in range(2)])
            assert done == [1 - guilty]
        else:
            team.run([lambda k=k: call(k, False) for k in range(2)])
            assert sorted(done) == [0, 1]
    team.close()
    team.run([lambda: done.append(2)] * 2)  # it begins anew
    assert done.count(2) == 2


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("effects", [(), (physics.Actuator(lag=0.1),)])
def test_what_follows_a_step_follows_it_in_every_world_once(effects, count):
    """Also where an actuator is asked at each of the steps of a call."""
    scene = scenes.shove()
    scene = physics.Scene(bodies=scene.bodies, walls=scene.walls, effects=[*scene.effects, *effects])
    world = physics.World(scene, worlds=50, dt=0.01, accuracy="fast", threads=count)
    visits = []

    def follow(taken):
        def note():
            visits.extend((int(k), world.state[k, 1]) for k in taken[FIRST : FIRST + taken[TAKEN]])

        return note

    stepper = physics.Stepper(world, 3, then=follow)
    for _ in range(2):
        visits.clear()
        stepper()
        assert sorted(k for k, _ in visits) == list(range(50))
        assert all(height == world.state[k, 1] for k, height in visits)  # of the last step
