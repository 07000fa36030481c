"""Subjects whose motion is known: a recording, which is simulated again, and a saved trajectory."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable

import numpy as np

import physics
from physics import Contact, Event
from physics.rotations import rotation_matrices
from rigid_env.rendering import BodyView, Frame, WallView
from rigid_env.rendering.compounds import part_views
from rigid_env.viewer.copies import warm
from rigid_env.viewer.interface import Can, Look, Subject
from rigid_env.viewer.worlds import WorldSubject


class PlayedRecording(WorldSubject):
    """Recording that is simulated again, call by call; the user cannot change it.

    Parameters
    ----------
    recording : physics.Recording
        Recording of at least one call of `World.step`.
    name : str
        Short name for titles.
    """

    can = Can(ghost=True)

    def __init__(self, recording: physics.Recording, name: str):
        if not len(recording):
            raise ValueError("recording holds no step; allowed is one of at least one step")
        super().__init__(recording.world(), name)
        self._recording, self._call = recording, 0
        self._starts = {start.step: start.snapshot for start in recording.starts}
        self._steppers: dict[tuple[int, float], physics.Stepper] = {}
        self._times = self.world.time + np.concatenate(([0.0], np.cumsum(recording.steps * recording.dt)))
        self._first = self.snapshot()

    @property
    def time(self) -> float:
        """Time of the first state plus all steps since [s]; a reset within the recording does not set it back."""
        return float(self._times[self._call])

    @property
    def _shift(self) -> float:
        return self.time - self.world.time

    @property
    def interval(self) -> float:
        return float(self._recording.steps[self._call] * self._recording.dt[self._call])

    @property
    def end(self) -> float:
        """Time after the last call [s]."""
        return float(self._times[-1])

    @property
    def is_over(self) -> bool:
        return self._call == len(self._recording)

    @property
    def message(self) -> str:
        """Reason for which the recording was kept."""
        return f"recorded: {self._recording.reason}"

    def restart(self, seed: int) -> None:
        self.restore(self._first)

    def step(self, load=None, record=None):
        recording, k = self._recording, self._call
        self.listener.begin()
        if k in self._starts and k:
            self.world.restore(self._starts[k])
        steps, dt = int(recording.steps[k]), float(recording.dt[k])
        if (steps, dt) not in self._steppers:
            self._steppers[steps, dt] = physics.Stepper(self.world, steps, dt)
        stepper = self._steppers[steps, dt]
        stepper.wrench[0] = recording.wrenches[k]  # not by `World.step`, which refuses a wrench that is not finite
        with recording.past_actuator(self.world, k):
            stepper()
        self._call += 1

    def _take(self) -> tuple[int, physics.Snapshot]:
        return self._call, self.world.snapshot()

    def _put(self, state: tuple[int, physics.Snapshot], is_other: bool = False) -> None:
        self._call, snapshot = state
        self.world.restore(snapshot)

    def rehearsal(self) -> Callable[[], None]:
        world = self._recording.world()
        return lambda: warm(world)


class PlayedTrajectory(Subject):
    """Trajectory whose samples are shown one after the other.

    Parameters
    ----------
    trajectory : physics.Trajectory
        Trajectory with its scene.
    name : str
        Short name for titles.

    Raises
    ------
    ValueError
        The trajectory has no scene.
    """

    def __init__(self, trajectory: physics.Trajectory, name: str):
        if trajectory.scene is None:
            raise ValueError(
                f"trajectory is {name}, which holds no scene, so that its bodies have no shape; allowed are those of "
                "physics.simulate, and files that this version has written"
            )
        self.name, self._trajectory, self._sample = name, trajectory, 0
        self._bodies = self.scene.bodies
        self._events = sorted(trajectory.events, key=lambda event: event.t)
        self._mass = np.array([0.0 if body.fixed else body.mass for body in self._bodies])
        self._inertia = np.array([np.zeros((3, 3)) if body.fixed else body.inertia for body in self._bodies])
        self._radius = np.array([_radius(body) for body in self._bodies])
        walls = self.scene.walls if self.scene.effect(Contact) else ()
        self._walls = tuple(WallView(wall.normal, wall.offset) for wall in walls)

    @property
    def scene(self) -> physics.Scene:
        return self._trajectory.scene

    @property
    def time(self) -> float:
        return float(self._trajectory.t[self._sample])

    @property
    def interval(self) -> float:
        return float(self._trajectory.t[self._sample + 1]) - self.time

    @property
    def end(self) -> float:
        """Time of the last sample [s]."""
        return float(self._trajectory.t[-1])

    @property
    def is_over(self) -> bool:
        return self._sample + 1 == len(self._trajectory.t)

    def restart(self, seed: int) -> None:
        self._sample = 0

    def step(self, load=None, record=None):
        self._sample += 1

    def snapshot(self) -> int:
        return self._sample

    def restore(self, snapshot: int) -> None:
        self._sample = snapshot

    def frame(self) -> Frame:
        pos, quat = self._trajectory.pos[self._sample], self._trajectory.quat[self._sample]
        return Frame([_view(*each) for each in zip(self._bodies, pos, quat)], self._walls)

    def look(self) -> Look:
        trajectory, k = self._trajectory, self._sample
        asleep = np.zeros(len(self._bodies), dtype=np.bool_)
        return Look(self.frame(), self.time, trajectory.linvel[k], trajectory.angvel[k], asleep, self._radius)

    def measure(self) -> dict[str, float]:
        trajectory, k = self._trajectory, self._sample
        linvel, angvel = trajectory.linvel[k], trajectory.angvel[k]
        momentum = self._mass[:, None] * linvel
        spin = np.einsum("bji,bj->bi", rotation_matrices(trajectory.quat[k]), angvel)
        kinetic = 0.5 * float(np.sum(momentum * linvel) + np.einsum("bi,bij,bj->", spin, self._inertia, spin))
        energy = float(trajectory.energy[k].sum())
        found = {
            "kinetic_energy": kinetic, "potential_energy": energy - kinetic, "energy": energy,
            "momentum": float(np.linalg.norm(momentum.sum(axis=0))),
        }  # fmt: skip
        if trajectory.reports and k:
            report = trajectory.reports[k - 1]
            found |= {"penetration": float(report.penetration[0]), "residual": float(report.residual[0])}
        return found

    def events(self) -> list[Event]:
        before = self._trajectory.t[self._sample - 1] if self._sample else -np.inf
        first, last = (bisect_right(self._events, t, key=lambda event: event.t) for t in (before, self.time))
        return self._events[first:last]


def _radius(body: physics.Body) -> float:
    return float(body.bounding_radius(body.dimensions)) + float(np.linalg.norm(body.center))


def _view(body: physics.Body, pos: np.ndarray, quat: np.ndarray) -> BodyView:
    """View of a body for pictures, from the position `pos` of its centre of mass [m] and its attitude `quat`."""
    dimensions = 2.0 * body.dimensions if body.kind == "block" else body.dimensions
    outline = {} if body.kind != "hull" else {"corners": body.polyhedron.vertices, "faces": body.polyhedron.loops}
    centre = pos + rotation_matrices(quat) @ np.array(body.center)
    return BodyView(body.kind, dimensions, centre, quat, **outline, parts=part_views(body))
