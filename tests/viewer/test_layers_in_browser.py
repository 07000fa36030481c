"""Layers of the picture in a real browser, each in a scene that has something to draw, and the seed."""

from __future__ import annotations

import numpy as np
import pytest

import physics
from tests.viewer.user import user_of, wait_until

pytestmark = pytest.mark.exhaustive


def shore() -> physics.Scene:
    """A cube that sleeps on the shore, and one on a spring in the wind above it."""
    bodies = [
        physics.Block((1, 1, 1), 1.0, pos=(-1.5, 0.5, 0)),
        physics.Block((1, 1, 1), 1.0, pos=(1.5, 4.2, 0), linvel=(1.5, 0, 0)),
    ]
    fields = [physics.Drag(), physics.Wind((1, 0, 0)), physics.Buoyancy(density=1e-3, offset=0.5)]
    spring = physics.Spring(anchor=(1.5, 5, 0), point=(0, 0.5, 0), stiffness=20.0, body=1)
    effects = [physics.Gravity((0, -9.81, 0)), physics.Contact(), physics.Friction(0.5), *fields, spring]
    return physics.Scene(bodies, [physics.HalfSpace((0, 1, 0))], [*effects, physics.Sleeping()])


def swings(session) -> bool:
    """Take a step; whether one cube sleeps, and the other one is fast."""
    session.step()
    look = session.look()
    return look.is_asleep.tolist() == [True, False] and bool(np.linalg.norm(look.linvel[1]) > 0.7)


def test_layers_of_a_scene():
    with user_of(shore(), accuracy="fast") as user:
        user.ask(lambda session: [session.step() for _ in range(300)])
        user.until(swings)
        before = user.settled()
        user.choose("follow", "body 1")
        user.sees_change(before)
        user.choose("follow", "the room")
        user.sees_again(before)
        user.toggle_group("Show")
        for name in ("walls", "contacts", "forces", "velocities", "axes", "bounds", "sleeping", "fields"):
            user.check_layer(name)


def test_layers_and_the_seed_of_an_environment():
    with user_of("rigid_env/BlockReach-v0") as user:
        first = user.settled()
        user.until_told("episode 1", "return")
        user.fill("seed", "7")
        user.press("Reset")
        user.until(lambda session: session.seed == 7)
        user.sees_change(first)
        user.fill("seed", "0")
        user.press("Reset")
        user.until(lambda session: session.seed == 0)
        user.sees_again(first)
        user.ask(lambda session: [session.step() for _ in range(25)])
        user.toggle_group("Show")
        for name in ("applied", "goal"):
            user.check_layer(name)
        total = user.ask(lambda session: session.subject.message)
        wait_until(user.page, lambda: total in user.status)
