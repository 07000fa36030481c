"""Commands that measure: speed, costs of effects, accuracy, tosses, hard cases."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rigid_env.cli.common import Accuracy, Json, app, progress_bar, tell_file, told_errors, write

BENCH_REPEATS = 5
QUICK_REPEATS = 2
INTERRUPTED = 130  # exit status, as a shell gives it


@app.command()
def bench(
    json: Json = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only see that it runs.")] = False,
) -> None:
    """Measure steps per second, beside MuJoCo if it is installed."""
    with told_errors():
        from rigid_env.measure import environments, mujoco_scene, rows, workloads
        from rigid_env.measure.table import make_console, make_table

        console = make_console()
        has_peer = mujoco_scene.is_installed()
        repeats = QUICK_REPEATS if quick else BENCH_REPEATS
        sizes, env_sizes = ((module.QUICK if quick else module.FULL) for module in (workloads, environments))
        path = json.resolve() if json else None
        total = rows.run_count(repeats, has_peer) + environments.run_count(repeats, with_peer=False)
        found = []
        with progress_bar(console, has_thread=False) as progress, mujoco_scene.elsewhere():
            task = progress.add_task("measuring", total=total)

            def tick(what: str) -> None:
                progress.update(task, advance=1, description=what, refresh=True)

            for some in rows.engine_rows(sizes, repeats, has_peer, tick):
                found += some
            for some in environments.environment_rows(env_sizes, repeats, tick=tick):
                found += some
        console.print(make_table(found, "steps per second: median, lowest .. highest"))
        if not has_peer:
            console.print('for ratios to MuJoCo: pip install "rigid-env[bench]"', markup=False)
        write(path, {"is_quick": quick, "rows": [row.to_dict() for row in found]}, console)


@app.command()
def effects(
    effect: Annotated[list[str] | None, typer.Argument(help="Effects, as in the table; none: all of them.")] = None,
    accuracy: Accuracy = "balanced",
    json: Json = None,
    markdown: Annotated[Path | None, typer.Option(metavar="FILE", help="Put the table into this page, too.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only see that it runs.")] = False,
) -> None:
    """Measure what each effect costs: steps per second of its scene with it and without."""
    with told_errors():
        from physics import accuracy as knobs
        from rigid_env.measure import effects as costs
        from rigid_env.measure.table import make_console, make_table

        knobs.resolve(accuracy)
        names = costs.chosen(effect or (), markdown)
        console, path = make_console(), json.resolve() if json else None
        repeats, steps = (QUICK_REPEATS, costs.QUICK_STEPS) if quick else (BENCH_REPEATS, costs.STEPS)
        found = []
        with progress_bar(console, has_thread=False) as progress:
            task = progress.add_task("measuring", total=costs.run_count(len(names), repeats))

            def tick(what: str) -> None:
                progress.update(task, advance=1, description=what, refresh=True)

            for name in names:
                found.append(costs.effect_row(name, accuracy, steps, repeats, tick))
        console.print(make_table(found, "steps per second with the effect, against the scene without it"))
        if markdown is not None:
            costs.write_markdown(markdown, found, accuracy)
            tell_file(markdown, console)
        write(path, {"is_quick": quick, "rows": [row.to_dict() for row in found]}, console)


@app.command()
def accuracy(
    scene: Annotated[list[str] | None, typer.Argument(help="Scenes; none: all with a known outcome.")] = None,
    peers: Annotated[str, typer.Option(metavar="NAMES", help="Of mujoco,pybullet,drake; with commas.")] = "",
    below: Annotated[float | None, typer.Option(help="Name the cheapest setting below this error.")] = None,
    json: Json = None,
    plot: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw error against time.")] = None,
    is_full: Annotated[bool, typer.Option("--all", help="Show every point, not only each engine's best.")] = False,
    quick: Annotated[bool, typer.Option("--quick", help="Only see that it runs.")] = False,
) -> None:
    """Show what accuracy costs in time: error against truth and wall-clock time, beside other engines."""
    with told_errors():
        from rigid_env.measure import accuracy_plot, accuracy_report
        from rigid_env.measure.accuracy import QUICK, Ladder
        from rigid_env.measure.plotting import require_matplotlib
        from rigid_env.measure.table import make_console

        if plot:
            require_matplotlib()
        console, ladder = make_console(), QUICK if quick else Ladder()
        files = [path.resolve() if path else None for path in (json, plot)]
        report = accuracy_report.measure_and_show(console, scene or (), peers, ladder, is_full, below)
        if files[0]:
            accuracy_report.write_result(files[0], report)
            tell_file(files[0], console)
        if files[1] and report.results:
            accuracy_plot.write_plot(report.results, files[1])
            tell_file(files[1], console)
    if not report.is_complete:
        raise typer.Exit(INTERRUPTED)


@app.command()
def tosses(
    data: Annotated[Path, typer.Argument(metavar="DATA", help="A .npz of tosses, or a folder of <number>.pt files.")],
    accuracy: Accuracy = "balanced",
    fit: Annotated[
        str | None, typer.Option(metavar="NAMES", help="Fit only these, once: friction,restitution.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the split into tosses to fit and the rest.")] = 0,
    threads: Annotated[int, typer.Option(min=1, help="That share a replay.")] = 1,
    quick: Annotated[bool, typer.Option("--quick", help="Hardly search: only see that it runs.")] = False,
    plot: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw error against time here (PNG).")] = None,
    json: Json = None,
) -> None:
    """Replay measured cube tosses: fit a quarter of them, report errors over the rest."""
    with told_errors():
        from physics import accuracy as knobs
        from rigid_env.measure.plotting import require_matplotlib
        from rigid_env.measure.table import make_console
        from rigid_env.tosses import data as files
        from rigid_env.tosses import plot as pictures
        from rigid_env.tosses.fit import QUICK, Effort
        from rigid_env.tosses.report import Measurement
        from rigid_env.tosses.show import show

        console = make_console()
        knobs.resolve(accuracy)
        if plot is not None:
            require_matplotlib()
        names = None if fit is None else tuple(name.strip() for name in fit.split(","))
        effort = QUICK if quick else Effort()
        measurement = Measurement(files.load(data), accuracy, effort, seed, threads, names)
        with progress_bar(console) as progress:
            task = progress.add_task("fitting", total=measurement.evaluations())
            report = measurement.run(lambda what, done: progress.update(task, advance=done, description=what))
        show(report, measurement.headline(), console)
        if plot is not None:
            pictures.write_plot(plot, report)
            tell_file(plot, console)
        write(json, {"data": data.name, "is_quick": quick, **report.to_dict()}, console)


@app.command()
def hard_cases(
    cases: Annotated[list[str] | None, typer.Argument(metavar="[CASE]...", help="Names or numbers; none: all.")] = None,
    accuracy: Annotated[str, typer.Option(metavar="NAMES", help="Presets, with commas.")] = "balanced",
    dt: Annotated[float, typer.Option(help="Step [s].")] = 0.01,
    steps: Annotated[str, typer.Option(metavar="LIST", help="Also at these steps [s], with commas.")] = "",
    peers: Annotated[bool, typer.Option("--peers", help="Also in other engines.")] = False,
    quick: Annotated[bool, typer.Option("--quick", help="Shorter runs, with limits for them.")] = False,
    json: Json = None,
    plot: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw which hold at which steps.")] = None,
    markdown: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the page docs/hard-cases.md.")] = None,
) -> None:
    """Run the hard cases, each with a known outcome; exit status 1 where one does not hold."""
    with told_errors():
        from rigid_env.hard_cases.command import run as run_them
        from rigid_env.measure.table import make_console

        console, files = make_console(), [path and path.resolve() for path in (json, plot, markdown)]
        report, written = run_them(console, cases or (), accuracy, dt, steps, peers, quick, *files)
        for path in written:
            tell_file(path, console)
    if not report.is_complete:
        raise typer.Exit(INTERRUPTED)
    if report.has_failed:
        raise typer.Exit(1)
