"""Commands that measure: speed, computing time of effects, accuracy, tosses, hard cases."""

from __future__ import annotations

from itertools import chain
from pathlib import Path
from typing import Annotated

import typer

from rigid_env.cli import names
from rigid_env.cli.common import (
    Accuracy,
    Json,
    app,
    at_least,
    collect,
    drawable,
    end,
    tell_file,
    told_errors,
    write,
)
from rigid_env.cli.files import PLOTS, make_parents, output_option
from rigid_env.cli.spreading import Address, Jobs, Launcher, make_place
from rigid_env.terminal import make_console, progress_bar, ticking

BENCH_REPEATS = 5
QUICK_REPEATS = 2

Plot = Annotated[Path | None, output_option("--plot", *PLOTS, help="Draw what was measured.")]


@app.command(short_help="Measure steps per second, beside MuJoCo if it is installed.")
def bench(
    json: Json = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only see that it runs.")] = False,
) -> None:
    """Measure steps per second, beside MuJoCo if it is installed."""
    with told_errors():
        from rigid_env.extras import install_line
        from rigid_env.lab.measure import environments, mujoco_scene, rows, workloads
        from rigid_env.lab.measure.table import make_table

        make_parents(json)
        console = make_console()
        has_peer = mujoco_scene.is_installed()
        if not has_peer:
            console.print(f"without MuJoCo, which is not installed: {install_line('bench')}", soft_wrap=True)
        repeats = QUICK_REPEATS if quick else BENCH_REPEATS
        sizes, env_sizes = ((module.QUICK if quick else module.FULL) for module in (workloads, environments))
        total = rows.run_count(repeats, has_peer) + environments.run_count(repeats, with_peer=False)
        found = []
        with ticking(console, "measuring", total) as tick, mujoco_scene.elsewhere():
            engine = rows.engine_rows(sizes, repeats, has_peer, tick)
            is_complete = collect(found, chain(engine, environments.environment_rows(env_sizes, repeats, tick=tick)))
        console.print(make_table(found, "steps per second: median, lowest .. highest"))
        content = {"is_quick": quick, "is_complete": is_complete, "rows": [row.to_dict() for row in found]}
        write(json, content, console)
    end(is_complete)


@app.command(short_help="Measure what each effect costs in time.")
def effects(
    effect: Annotated[
        list[str] | None,
        typer.Argument(help="Effects, as in the table; none: all of them.", autocompletion=names.complete_effect),
    ] = None,
    accuracy: Accuracy = "balanced",
    json: Json = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only see that it runs.")] = False,
) -> None:
    """Measure what each effect costs: steps per second of its scene with it and without."""
    with told_errors():
        from rigid_env.lab.measure import effects as costs
        from rigid_env.lab.measure.table import make_table

        chosen = costs.chosen(effect or ())
        make_parents(json)
        console = make_console()
        repeats, steps = (QUICK_REPEATS, costs.QUICK_STEPS) if quick else (BENCH_REPEATS, costs.STEPS)
        found = []
        with ticking(console, "measuring", costs.run_count(len(chosen), repeats)) as tick:
            measured = ([costs.effect_row(name, accuracy, steps, repeats, tick)] for name in chosen)
            is_complete = collect(found, measured)
        console.print(make_table(found, "steps per second", ("with it", "without")))
        content = {"is_quick": quick, "is_complete": is_complete, "rows": [row.to_dict() for row in found]}
        write(json, content, console)
    end(is_complete)


@app.command(short_help="Show what accuracy costs in time, beside other engines.")
def accuracy(
    scene: Annotated[
        list[str] | None,
        typer.Argument(
            help="Scenes, also of files (.toml, .xml or .urdf); none: all with a known outcome.",
            autocompletion=names.complete_truth,
        ),
    ] = None,
    peers: Annotated[
        str,
        typer.Option(
            metavar="NAMES", help="Of mujoco,pybullet,drake; with commas.", autocompletion=names.complete_peers
        ),
    ] = "",
    duration: Annotated[
        float | None, typer.Option(help="Simulated time of scenes without a closed form [s]; 2 or 3 by default.")
    ] = None,
    below: Annotated[float | None, typer.Option(help="Name the cheapest setting below this error.")] = None,
    json: Json = None,
    plot: Plot = None,
    is_full: Annotated[bool, typer.Option("--all", help="Show every point, not only each engine's best.")] = False,
    has_goals: Annotated[bool, typer.Option("--goals", help="Show this project's goals, too.")] = False,
    quick: Annotated[bool, typer.Option("--quick", help="Only see that it runs.")] = False,
    launcher: Launcher = None,
    jobs: Jobs = 2,
    address: Address = None,
) -> None:
    """Show what accuracy costs in time: error against truth and wall-clock time, beside other engines."""
    with told_errors():
        from rigid_env.lab.measure import accuracy_plot, accuracy_report
        from rigid_env.lab.measure.accuracy import QUICK, Ladder

        console, ladder = make_console(), QUICK if quick else Ladder()
        plot, lacking = drawable(plot, console)
        place = make_place(launcher, jobs, address, json)
        make_parents(json, plot)
        shown = accuracy_report.Shown(is_full, has_goals, below)
        engines = names.listed(peers)
        report = accuracy_report.measure_and_show(console, scene or (), engines, ladder, duration, shown, place)
        if json and report.results:
            accuracy_report.write_result(json, report)
            tell_file(json, console)
        if plot and report.results:
            accuracy_plot.write_plot(report.results, plot, has_goals)
            tell_file(plot, console)
    end(report.is_complete, lacking)


