"""Commands that simulate, explain and compile scenes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich import box
from rich.console import Console
from rich.table import Table

from rigid_env.cli.common import Accuracy, Json, app, progress_bar, tell_file, told_errors, write


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
    with told_errors():
        from rigid_env.demo import Demo, show

        with console.status("simulating"):
            run = Demo(scene, duration, accuracy)
        summary = run.summary()
        show(run, summary, console)
        out.mkdir(parents=True, exist_ok=True)
        files = {kind: out / f"{scene}.{kind}" for kind in ("png", "gif")}
        run.write_png(files["png"])
        with progress_bar(console) as progress:
            task = progress.add_task("drawing", total=run.frame_count)
            run.write_gif(files["gif"], lambda: progress.advance(task))
        for path in files.values():
            tell_file(path, console)
        summary["files"] = {kind: str(path) for kind, path in files.items()}
        write(json, summary, console)


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
    with told_errors():
        from physics import load_scene
        from rigid_env.demo import Demo, show

        with console.status("simulating"):
            done = Demo(scene.stem, duration, accuracy, load_scene(scene))
        summary = done.summary()
        show(done, summary, console)
        if npz is not None:
            done.trajectory.to_npz(npz)
            tell_file(npz, console)
        write(json, {"file": str(scene), **summary}, console)


@app.command()
def replay(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="What physics.Recorder wrote.")],
    json: Json = None,
) -> None:
    """Take recorded steps again, and say whether they come out the same, bit for bit."""
    console = Console()
    with told_errors():
        from physics import Recording
        from rigid_env.replaying import show, summary

        recording = Recording.load(file)
        with console.status("replaying"):
            content = summary(recording.replay())
        show(content, console)
        write(json, {"file": str(file), **content}, console)
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
    with told_errors():
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
        write(json, {**content, "explanation": plan.explain()}, console)


def _effect_shares(scene, duration: float, accuracy: str, console: Console) -> list[dict]:
    """Measure and print what the effects of a scene do in a run; the same for JSON."""
    from rigid_env.measure import shares

    with progress_bar(console, has_thread=False) as progress:
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
    with told_errors():
        from rigid_env.warmup import jobs, warm

        todo = jobs()
        done = []
        with progress_bar(console) as progress:
            task = progress.add_task("compiling", total=len(todo))
            for job, result in zip(todo, warm(todo)):
                progress.update(task, advance=1, description=job.name)
                made = f"{result.compiled} kernels compiled" if result.compiled else "from the cache"
                console.print(f"{result.seconds:7.2f} s  {result.name}, {result.accuracy}: {made}")
                done.append(result)
        total = sum(result.seconds for result in done)
        console.print(f"{total:7.2f} s  together")
        write(json, {"plans": [result.to_dict() for result in done], "seconds": total}, console)
