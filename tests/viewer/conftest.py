"""Sessions and controls that tests of the viewer share. Scenes and presets are those that other tests compile, too."""

from __future__ import annotations

import numpy as np

from rigid_env.viewer.session import Session
from rigid_env.viewer.subject import open_subject


def session_of(what, **arguments) -> Session:
    """A session whose kernels are there."""
    session = Session(open_subject(what, **arguments))
    session.wait()
    return session


def state_of(session: Session) -> np.ndarray:
    """Everything that moves in a session's world, copied."""
    return session.subject.world.state.copy()


def take(session: Session, steps: int) -> None:
    for _ in range(steps):
        assert session.step(), session.message


class Handle:
    """A control that nobody sees."""

    def __init__(self, **values):
        vars(self).update(values)
        self.acts = []

    def on_click(self, act):
        self.acts.append(act)

    on_update = on_click