@app.command(short_help="Replay measured cube tosses and report the errors.")
def tosses(
    data: Annotated[Path, typer.Argument(metavar="DATA", help="A .npz of tosses, or a folder of <number>.pt files.")],
    accuracy: Accuracy = "balanced",
    fit: Annotated[
        str | None, typer.Option(metavar="NAMES", help="Fit only these, once: friction,restitution.")
    ] = None,
    seed: Annotated[int, typer.Option(callback=at_least(0), help="Of the split into tosses to fit and the rest.")] = 0,
    threads: Annotated[int, typer.Option(callback=at_least(1), help="That share a replay.")] = 1,
    quick: Annotated[bool, typer.Option("--quick", help="Hardly search: only see that it runs.")] = False,
    plot: Plot = None,
    json: Json = None,
) -> None:
    """Replay measured cube tosses: fit a quarter of them, report errors over the rest."""
    with told_errors():
        from rigid_env.lab.tosses import data as files
        from rigid_env.lab.tosses import plot as pictures
        from rigid_env.lab.tosses.fit import QUICK, Effort
        from rigid_env.lab.tosses.report import Measurement
        from rigid_env.lab.tosses.show import show

        fitted = None if fit is None else tuple(names.listed(fit))
        effort = QUICK if quick else Effort()
        measurement = Measurement(files.load(data), accuracy, effort, seed, threads, fitted)
        console = make_console()
        plot, lacking = drawable(plot, console)
        make_parents(plot, json)
        with progress_bar(console) as progress:
            task = progress.add_task("fitting", total=measurement.evaluations())
            report = measurement.run(lambda what, done: progress.update(task, advance=done, description=what))
        show(report, measurement.headline(), console)
        if plot is not None:
            pictures.write_plot(plot, report)
            tell_file(plot, console)
        write(json, {"data": data.name, "is_quick": quick, **report.to_dict()}, console)
    end(report.is_complete, lacking)


@app.command(short_help="Run the cases in which simulators break; each must hold.")
def hard_cases(
    cases: Annotated[
        list[str] | None,
        typer.Argument(metavar="[CASE]...", help="Names or numbers; none: all.", autocompletion=names.complete_case),
    ] = None,
    accuracy: Annotated[
        str,
        typer.Option(metavar="NAMES", help="Presets, with commas.", autocompletion=names.complete_presets),
    ] = "balanced",
    dt: Annotated[float, typer.Option(help="Step [s].")] = 0.01,
    steps: Annotated[str, typer.Option(metavar="LIST", help="Also at these steps [s], with commas.")] = "",
    peers: Annotated[bool, typer.Option("--peers", help="Also in other engines.")] = False,
    quick: Annotated[bool, typer.Option("--quick", help="Shorter runs, with limits for them.")] = False,
    json: Json = None,
    plot: Plot = None,
    launcher: Launcher = None,
    jobs: Jobs = 2,
    address: Address = None,
) -> None:
    """Run the hard cases, each with a known outcome; exit status 1 where one does not hold."""
    with told_errors():
        from physics import validation
        from rigid_env.hard_cases import registry
        from rigid_env.lab.hard_cases.report import Report, measure
        from rigid_env.lab.hard_cases.show import show, write_picture

        console = make_console()
        plot, lacking = drawable(plot, console)
        validation.positive(dt, (), "dt")
        presets, further = names.listed_presets(accuracy), names.listed_steps(steps)
        report = Report(registry.find(cases or ()), presets, dt, further, not quick)
        place = make_place(launcher, jobs, address, json)
        if peers and not place.is_here:
            told = "peers is True with a launcher; allowed is one of the two"
            raise ValueError(f"{told}: other engines run in this process")
        make_parents(json, plot)
        measure(report, console, place, peers, json)
        show(report, console)
        if json and report.outcomes:
            tell_file(json, console)
        if plot and report.outcomes:
            write_picture(plot, report.ours)
            tell_file(plot, console)
    end(report.is_complete, lacking)
    if report.has_failed:
        raise typer.Exit(1)
