"""Soak random scenes in many processes, each with a seed of its own."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from pathlib import Path

from rigid_env.launchers.job import Ended, Job, shell_line

MERGED = {"worlds": sum, "steps": sum, "largest_gain": max, "told": sum, "left_after_told": sum}


def make_jobs(
    minutes: float, seeds: Iterable[int], presets: Iterable[str], keep: Path | None, folder: Path
) -> list[Job]:
    """Make a job for each seed and preset, `minutes` long; its recordings go into ``keep/SEED``."""
    return [_make_job(minutes, seed, preset, keep and keep / str(seed), folder) for seed in seeds for preset in presets]


def _make_job(minutes: float, seed: int, preset: str, keep: Path | None, folder: Path) -> Job:
    options = {"minutes": minutes, "seed": seed, "accuracy": preset, "keep": keep}
    line = shell_line("python", "-m", "benchmarks.soak", **options, json=folder / f"{preset}-{seed}.json")
    return Job(f"{preset}, seed {seed}", partial(_soak, minutes, seed, preset, keep), line)


def _soak(minutes: float, seed: int, preset: str, keep: Path | None) -> tuple[str, dict]:
    from benchmarks.soak import soak_scenes

    return preset, soak_scenes(60.0 * minutes, seed, preset, keep, lambda what: None)


def merge(ends: Iterable[Ended]) -> tuple[dict, list[str]]:
    """Add up what jobs found, by preset and family of scenes, and list the errors of jobs that ended with one."""
    found: dict[str, dict] = {}
    errors = []
    for name, result, error, _ in ends:
        if result is None:
            errors.append(f"{name}: {error}")
            continue
        preset, families = result
        for family, one in families.items():
            total = found.setdefault(preset, {}).setdefault(family, {"failures": {}, **dict.fromkeys(MERGED, 0)})
            for what, rule in MERGED.items():
                total[what] = rule((total[what], one[what]))
            for kind, count in one["failures"].items():
                total["failures"][kind] = total["failures"].get(kind, 0) + count
    return found, errors
