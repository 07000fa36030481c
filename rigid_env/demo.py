"""What `rigid-env demo` does: simulate a scene, tell what happened, and draw it."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

import physics
from physics import checks, scenes
from rigid_env.picture import stroboscope, without_bodies, world_frame, write_gif, write_png
from rigid_env.rendering import Frame, Renderer

SAMPLE_DT = 0.01  # [s]
FRAME_SAMPLES = 4  # samples per picture of the GIF: 25 pictures a second
PICTURE_SIZE = (960, 600)  # [px]
GIF_SIZE = (640, 400)  # [px]
STROBES = 7  # positions in the picture
SIGHT = 100.0  # further from the origin than this no wall is drawn [m]
SEEN_SPEED = 0.05  # below which nothing seems to move [m/s, rad/s]
REST_SPEED = 1e-6  # below which a body is at rest [m/s, rad/s]
SHOWN_EVENTS = 24


class Demo:
    """One scene, simulated for a while.

    Parameters
    ----------
    name : str
        Of a canonical scene, see `physics.scenes`, or of `scene`.
    duration : float
        Rounded to whole samples of `SAMPLE_DT` [s].
    accuracy : str
        Preset.
    scene : physics.Scene, optional
        Instead of the canonical one.

    Raises
    ------
    ValueError
        An unknown scene or accuracy, or a negative duration.
    """

    def __init__(self, name: str, duration: float, accuracy: str, scene: physics.Scene | None = None):
        self.scene = scenes.by_name(name) if scene is None else scene
        self._sample_count = round(float(checks.non_negative(duration, (), "duration")) / SAMPLE_DT)
        self.name, self.duration, self.accuracy = name, self._sample_count * SAMPLE_DT, accuracy
        self.trajectory = physics.simulate(self.scene, self.duration, accuracy, sample_dt=SAMPLE_DT)
        self.world = physics.World(self.scene, dt=SAMPLE_DT, accuracy=accuracy)
        self.start = self.world.snapshot()
        self._is_far = bool(np.abs(self.world.pos).max() > SIGHT)
        self._replay(self._sample_count)

    def _replay(self, samples: int) -> None:
        """Take the world from the start to a sample of the trajectory, with the same steps."""
        self.world.restore(self.start)
        for _ in range(samples):
            self.world.step()

    # --- numbers -------------------------------------------------------------------------------------------

    def events(self) -> list[dict]:
        """What happened, equal things at the same time counted."""
        keys = [(round(e.t, 9), e.kind, e.body, e.wall, e.other) for e in self.trajectory.events]
        return [
            {"t": t, "kind": kind, "body": body, "wall": wall, "other": other, "count": len(list(group))}
            for (t, kind, body, wall, other), group in itertools.groupby(keys)
        ]

    def summary(self) -> dict:
        """Everything that is printed, JSON-able."""
        trajectory, world = self.trajectory, self.world
        points, forces = world.contacts()
        energy = trajectory.energy.sum(axis=1)
        moving = max(np.abs(trajectory.linvel[-1]).max(), np.abs(trajectory.angvel[-1]).max())
        status = max((int(report.status[0]) for report in trajectory.reports), key=physics.Status.severity, default=0)
        last = {name: getattr(trajectory, name)[-1].tolist() for name in ("pos", "quat", "linvel", "angvel")}
        return {
            "scene": self.name,
            "accuracy": self.accuracy,
            "duration": self.duration,
            "sample_dt": SAMPLE_DT,
            "energy": {
                "start": float(energy[0]), "end": float(energy[-1]),
                "dissipated": float(energy[0] - energy[-1]),
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
    def frame_count(self) -> int:
        """Pictures of the GIF."""
        return self._sample_count // FRAME_SAMPLES + 1

    def write_gif(self, path: Path, tick: Callable[[], None]) -> None:
        """Draw and write the animation; `tick` is called once per picture."""
        renderer = Renderer(*GIF_SIZE)
        self.world.restore(self.start)
        pictures = []
        for k in range(self.frame_count):
            if k > 0:
                for _ in range(FRAME_SAMPLES):
                    self.world.step()
            pictures.append(renderer.draw(self._frame(f"t = {self.world.time:.2f} s")))
            tick()
        renderer.close()
        write_gif(path, pictures, 1.0 / (SAMPLE_DT * FRAME_SAMPLES))

    def write_png(self, path: Path) -> None:
        """Draw and write the stroboscopic picture: where the bodies were, and how they end."""
        renderer = Renderer(*PICTURE_SIZE)
        pictures = []
        for sample in np.linspace(0, self._last_motion(), STROBES).astype(int):
            self._replay(int(sample))
            frame = replace(self._frame(), contact_points=(), contact_forces=())
            pictures.append(renderer.draw(frame))
        self._replay(self._sample_count)
        frame = self._frame(f"{self.name}, t = 0 .. {self.world.time:g} s")
        pictures.append(renderer.draw(frame))
        empty = without_bodies(frame, renderer.camera(frame))
        write_png(path, stroboscope(pictures, renderer.draw(empty)))
        renderer.close()

    def _last_motion(self) -> int:
        """Last sample at which a body still moved in a way that one sees."""
        speed = np.maximum(np.abs(self.trajectory.linvel), np.abs(self.trajectory.angvel)).max(axis=(1, 2))
        moving = np.flatnonzero(speed > SEEN_SPEED)
        return int(moving[-1]) if len(moving) else 0

    def _frame(self, *text: str) -> Frame:
        """The world now; far from the walls the picture is without them and travels with body 0."""
        frame = world_frame(self.world, text=text)
        if not self._is_far:
            return frame
        origin = frame.bodies[0].pos
        bodies = tuple(replace(body, pos=body.pos - origin) for body in frame.bodies)
        return replace(frame, bodies=bodies, walls=())


def show(demo: Demo, summary: dict, console: Console) -> None:
    """Print what happened."""
    console.print(f"[bold]{demo.name}[/bold], accuracy {demo.accuracy}, {demo.duration:g} s")
    console.print(_event_table(summary["events"]))
    energy = summary["energy"]
    console.print(
        f"energy      {energy['start']:.4f} J at the start, {energy['end']:.4f} J at the end, "
        f"{energy['dissipated']:.4f} J dissipated"
    )
    final = summary["final"]
    for name, unit in (("pos", "m"), ("quat", ""), ("linvel", "m/s"), ("angvel", "rad/s")):
        for values in final[name]:
            console.print(f"{name:<11} ({_numbers(values)}) {unit}")
    console.print("at rest     " + ("yes" if final["is_at_rest"] else "no"))
    for point, force in zip(summary["contacts"]["points"], summary["contacts"]["forces"]):
        console.print(f"contact     ({_numbers(point)}) m, force ({_numbers(force)}) N")
    status = summary["status"]
    colour = "green" if status["name"] == "ok" else "yellow"
    console.print(f"status      [{colour}]{status['name']}[/{colour}]: {status['message']}")
    console.print(
        f"            {status['solves']} contact problems, {status['iterations']} sweeps, "
        f"{status['fallbacks']} by pivoting, {status['unconverged']} above the tolerance; "
        f"worst residual {status['residual']:.2g}, deepest penetration {status['penetration']:.2g} m"
    )


def _event_table(events: list[dict]) -> Table:
    table = Table(title="events", title_justify="left", box=box.SIMPLE_HEAD)
    for name in ("time [s]", "what", "body", "wall", "other"):
        table.add_column(name, justify="left" if name == "what" else "right")
    for event in events[:SHOWN_EVENTS]:
        times = f" x {event['count']}" if event["count"] > 1 else ""
        who = [str(event[name]) if event[name] >= 0 else "-" for name in ("body", "wall", "other")]
        table.add_row(f"{event['t']:.2f}", event["kind"] + times, *who)
    if len(events) > SHOWN_EVENTS:
        table.caption = f"and {len(events) - SHOWN_EVENTS} more; --json has all"
    return table


def _numbers(values) -> str:
    """To four decimals, without negative zeros."""
    return ", ".join(f"{round(value, 4) + 0.0:.4f}" for value in values)
