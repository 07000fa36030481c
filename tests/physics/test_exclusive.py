"""One thread at a time for a world and an environment: who comes meanwhile gets an error, and nothing is changed."""

from __future__ import annotations

import copy
import json
import os
import pickle
import signal
import subprocess
import sys
import threading
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import physics
from physics.parallel.bound_call import BoundCall
from physics.parallel.exclusive import _Entry, _Flag, exclusive
from tests.tiers.sweep import sweep

ROOT = str(Path(__file__).parents[2])


def ball(worlds: int = 1, **more) -> physics.World:
    scene = physics.Scene([physics.Sphere(0.5, mass=1.0, linvel=(1, 2, 3))], effects=[physics.Gravity((0, -9.81, 0))])
    return physics.World(scene, worlds=worlds, dt=0.001, accuracy="fast", **more)


class Held:
    """A thread that is in the middle of a step of a world until the end of the block."""

    def __init__(self, world: physics.World, monkeypatch):
        self.begun, self.go_on, self.world = threading.Event(), threading.Event(), world
        make = physics.World.make
        monkeypatch.setattr(physics.World, "make", lambda world, *arguments: self._make(make, world, *arguments))
        self.thread = threading.Thread(target=self._run)
        self.errors: list[BaseException] = []

    def _make(self, make, world, *arguments):
        if threading.current_thread() is self.thread:
            self.begun.set()
            assert self.go_on.wait(60)
        make(world, *arguments)

    def _run(self):
        try:
            self.world.step()
        except BaseException as error:
            self.errors.append(error)

    def __enter__(self):
        self.thread.start()
        assert self.begun.wait(60)
        return self

    def __exit__(self, *_):
        self.go_on.set()
        self.thread.join(60)
        assert not self.errors


CALLS = {
    "step": lambda world, _: world.step(np.ones((2, 1, 6))),
    "Stepper": lambda world, _: physics.Stepper(world)(),
    "set_state": lambda world, _: world.set_state(pos=np.ones((2, 1, 3))),
    "set_parameters": lambda world, _: world.set_parameters(mass=2.0),
    "snapshot": lambda world, _: world.snapshot(),
    "restore": lambda world, snapshot: world.restore(snapshot),
    "make_event_room": lambda world, _: world.make_event_room(3),
    "diagnose": lambda world, _: physics.diagnose(world),
    "pickle": lambda world, _: pickle.dumps(world),
}


@pytest.mark.parametrize("name", CALLS)
def test_whoever_comes_during_a_step_is_refused_and_changes_nothing(name, monkeypatch):
    world, twin, other = ball(2), ball(2), ball(2)
    snapshot = other.snapshot()
    for each in (world, twin):
        each.step()
    with Held(world, monkeypatch):
        before = world.state.copy(), world.params.copy(), world.time, world.event_log
        with pytest.raises(RuntimeError, match=r"World is being used by another thread; allowed is one thread at a"):
            CALLS[name](world, snapshot)
        assert np.array_equal(world.state, before[0])
        assert np.array_equal(world.params, before[1])
        assert world.time == before[2]
        assert world.event_log is before[3]
        other.step()  # is free all the time
    twin.step()
    assert np.array_equal(world.state, twin.state)
    assert world.time == twin.time
    CALLS[name](world, snapshot)  # allowed again


def test_a_stepper_that_was_prepared_is_refused_too(monkeypatch):
    """Its short way, for a world alone on one thread."""
    world = ball()
    prepared = physics.Stepper(world)
    prepared()
    assert prepared._perform is not None
    with Held(world, monkeypatch), pytest.raises(RuntimeError, match="another thread"):
        prepared()
    state, time = world.state.copy(), world.time
    prepared()
    assert not np.array_equal(world.state, state)
    assert world.time == time + 0.001


