"""Commands that simulate, explain, replay and compile scenes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from rigid_env.cli import names
from rigid_env.cli.camera_options import ArrowsOption, EyeOption, TargetOption, checked_shot
from rigid_env.cli.common import Accuracy, Json, SceneArgument, app, at_least, end, tell_file, told_errors, write
from rigid_env.cli.files import PICTURES, checked_folder, make_parents, output_option
from rigid_env.terminal import Column, Table, make_console, number_columns, progress_bar, say, ticking

if TYPE_CHECKING:
    from physics import Scene
    from rigid_env.lab.demo import Demo
    from rigid_env.rendering.staging import Shot

Duration = Annotated[float, typer.Option(callback=at_least(0), help="Simulated time [s].")]
Dt = Annotated[float, typer.Option("--dt", help="Step, and time between samples [s].")]


@app.command(short_help="Drop the block; print what happens, write a picture and a GIF.")
def demo(
    scene: Annotated[
        str,
        typer.Argument(
            help="A canonical scene, or a scene file (.toml, .xml or .urdf).", autocompletion=names.complete_scene
        ),
    ] = "drop",
    duration: Duration = 5.0,
    accuracy: Accuracy = "balanced",
    dt: Dt = 0.01,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where PNG and GIF go.", callback=checked_folder)] = Path(
        "demo"
    ),
    eye: EyeOption = None,
    target: TargetOption = None,
    arrows: ArrowsOption = True,
    json: Json = None,
) -> None:
    """Drop the block in the three-wall box; print what happens, write a picture and a GIF."""
    with told_errors():
        lacking = _lacks_pictures()
        shot = checked_shot(eye, target, arrows)
        name, built = names.load_scene(scene)
        pictures = [] if lacking else [out / f"{name}{ending}" for ending in PICTURES]
        make_parents(*pictures, json)
        console = make_console()
        done = _simulate(name, built, duration, accuracy, dt, console)
        summary = done.summary()
        _draw(done, pictures, shot, console)
        summary["files"] = {path.suffix[1:]: str(path) for path in pictures}
        write(json, summary, console)
        if lacking:
            console.print(lacking, soft_wrap=True)


@app.command(short_help="Simulate a scene; print what happens, write samples, draw it.")
def run(
    scene: SceneArgument,
    duration: Duration = 5.0,
    accuracy: Accuracy = "balanced",
    dt: Dt = 0.01,
    plot: Annotated[Path | None, output_option("--plot", *PICTURES, help="Draw the motion.")] = None,
    npz: Annotated[Path | None, output_option("--npz", ".npz", help="Write the samples as a NumPy archive.")] = None,
    csv: Annotated[Path | None, output_option("--csv", ".csv", help="Write the samples as a table.")] = None,
    eye: EyeOption = None,
    target: TargetOption = None,
    arrows: ArrowsOption = True,
    json: Json = None,
) -> None:
    """Simulate a scene; print what happens, and write samples or a picture."""
    with told_errors():
        lacking = "" if plot is None else _lacks_pictures()
        plot = None if lacking else plot
        shot = checked_shot(eye, target, arrows)
        name, built = names.load_scene(scene)
        make_parents(plot, npz, csv, json)
        console = make_console()
        done = _simulate(name, built, duration, accuracy, dt, console)
        for path, save in ((npz, done.trajectory.to_npz), (csv, done.trajectory.to_csv)):
            if path is not None:
                save(path)
                tell_file(path, console)
        _draw(done, [] if plot is None else [plot], shot, console)
        write(json, {"file": scene, **done.summary()}, console)
    end(True, lacking)


def _lacks_pictures() -> str:
    from rigid_env.extras import lacking

    return lacking("render", purpose="drawing a motion")


def _simulate(name: str, scene: Scene, duration: float, accuracy: str, dt: float, console: Console) -> Demo:
    """Simulate a scene, and print its events and energies; returns the run."""
    from rigid_env.lab.demo import Demo
    from rigid_env.lab.demo_report import show

    with console.status("simulating"):
        done = Demo(name, duration, accuracy, scene, dt)
    show(done, done.summary(), console)
    return done


def _draw(done: Demo, paths: list[Path], shot: Shot, console: Console) -> None:
    """Draw and write pictures, and print their paths."""
    for path in paths:
        with progress_bar(console) as progress:
            task = progress.add_task("drawing", total=done.frame_count)
            done.write_picture(path, lambda task=task: progress.advance(task), shot)
        tell_file(path, console)
        if path.suffix == ".gif" and done.speed != 1.0:
            say(console, "", f"shows {done.speed:.3g} s in one second")


@app.command(short_help="List the canonical scenes.")
def scenes(json: Json = None) -> None:
    """List the canonical scenes, which every command knows by their names.

    A scene of your own is a file: docs/scene-files.md says how to write one.
    """
    with told_errors():
        from physics.scene.canonical_scenes import SCENES, about

        make_parents(json)
        console = make_console()
        table = Table([Column("scene", is_whole=True), *number_columns("bodies", "walls"), Column("what it is")])
        rows = []
        for name, make in SCENES.items():
            scene = make()
            rows.append(
                {"scene": name, "bodies": len(scene.bodies), "walls": len(scene.walls), "what": about(name)},
            )
            table.add_row(*map(str, rows[-1].values()))
        console.print(table)
        write(json, {"scenes": rows}, console)


@app.command(short_help="Take recorded steps again: are they the same, bit for bit?")
def replay(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Recording that physics.Recorder wrote.")],
    json: Json = None,
) -> None:
    """Repeat recorded steps, and say whether the results have the same bits.

    If the recording was made with another compiler of kernels, the results are compared within a tolerance.
    """
    with told_errors():
        if not file.is_file():
            raise ValueError(f"file is {str(file)!r}, which does not exist; allowed is a recording (.npz)")
        from physics import Recording
        from rigid_env.lab.replaying import show, summary

        recording = Recording.load(file)
        make_parents(json)
        console = make_console()
        with console.status("replaying"):
            content = summary(recording.replay())
        show(content, console)
        write(json, {"file": str(file), **content}, console)
    if content["first_difference"] is not None:
        raise typer.Exit(1)


@app.command(short_help="Say which effects a scene has, why, and what is compiled.")
def explain(
    scene: SceneArgument,
    accuracy: Accuracy = "balanced",
    duration: Annotated[
        float | None, typer.Option(help="Run it so long [s]: when does each effect act, what time does it take?")
    ] = None,
    json: Json = None,
) -> None:
    """Say which effects a scene has, why, and what is compiled for them."""
    with told_errors():
        from dataclasses import asdict

        from physics import make_plan
        from physics.accuracy import resolve
        from rigid_env.lab.plan_report import make_table

        settings = resolve(accuracy)
        _, built = names.load_scene(scene)
        make_parents(json)
        console = make_console()
        plan = make_plan(built, settings)
        console.print(make_table(plan, f"{scene}, accuracy {accuracy}"))
        values = asdict(settings)
        say(console, "accuracy", ", ".join(f"{name} {value}" for name, value in values.items()))
        rows = [asdict(row) for row in plan.rows]
        content = {"scene": scene, "accuracy": accuracy, "effects": rows, "settings": values}
        if duration is not None:
            content["shares"] = _effect_shares(built, duration, accuracy, console)
        write(json, {**content, "explanation": plan.explain()}, console)


def _effect_shares(scene: Scene, duration: float, accuracy: str, console: Console) -> list[dict]:
    """Measure and print the share of a run in which each effect acts, and its computing time; returns rows for JSON."""
    from rigid_env.lab.measure import shares

    with ticking(console, "measuring", shares.run_count(scene)) as tick:
        found = shares.measure(scene, duration, accuracy, tick=tick)
    console.print(shares.make_table(found, f"{duration:g} s in steps of {shares.STEP} s, without a wrench"))
    return [share.to_dict() for share in found]


@app.command(short_help="Compile kernels ahead.")
def warmup(
    what: Annotated[
        list[str] | None,
        typer.Argument(
            help="Ids of environments, module:id, scenes and scene files; without any, the common ones.",
            autocompletion=names.complete_scene,
        ),
    ] = None,
    accuracy: Annotated[
        str, typer.Option(help="Presets, with commas.", autocompletion=names.complete_presets)
    ] = "balanced",
    json: Json = None,
) -> None:
    """Compile kernels ahead; what is compiled already takes no time."""
    with told_errors():
        from dataclasses import asdict

        from rigid_env.lab.warmup import jobs, jobs_of, warm

        make_parents(json)
        presets = names.listed_presets(accuracy)
        console, done = make_console(), []
        todo = jobs_of(what, presets) if what else jobs()
        with progress_bar(console) as progress:
            task = progress.add_task("compiling", total=len(todo))
            for job, result in zip(todo, warm(todo)):
                progress.update(task, advance=1, description=job.name)
                made = f"{result.compiled} kernels compiled" if result.compiled else "from the cache"
                console.print(f"{result.seconds:7.2f} s  {result.name}, {result.accuracy}: {made}")
                done.append(result)
        total = sum(result.seconds for result in done)
        console.print(f"{total:7.2f} s  together")
        write(json, {"plans": [asdict(result) for result in done], "seconds": total}, console)
