"""Measure error against computing time on known scenes, for `rigid-env accuracy` and `benchmarks.accuracy`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import physics
from physics import scenes, validation
from physics.keywords import nearest_first
from physics.work_precision import run as frontier_run
from physics.work_precision.contender import OURS, Contender, EngineContender
from physics.work_precision.run import REPEATS, STEPS
from rigid_env.lab.measure import peers
from rigid_env.lab.measure.truths import CASES, Case
from rigid_env.tasks.scene_source import ENDINGS, SCENE_FILES, find_scene

# Other engines are measured at smaller steps, too, since they are more accurate there.
PEER_STEPS = (*STEPS, 0.0005)  # [s]

# Scenes without a closed form that are measured by default, and their durations [s].
OPEN = {"drop": 3.0, "corner_drop": 3.0, "vertex_drop": 2.0}
DURATION = 2.0  # duration of other scenes without a closed form [s]

Tick = Callable[[str], None]


@dataclass(frozen=True)
class Ladder:
    """Accuracies and steps that are measured for each scene.

    Attributes
    ----------
    accuracies : tuple of str
        Presets of our engine.
    steps : tuple of float, or None
        Steps of our engine [s]; None: those of `physics.ladder`, with larger ones for event-driven accuracies.
    peer_steps : tuple of float
        Steps of other engines [s].
    repeats : int
        Repeats of each timing.
    """

    accuracies: tuple[str, ...] = frontier_run.SHOWN_PRESETS
    steps: tuple[float, ...] | None = None
    peer_steps: tuple[float, ...] = PEER_STEPS
    repeats: int = REPEATS


QUICK = Ladder(steps=STEPS[:2], peer_steps=STEPS[:1], repeats=1)


@dataclass(frozen=True)
class Job:
    """Scene with the contenders that are measured on it.

    Attributes
    ----------
    key, what : str
        Name for programs, and description for people.
    scene : Scene
    duration : float
        Simulated time [s].
    case : Case or None
        Known outcome of the scene; None: no closed form, compared with our reference.
    contenders : tuple of Contender
        Engines, each at one setting and one step.
    skipped : tuple of str
        Reasons for which other engines, or some of their settings, do not take part.
    """

    key: str
    what: str
    scene: physics.Scene
    duration: float
    case: Case | None
    contenders: tuple[Contender, ...]
    skipped: tuple[str, ...]

    @property
    def goals(self) -> tuple[tuple[float, float], ...]:
        """Goals (error, µs per simulated second); one setting must reach both numbers of a goal."""
        return self.case.goals if self.case else ()


@dataclass(frozen=True)
class Found:
    """Measurements of one `Job`."""

    job: Job
    frontier: physics.Frontier

    def goals_met(self) -> list[tuple[float, float, physics.FrontierPoint | None]]:
        """Goals (error, µs) of the job, each with the quickest setting of our engine that reaches it, or None."""
        met = []
        for error, us in self.job.goals:
            point = self.frontier.cheapest(error, engine=OURS)
            met.append((error, us, point if point and 1e6 * point.cost <= us else None))
        return met

    def to_dict(self) -> dict:
        """Scene, points and settings as a dict for JSON."""
        content = self.frontier.to_dict()
        goals = [
            {"error": error, "us": us, "reached_by": None if point is None else str(point)}
            for error, us, point in self.goals_met()
        ]
        orders = [
            {
                "setting": setting, "order": self.frontier.order(setting), "plateau": self.frontier.plateau(setting),
                "lost_from": self.frontier.lost_from(setting),
            }
            for engine, setting in self.frontier.families() if engine == OURS
        ]  # fmt: skip
        about = {"case": self.job.key, "what": self.job.what, "goals": goals, "settings": orders}
        return {**content, **about, "skipped": [*self.job.skipped, *self.frontier.skipped]}


def names() -> list[str]:
    """Names of all scenes that can be measured, those with a closed form first.

    Canonical scenes with several bodies are not among them: their truth would be an event-driven preset, which does not
    support bodies that touch each other.
    """
    known = [case.key for case in CASES]
    alone = (name for name in scenes.SCENES if len(scenes.by_name(name).bodies) == 1)
    return known + [name for name in alone if name not in known]


def load_peers(wanted: Sequence[str], tell: Tick = lambda what: None) -> dict[str, peers.Engine]:
    """Load those of the other engines `wanted` that are installed; `tell` is called with a text for each missing one.

    Raises
    ------
    ValueError
        There is no engine of such a name.
    """
    found = {}
    for name in wanted:
        try:
            found[name] = peers.load(name)
        except ModuleNotFoundError as error:
            tell(f"skipped: {error}")
    return found


def make_jobs(
    wanted: Sequence[str] = (),
    engines: Mapping[str, peers.Engine] | None = None,
    ladder: Ladder | None = None,
    duration: float | None = None,
) -> list[Job]:
    """Prepare scenes for their measurement.

    Parameters
    ----------
    wanted : sequence of str
        Names from `names`, or scene files; empty: the scenes with a closed form, and `OPEN`.
    engines : mapping of str to Engine, optional
        Other engines that are measured, too.
    ladder : Ladder, optional
    duration : float, optional
        Duration of scenes without a closed form [s]; None: that of `OPEN`, or `DURATION`.

    Raises
    ------
    ValueError
        There is no such scene, a file has a mistake, or the duration is not positive.
    """
    if duration is not None:
        duration = float(validation.positive(duration, (), "duration"))
    unknown = sorted(name for name in set(wanted) - set(names()) if not _is_file(name))
    if unknown:
        told = f"scene is {', '.join(map(repr, unknown))}; allowed are {', '.join(nearest_first(unknown[0], names()))}"
        raise ValueError(f"{told}, or a scene file ({ENDINGS})")
    chosen = list(dict.fromkeys(wanted)) or [*(case.key for case in CASES), *OPEN]
    return [_make_job(name, engines or {}, ladder or Ladder(), duration) for name in chosen]


def run_count(jobs: Sequence[Job], ladder: Ladder) -> int:
    """Number of calls of `tick` by an uninterrupted `run`."""
    return sum(1 + len(job.contenders) * (1 + ladder.repeats) for job in jobs)


def run(jobs: Sequence[Job], ladder: Ladder, tick: Tick = lambda what: None) -> Iterator[Found]:
    """Measure jobs one by one, and yield the measurements of each.

    An interruption ends the run; the finished part of the current job is still yielded. `tick` is called with a text.
    """
    for job in jobs:
        truth = job.case.truth() if job.case else None

        def tell(done: int, total: int, what: str, key: str = job.key) -> None:
            tick(f"{key}: {what}")

        try:
            found = frontier_run.measure(job.contenders, job.scene, job.duration, truth, ladder.repeats, tell)
        except KeyboardInterrupt:  # interrupted before the truth was computed
            return
        if found.points:
            yield Found(job, found)
        if not found.is_complete:
            return


def _is_file(name: str) -> bool:
    return Path(name).suffix.lower() in SCENE_FILES or Path(name).is_file()


def _make_job(name: str, engines: Mapping[str, peers.Engine], ladder: Ladder, duration: float | None) -> Job:
    case = next((case for case in CASES if case.key == name), None)
    scene = case.scene() if case else find_scene(name).scene
    duration = case.duration if case else duration or OPEN.get(name, DURATION)
    title = f"{duration:g} s" if _is_file(name) else f"{name}, {duration:g} s"
    what = case.what if case else f"{title}: largest error of any point of a body"
    settings = physics.ladder(ladder.accuracies, ladder.steps)
    ours = [EngineContender(scene, physics.PRESETS[a], dt) for a, dt in settings]
    theirs, skipped = [], []
    for engine in engines.values():
        some, reasons = _peer_contenders(engine, scene, ladder.peer_steps)
        theirs += some
        skipped += reasons
    return Job(name, what, scene, duration, case, (*ours, *theirs), tuple(skipped))


def _peer_contenders(engine: peers.Engine, scene: physics.Scene, steps: Sequence[float]) -> tuple[list, list[str]]:
    found, reasons = [], []
    ours_alone = (physics.Field, physics.RollingFriction, physics.SpinFriction)
    contact = scene.effect(physics.Contact)
    friction = scene.effect(physics.Friction)
    is_ours = (contact and (contact.tangential or contact.stiffness)) or (friction and friction.axis is not None)
    if is_ours or any(isinstance(effect, ours_alone) for effect in scene.effects):
        return [], [f"{engine.name}: it is not given the scene's fields and laws of contact"]
    for setting, options in engine.settings(scene).items():
        try:
            engine.open(scene, steps[0], **options)
        except peers.Unsupported as error:
            reasons.append(f"{engine.name} {setting}: {error}")
            continue
        found += [peers.PeerContender(engine, scene, setting, options, dt) for dt in steps]
    return found, reasons
