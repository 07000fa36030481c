"""Run of one scene for `rigid-env demo` and `rigid-env run`, with its numbers, picture and animation."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

import physics
from physics import scenes, validation
from rigid_env.rendering import Frame, Renderer
from rigid_env.rendering.picture import stroboscope, without_bodies, world_frame, write_gif, write_png
from rigid_env.rendering.staging import CHOSEN, Shot, Stage

SAMPLE_DT = 0.01  # default step, which is also the time between samples [s]
FRAME_TIME = 0.04  # least time between pictures of the GIF, which counts in hundredths of a second [s]
GIF_TICK = 0.01  # [s]
LARGEST_GIF = 600  # most pictures; a longer motion is played faster
PICTURE_SIZE = (960, 600)  # [px]
GIF_SIZE = (640, 400)  # [px]
STROBES = 7  # positions of each body in the stroboscopic picture
SEEN_SPEED = 0.05  # speed below which a body does not seem to move [m/s, rad/s]
REST_SPEED = 1e-6  # speed below which a body is at rest [m/s, rad/s]


def energy_sources(scene: physics.Scene) -> list[str]:
    """Names of effects of a scene that may give energy to its bodies; their work is not counted.

    These are fields that do not say that they take energy or leave it (`Field.takes_energy`). Springs between bodies
    are none of them: both ends are bodies of the scene. The work of driven bodies is counted.
    """
    fields = (each for each in scene.effects if isinstance(each, physics.Field))
    giving = (each for each in fields if each.takes_energy is None and not each.kind.is_linked)
    return list(dict.fromkeys(type(each).__name__ for each in giving))


class Demo:
    """One scene, simulated for a given time.

    Parameters
    ----------
    name : str
        Name of a canonical scene, see `physics.scenes`, or a name for `scene`.
    duration : float
        Simulated time, rounded to whole steps [s].
    accuracy : str
        Name of a preset.
    scene : physics.Scene, optional
        Scene that is simulated instead of the canonical one.
    dt : float
        Step, which is also the time between samples [s].

    Raises
    ------
    ValueError
        An unknown scene or accuracy, a negative duration, or a step that is not positive.
    """

    def __init__(
        self, name: str, duration: float, accuracy: str, scene: physics.Scene | None = None, dt: float = SAMPLE_DT
    ):
        self.scene = scenes.by_name(name) if scene is None else scene
        self.dt = float(validation.positive(dt, (), "dt"))
        self._sample_count = round(float(validation.non_negative(duration, (), "duration")) / self.dt)
        self.name, self.duration, self.accuracy = name, self._sample_count * self.dt, accuracy
        self.trajectory = physics.simulate(self.scene, self.duration, accuracy, sample_dt=self.dt)
        self.world = physics.World(self.scene, dt=self.dt, accuracy=accuracy)
        self.start, self._sample = self.world.snapshot(), 0
        self._go_to(self._sample_count)

    def _go_to(self, sample: int) -> None:
        """Bring the world to the state of a sample of the trajectory, by repeating the same steps."""
        if sample < self._sample:
            self.world.restore(self.start)
            self._sample = 0
        for _ in range(sample - self._sample):
            self.world.step()
        self._sample = sample

    # --- numbers -------------------------------------------------------------------------------------------

    def events(self) -> list[dict]:
        """Events of the run as dicts; equal events at the same time are joined, with their number under `count`."""
        found: list[dict] = []
        for event in self.trajectory.events:
            content = {key: list(value) if isinstance(value, tuple) else value for key, value in asdict(event).items()}
            content["t"] = round(event.t, 9)
            if found and all(found[-1][key] == value for key, value in content.items()):
                found[-1]["count"] += 1
            else:
                found.append({**content, "count": 1})
        return found

    def summary(self) -> dict:
        """All numbers that the commands print, as a dict for JSON."""
        trajectory, world = self.trajectory, self.world
        points, forces = world.contacts()
        energy, sources = trajectory.energy.sum(axis=1), energy_sources(self.scene)
        work = float(sum(report.driven_work[0] for report in trajectory.reports))
        moving = max(np.abs(trajectory.linvel[-1]).max(), np.abs(trajectory.angvel[-1]).max())
        status = max((int(report.status[0]) for report in trajectory.reports), key=physics.Status.severity, default=0)
        last = {name: getattr(trajectory, name)[-1].tolist() for name in ("pos", "quat", "linvel", "angvel")}
        return {
            "scene": self.name,
            "accuracy": self.accuracy,
            "duration": self.duration,
            "sample_dt": self.dt,
            "energy": {
                "start": float(energy[0]), "end": float(energy[-1]),
                "driven_work": work, "dissipated": None if sources else float(energy[0] + work - energy[-1]),
                "sources": sources,
            },
            "final": {**last, "is_at_rest": bool(moving < REST_SPEED)},
            "contacts": {
                "points": points.tolist(), "forces": forces.tolist(),
                "total_force": forces.sum(axis=0).tolist(),
            },
            "status": {
                "name": physics.Status(status).name.lower(), "message": physics.Status(status).message,
                **self._effort(),
            },
            "events": self.events(),
        }  # fmt: skip

    def _effort(self) -> dict:
        reports = self.trajectory.reports
        counts = ("impacts", "solves", "iterations", "fallbacks", "unconverged", "unresolved", "faults")
        totals = {name: int(sum(getattr(report, name)[0] for report in reports)) for name in counts}
        worst = {
            name: float(max((getattr(report, name)[0] for report in reports), default=0.0))
            for name in ("penetration", "residual")
        }
        return {**totals, **worst}

    # --- pictures ------------------------------------------------------------------------------------------

    @property
    def frame_time(self) -> float:
        """Simulated time between two pictures of the GIF [s]."""
        least = max(FRAME_TIME, self.dt, self.duration / LARGEST_GIF)
        return math.ceil(least / GIF_TICK - 1e-9) * GIF_TICK

    @property
    def frame_count(self) -> int:
        """Number of pictures in the GIF."""
        return math.floor(self.duration / self.frame_time + 1e-9) + 1

    @property
    def speed(self) -> float:
        """Simulated seconds that the GIF shows in one second."""
        return 1.0 if self.duration <= LARGEST_GIF * FRAME_TIME else self.frame_time / FRAME_TIME

    def write_picture(self, path: Path, tick: Callable[[], None] = lambda: None, shot: Shot = CHOSEN) -> None:
        """Write a PNG or a GIF, by the ending of `path`; `tick` is called for each picture of a GIF."""
        if path.suffix.lower() == ".gif":
            self.write_gif(path, tick, shot)
        else:
            self.write_png(path, shot)

    def write_gif(self, path: Path, tick: Callable[[], None], shot: Shot = CHOSEN) -> None:
        """Draw and write the animation as a GIF; `tick` is called for each picture."""
        stage = self._stage()
        renderer = Renderer(*GIF_SIZE, camera=stage.camera(shot), bounds=stage.bounds)
        pictures = []
        for k in range(self.frame_count):
            self._go_to(min(round(k * self.frame_time / self.dt), self._sample_count))
            pictures.append(renderer.draw(self._frame(stage, f"t = {self.world.time:.2f} s", shot)))
            tick()
        renderer.close()
        write_gif(path, pictures, self.speed / self.frame_time)

    def write_png(self, path: Path, shot: Shot = CHOSEN) -> None:
        """Draw and write the stroboscopic picture as a PNG: earlier positions of the bodies, and the last one."""
        stage = self._stage()
        renderer = Renderer(*PICTURE_SIZE, camera=stage.camera(shot), bounds=stage.bounds)
        pictures = []
        for sample in np.linspace(0, self._last_motion(), STROBES).astype(int):
            self._go_to(int(sample))
            frame = replace(stage.place(world_frame(self.world)), contact_points=(), contact_forces=())
            pictures.append(renderer.draw(frame))
        self._go_to(self._sample_count)
        frame = self._frame(stage, f"{self.name}, t = 0 .. {self.world.time:g} s", shot)
        pictures.append(renderer.draw(frame))
        empty = without_bodies(frame, renderer.camera(frame))
        write_png(path, stroboscope(pictures, renderer.draw(empty)))
        renderer.close()

    def _last_motion(self) -> int:
        """Index of the last sample at which a body still moved visibly."""
        speed = np.maximum(np.abs(self.trajectory.linvel), np.abs(self.trajectory.angvel)).max(axis=(1, 2))
        moving = np.flatnonzero(speed > SEEN_SPEED)
        return int(moving[-1]) if len(moving) else 0

    def _frame(self, stage: Stage, text: str, shot: Shot) -> Frame:
        share = self._sample / self._sample_count if self._sample_count else 1.0
        return stage.place(world_frame(self.world, text=[text, *stage.notes], arrows=shot.arrows), share)

    def _stage(self) -> Stage:
        return Stage(self.scene, world_frame(self.world), self.trajectory.pos)
