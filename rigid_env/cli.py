"""The command line ``rigid-env``. A command imports what it needs when it runs: ``--help`` is quick."""

from __future__ import annotations

import contextlib
from importlib import metadata
from pathlib import Path
from typing import Annotated

import typer
from rich import box
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

app = typer.Typer(no_args_is_help=True, add_completion=False, help="A rigid-body engine you can check.")

Json = Annotated[Path | None, typer.Option("--json", metavar="FILE", help="Write the numbers here, too.")]
Accuracy = Annotated[str, typer.Option(help="Preset: fast, balanced, precise or reference.")]

BENCH_REPEATS = 5
QUICK_REPEATS = 2
INTERRUPTED = 130  # exit status, as a shell gives it


def _print_version(is_wanted: bool) -> None:
    if not is_wanted:
        return
    try:
        typer.echo(f"rigid-env {metadata.version('rigid-env')}")
    except metadata.PackageNotFoundError:
        typer.echo("rigid-env, not installed: run from its sources")
    raise typer.Exit


@app.callback()
def _main(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    pass


@contextlib.contextmanager
def _told_errors():
    """Turn what a user can put right into a message without a traceback."""
    from gymnasium.error import DependencyNotInstalled

    try:
        yield
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    except (DependencyNotInstalled, OSError) as error:
        typer.echo(f"Error: {error}", err=True)
        raise typer.Exit(1) from error


def _progress(console: Console, has_thread: bool = True) -> Progress:
    """A progress bar; without its thread, which would disturb what is measured, refresh it yourself."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    return Progress(*columns, console=console, transient=True, auto_refresh=has_thread)


def _write(path: Path | None, content: dict, console: Console) -> None:
    if path is None:
        return
    from rigid_env.measure.machine import write_json

    write_json(path, content)
    _tell_file(path, console)


def _tell_file(path: Path, console: Console) -> None:
    console.print(f"written     {path}", soft_wrap=True, highlight=False)


@app.command()
def demo(
    scene: Annotated[str, typer.Argument(help="A canonical scene.")] = "drop",
    duration: Annotated[float, typer.Option(min=0.0, help="Simulated time [s].")] = 5.0,
    accuracy: Accuracy = "balanced",
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where PNG and GIF go.")] = Path("demo"),
    json: Json = None,
) -> None:
    """Drop the block in the three-wall box; print what happens, write a picture and a GIF."""
    console = Console()
    with _told_errors():
        from rigid_env.demo import Demo, show

        with console.status("simulating"):
            run = Demo(scene, duration, accuracy)
        summary = run.summary()
        show(run, summary, console)
        out.mkdir(parents=True, exist_ok=True)
        files = {kind: out / f"{scene}.{kind}" for kind in ("png", "gif")}
        run.write_png(files["png"])
        with _progress(console) as progress:
            task = progress.add_task("drawing", total=run.frame_count)
            run.write_gif(files["gif"], lambda: progress.advance(task))
        for path in files.values():
            _tell_file(path, console)
        summary["files"] = {kind: str(path) for kind, path in files.items()}
        _write(json, summary, console)


@app.command()
def run(
    scene: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="A scene file (docs/scene-files.md).")],
    duration: Annotated[float, typer.Option(min=0.0, help="Simulated time [s].")] = 5.0,
    accuracy: Accuracy = "balanced",
    npz: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the samples here.")] = None,
    json: Json = None,
) -> None:
    """Simulate a scene from a file; print what happens."""
    console = Console()
    with _told_errors():
        from physics import load_scene
        from rigid_env.demo import Demo, show

        with console.status("simulating"):
            done = Demo(scene.stem, duration, accuracy, load_scene(scene))
        summary = done.summary()
        show(done, summary, console)
        if npz is not None:
            done.trajectory.to_npz(npz)
            _tell_file(npz, console)
        _write(json, {"file": str(scene), **summary}, console)


@app.command()
def replay(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="What physics.Recorder wrote.")],
    json: Json = None,
) -> None:
    """Take recorded steps again, and say whether they come out the same, bit for bit."""
    console = Console()
    with _told_errors():
        from physics import Recording
        from rigid_env.replaying import show, summary

        recording = Recording.load(file)
        with console.status("replaying"):
            content = summary(recording.replay())
        show(content, console)
        _write(json, {"file": str(file), **content}, console)
    if not content["is_identical"]:
        raise typer.Exit(1)


@app.command()
def explain(
    scene: Annotated[str, typer.Argument(help="A canonical scene, or a scene file (docs/scene-files.md).")],
    accuracy: Accuracy = "balanced",
    duration: Annotated[
        float | None, typer.Option(help="Run it so long [s]: when does each effect act, what time does it take?")
    ] = None,
    json: Json = None,
) -> None:
    """Say which effects a scene has, why, and what is compiled for them."""
    console = Console()
    with _told_errors():
        from dataclasses import asdict

        from physics import accuracy as knobs
        from physics import load_scene, make_plan, scenes

        settings = knobs.resolve(accuracy)
        built = load_scene(scene) if scene.endswith(".toml") else scenes.by_name(scene)
        plan = make_plan(built, settings)
        table = Table(title=f"{scene}, accuracy {accuracy}", title_justify="left", box=box.SIMPLE_HEAD)
        for name in ("effect", "", "why", "compiled"):
            table.add_column(name)
        for row in plan.rows:
            state = "[green]on[/green]" if row.is_on else "[dim]off[/dim]"
            table.add_row(row.effect, state, row.reason, row.compiled if row.is_on else "nothing")
        console.print(table)
        values = asdict(settings)
        console.print("accuracy    " + ", ".join(f"{name} {value}" for name, value in values.items()))
        rows = [asdict(row) for row in plan.rows]
        content = {"scene": scene, "accuracy": accuracy, "effects": rows, "settings": values}
        if duration is not None:
            content["shares"] = _effect_shares(built, duration, accuracy, console)
        _write(json, {**content, "explanation": plan.explain()}, console)


def _effect_shares(scene, duration: float, accuracy: str, console: Console) -> list[dict]:
    """Measure and print what the effects of a scene do in a run; the same for JSON."""
    from rigid_env.measure import shares

    with _progress(console, has_thread=False) as progress:
        task = progress.add_task("measuring", total=shares.run_count(scene))
        found = shares.measure(
            scene,
            duration,
            accuracy,
            tick=lambda name: progress.update(task, advance=1, description=name, refresh=True),
        )
    console.print(shares.make_table(found, f"{duration:g} s in steps of {shares.STEP} s, without a wrench"))
    return [share.to_dict() for share in found]


@app.command()
def warmup(json: Json = None) -> None:
    """Compile the common plans ahead; what is compiled already takes no time."""
    console = Console()
    with _told_errors():
        from rigid_env.warmup import jobs, warm

        todo = jobs()
        done = []
        with _progress(console) as progress:
            task = progress.add_task("compiling", total=len(todo))
            for job, result in zip(todo, warm(todo)):
                progress.update(task, advance=1, description=job.name)
                made = f"{result.compiled} kernels compiled" if result.compiled else "from the cache"
                console.print(f"{result.seconds:7.2f} s  {result.name}, {result.accuracy}: {made}")
                done.append(result)
        total = sum(result.seconds for result in done)
        console.print(f"{total:7.2f} s  together")
        _write(json, {"plans": [result.to_dict() for result in done], "seconds": total}, console)


@app.command()
def bench(
    json: Json = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only see that it runs.")] = False,
) -> None:
    """Measure steps per second, beside MuJoCo if it is installed."""
    with _told_errors():
        from rigid_env.measure import environments, mujoco_scene, rows, workloads
        from rigid_env.measure.table import make_console, make_table

        console = make_console()
        has_peer = mujoco_scene.is_installed()
        repeats = QUICK_REPEATS if quick else BENCH_REPEATS
        sizes, env_sizes = ((module.QUICK if quick else module.FULL) for module in (workloads, environments))
        path = json.resolve() if json else None
        total = rows.run_count(repeats, has_peer) + environments.run_count(repeats, with_peer=False)
        found = []
        with _progress(console, has_thread=False) as progress, mujoco_scene.elsewhere():
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
        _write(path, {"is_quick": quick, "rows": [row.to_dict() for row in found]}, console)


@app.command()
def effects(
    accuracy: Accuracy = "balanced",
    json: Json = None,
    markdown: Annotated[Path | None, typer.Option(metavar="FILE", help="Put the table into this page, too.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only see that it runs.")] = False,
) -> None:
    """Measure what each effect costs: steps per second of its scene with it and without."""
    with _told_errors():
        from physics import accuracy as knobs
        from rigid_env.measure import effects as costs
        from rigid_env.measure.table import make_console, make_table

        knobs.resolve(accuracy)
        console, path = make_console(), json.resolve() if json else None
        repeats, steps = (QUICK_REPEATS, costs.QUICK_STEPS) if quick else (BENCH_REPEATS, costs.STEPS)
        found = []
        with _progress(console, has_thread=False) as progress:
            task = progress.add_task("measuring", total=costs.run_count(repeats))

            def tick(what: str) -> None:
                progress.update(task, advance=1, description=what, refresh=True)

            for name in costs.CASES:
                found.append(costs.effect_row(name, accuracy, steps, repeats, tick))
        console.print(make_table(found, "steps per second with the effect, against the scene without it"))
        if markdown is not None:
            costs.write_markdown(markdown, found, accuracy)
            _tell_file(markdown, console)
        _write(path, {"is_quick": quick, "rows": [row.to_dict() for row in found]}, console)


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
    with _told_errors():
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
            _tell_file(files[0], console)
        if files[1] and report.results:
            accuracy_plot.write_plot(report.results, files[1])
            _tell_file(files[1], console)
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
    with _told_errors():
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
        with _progress(console) as progress:
            task = progress.add_task("fitting", total=measurement.evaluations())
            report = measurement.run(lambda what, done: progress.update(task, advance=done, description=what))
        show(report, measurement.headline(), console)
        if plot is not None:
            pictures.write_plot(plot, report)
            _tell_file(plot, console)
        _write(json, {"data": data.name, "is_quick": quick, **report.to_dict()}, console)


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
    with _told_errors():
        from rigid_env.hard_cases.command import run as run_them
        from rigid_env.measure.table import make_console

        console, files = make_console(), [path and path.resolve() for path in (json, plot, markdown)]
        report, written = run_them(console, cases or (), accuracy, dt, steps, peers, quick, *files)
        for path in written:
            _tell_file(path, console)
    if not report.is_complete:
        raise typer.Exit(INTERRUPTED)
    if report.has_failed:
        raise typer.Exit(1)