def test_a_world_is_free_after_an_error(monkeypatch):
    world = ball()
    prepared = physics.Stepper(world)
    for call in (
        lambda: world.step(np.full((1, 1, 6), np.nan)),
        lambda: world.step(steps=0),
        lambda: world.set_state(quat=np.zeros((1, 1, 4))),
        lambda: world.restore(ball(2).snapshot()),
    ):
        with pytest.raises(ValueError, match="allowed"):
            call()
        assert not world.is_in_use
    prepared()
    with monkeypatch.context() as patch:
        patch.setattr(prepared, "_perform", lambda: True)
        patch.setattr(BoundCall, "raise_again", lambda call: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            prepared()
    assert not world.is_in_use
    prepared()


def test_a_recorder_may_take_snapshots_within_the_step():
    world = ball()

    class Keeps(physics.Recorder):
        def after(self):
            super().after()
            snapshots.append(world.snapshot())

    snapshots: list = []
    Keeps(world)
    world.step()
    physics.Stepper(world)()
    assert [snapshot.time for snapshot in snapshots] == [0.001, 0.002]
    assert np.array_equal(snapshots[-1].arrays[0], world.state)


def test_a_copy_is_free_and_goes_on():
    world = ball()
    assert {"is_free", "_user", "is_torn", "telling"}.isdisjoint(world.__getstate__())
    for twin in (copy.deepcopy(world), pickle.loads(pickle.dumps(world))):
        twin.step()
        assert not twin.is_in_use


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_forked_child_does_not_inherit_the_other_thread(monkeypatch):
    """A world that thread was stepping is half a step in the child; errors say so until it has a whole state again."""
    world, other = ball(), ball()
    snapshot = world.snapshot()
    with Held(world, monkeypatch):
        child = os.fork()
        if child == 0:
            monkeypatch.undo()
            code = 1
            try:
                other.step()
                with pytest.raises(RuntimeError, match="forked"):
                    world.step()
                world.restore(snapshot)
                world.step()
                code = 0 if np.array_equal(world.state, other.state) and not world.is_in_use else 2
            finally:
                os._exit(code)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timers")
@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("prepared", [False, True])
def test_ctrl_c_at_any_time_leaves_the_world_free(threads, prepared):
    world = ball(4, threads=threads)
    step = physics.Stepper(world) if prepared else world.step
    step()

    def interrupt(*_):
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    count = 0
    try:
        for k in range(300):
            try:
                signal.setitimer(signal.ITIMER_REAL, 2e-4 + 1e-6 * (k % 50))
                while True:
                    step()
            except KeyboardInterrupt:
                count += 1
            assert not world.is_in_use
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
        world.team.close()
    assert count == 300


@pytest.mark.parametrize("make", [lambda env: gym.make(env).unwrapped, lambda env: gym.make_vec(env, num_envs=2)])
def test_two_threads_in_an_environment(make, monkeypatch):
    env = make("rigid_env:rigid_env/BlockReach-v0")
    env.reset(seed=0)
    action = np.ones(env.action_space.shape, dtype=np.float32)
    begun, go_on, found = threading.Event(), threading.Event(), []
    act = env.task.act

    def held():
        begun.set()
        assert go_on.wait(60)
        act()

    monkeypatch.setattr(env.task, "act", held)
    thread = threading.Thread(target=lambda: found.append(env.step(action)))
    thread.start()
    assert begun.wait(60)
    actions = env.task.wrench.copy()
    for call in (lambda: env.step(-action), lambda: env.reset(seed=1)):
        with pytest.raises(RuntimeError, match=r"Env is being used by another thread"):
            call()
    assert np.array_equal(env.task.wrench, actions)
    go_on.set()
    thread.join(60)
    assert len(found) == 1
    env.step(action)


@pytest.mark.parametrize("kind", [_Flag, _Entry])
def test_one_of_many_threads_is_in_with_and_without_a_lock_of_the_interpreter(kind):
    class Counted(kind):
        inside = entered = 0

        @exclusive
        def enter(self):
            self.inside += 1
            assert self.inside == 1
            self.entered += 1
            self.inside -= 1

    def go():
        for _ in range(2000):
            try:
                thing.enter()
            except RuntimeError:
                refused.append(1)

    thing, refused, before = Counted(), [], sys.getswitchinterval()
    threads = [threading.Thread(target=go) for _ in range(8)]
    sys.setswitchinterval(1e-6)
    try:
        for each in threads:
            each.start()
        for each in threads:
            each.join()
    finally:
        sys.setswitchinterval(before)
    assert thing.entered + len(refused) == 8 * 2000
    assert not thing.is_in_use


@pytest.mark.parametrize("kind", [_Flag, _Entry])
def test_who_is_in_shuts_others_out_until_the_end(kind):
    class Thing(kind):
        @exclusive
        def call(self):
            assert self.is_in_use
            with pytest.raises(RuntimeError, match="another thread"):
                self.call()
            raise ZeroDivisionError

    thing = Thing()
    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            thing.call()
        assert not thing.is_in_use


PROGRAM = """
import json, sys, threading
import numpy as np
import physics

sys.setswitchinterval(1e-5)
threads, tries, steps, prepared = map(int, sys.argv[1:])
scene = physics.Scene([physics.Sphere(0.5, mass=1.0, linvel=(1, 2, 3))], effects=[physics.Gravity((0, -9.81, 0))])
refused = 0
for _ in range(tries):
    world, twin = (physics.World(scene, worlds=200, dt=0.001, accuracy="fast", threads=threads) for _ in range(2))
    done, errors, barrier = [0, 0], [0, 0], threading.Barrier(2)
    calls = [physics.Stepper(world) if prepared else world.step for _ in range(2)]

    def go(k):
        barrier.wait()
        for _ in range(steps):
            try:
                calls[k]()
                done[k] += 1
            except RuntimeError as error:
                assert "another thread" in str(error)
                errors[k] += 1

    both = [threading.Thread(target=go, args=(k,)) for k in range(2)]
    [each.start() for each in both]
    [each.join() for each in both]
    assert [a + b for a, b in zip(done, errors)] == [steps, steps], (done, errors)
    for _ in range(sum(done)):
        twin.step()
    assert twin.time == world.time, (twin.time, world.time)
    assert np.array_equal(twin.state, world.state)
    refused += sum(errors)
print(json.dumps({"refused": refused}))
"""


def together(cache: Path | str, threads: int, tries: int, steps: int, prepared: bool) -> int:
    """Tries of two threads on one world in a new process; how many calls were refused."""
    environment = {**os.environ, "PYTHONPATH": ROOT, "NUMBA_CACHE_DIR": str(cache)}
    command = [sys.executable, "-X", "faulthandler", "-c", PROGRAM, *map(str, (threads, tries, steps, int(prepared)))]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout)["refused"]


@pytest.fixture(scope="module")
def cache() -> str:
    """The kernels of the other tests."""
    return os.environ.get("NUMBA_CACHE_DIR", "")


@pytest.mark.parametrize(
    ("threads", "prepared"), sweep([(1, False), (1, True), (2, False), (2, True)], [(1, False), (2, True)])
)
def test_two_threads_step_one_world_a_hundred_times(threads, prepared, cache):
    """No crash, no hang: each call took a whole step or none, and the state is that of so many steps one by one."""
    assert together(cache, threads, tries=100, steps=50, prepared=prepared) > 0


@pytest.mark.exhaustive
@pytest.mark.parametrize("threads", [1, 2])
def test_also_where_the_first_step_compiles(threads, tmp_path):
    for k in range(5):
        assert together(tmp_path / str(k), threads, tries=1, steps=20, prepared=bool(k % 2)) > 0


TWO_PLANS = """
import sys, threading
import numpy as np
import physics

ball = [physics.Sphere(0.5, mass=1.0, linvel=(1, 2, 3))]
scenes = [physics.Scene(ball), physics.Scene(ball, effects=[physics.Gravity((0, -9.81, 0))]),
          physics.Scene(ball, effects=[physics.Drag(linear=0.1)])]
worlds, barrier = [None] * 3, threading.Barrier(3)

def go(k):
    barrier.wait()
    worlds[k] = physics.World(scenes[k], worlds=3, dt=0.01, accuracy="fast", threads=1 + k % 2)
    for _ in range(20):
        worlds[k].step()

all_ = [threading.Thread(target=go, args=(k,)) for k in range(3)]
[each.start() for each in all_]
[each.join() for each in all_]
for scene, world in zip(scenes, worlds):
    twin = physics.World(scene, worlds=3, dt=0.01, accuracy="fast")
    for _ in range(20):
        twin.step()
    assert np.array_equal(twin.state, world.state)
print("same")
"""


def test_worlds_of_several_plans_compile_in_several_threads(tmp_path, is_exhaustive):
    for k in range(4 if is_exhaustive else 1):
        environment = {**os.environ, "PYTHONPATH": ROOT, "NUMBA_CACHE_DIR": str(tmp_path / str(k % 2))}
        command = [sys.executable, "-X", "faulthandler", "-c", TWO_PLANS]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
        assert (done.returncode, done.stdout.strip()) == (0, "same"), done.stderr[-3000:]


EXIT = """
import sys, threading, time
import physics
scene = physics.Scene([physics.Sphere(0.5, mass=1.0, linvel=(1, 2, 3))], effects=[physics.Gravity((0, -9.81, 0))])
world = physics.World(scene, worlds=5000, dt=0.001, accuracy="fast", threads=int(sys.argv[1]))
world.step()

def go():
    while True:
        world.step()

threading.Thread(target=go, daemon=True).start()
time.sleep(0.2)
print("over")
"""


@pytest.mark.parametrize("threads", ["1", "2"])
def test_the_process_may_end_while_a_daemon_thread_steps(threads, cache, is_exhaustive):
    environment = {**os.environ, "PYTHONPATH": ROOT}
    for _ in range(3 if is_exhaustive else 1):
        command = [sys.executable, "-X", "faulthandler", "-c", EXIT, threads]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=100)
        assert (done.returncode, done.stdout.strip()) == (0, "over"), done.stderr[-3000:]
