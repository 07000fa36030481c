"""Commands `view` and `play`, which show something in a browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rigid_env.cli import names
from rigid_env.cli.common import app, at_least, ending_on_sigterm, tell_file, told_errors
from rigid_env.cli.files import make_parents, output_option
from rigid_env.terminal import make_console, say

WHAT = (
    "A canonical scene, a scene file (.toml, .xml or .urdf), the id of an environment, module:Class of a task, a "
    "recording or a trajectory (.npz)."
)

POLICY = (
    "Of an environment: pretrained, which comes with it; plain arrays (.npz), of which nothing is run; or a model of "
    "Stable-Baselines3 (.zip). Its code runs while it is read: take it from those you trust only."
)


@app.command(short_help="Look at a scene, an environment, a recording or a trajectory in a browser.")
def view(
    what: Annotated[str, typer.Argument(metavar="[WHAT]", help=WHAT, autocompletion=names.complete_scene)] = "drop",
    accuracy: Annotated[
        str | None, typer.Option(help="Preset of the engine; balanced by default.", callback=names.checked_preset)
    ] = None,
    dt: Annotated[float | None, typer.Option("--dt", help="Step of a scene [s]; 0.01 by default.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the first episode, and of random actions.")] = 0,
    policy: Annotated[Path | None, typer.Option(help=POLICY)] = None,
    controller: Annotated[bool, typer.Option("--controller", help="The controller written by hand acts.")] = False,
    host: Annotated[
        str, typer.Option(help="Address to serve on; 0.0.0.0 lets other machines look, too.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=1, max=65535, help="The next free one is taken.")] = 8080,
    export: Annotated[
        Path | None, output_option("--export", ".html", help="Write a run as one offline page instead.")
    ] = None,
    duration: Annotated[float, typer.Option(callback=at_least(0), help="Of an exported run [s].")] = 10.0,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open a browser here.")] = False,
) -> None:
    """Look at something in a browser: play, pause, go back, drag, kick, and see what accuracy costs.

    Without --policy or --controller an environment gets random actions. Ctrl-C or SIGTERM ends it.
    """
    with told_errors(), ending_on_sigterm():
        from rigid_env.extras import require

        require("view", purpose="the viewer")
        settings = {"accuracy": accuracy, "dt": dt, "seed": seed, "policy": policy, "controller": controller}
        console = make_console()
        if export is not None:
            make_parents(export)
            _export(what, export, duration, settings, console)
            return
        _serve(what, host, port, browser, settings, console)
        say(console, "viewer", "ended")


@app.command(short_help="Watch a trained agent.")
def play(
    env: Annotated[
        str, typer.Argument(metavar="ID", help="Of an environment that has one.", autocompletion=names.complete_trained)
    ],
    episodes: Annotated[int, typer.Option(min=1, help="Of a video.")] = 3,
    seed: Annotated[int, typer.Option(min=0, help="Of the first episode.")] = 0,
    accuracy: Annotated[
        str | None, typer.Option(help="Preset of the engine; balanced by default.", callback=names.checked_preset)
    ] = None,
    video: Annotated[Path | None, output_option("--video", ".gif", help="Write episodes instead.")] = None,
    port: Annotated[int, typer.Option(min=1, max=65535, help="The next free one is taken.")] = 8080,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open a browser here.")] = False,
) -> None:
    """Watch the trained agent that comes with an environment, in a browser or as a video.

    No training, and no library of agents, is needed. Ctrl-C or SIGTERM ends it.
    """
    with told_errors(), ending_on_sigterm():
        from rigid_env.envs.pretrained import PRETRAINED, pretrained_path

        pretrained_path(env)  # refused before anything is opened
        console = make_console()
        if video is None:
            from rigid_env.extras import require

            require("view", purpose="the viewer (which --video FILE.gif does without)")
            settings = {"accuracy": accuracy, "dt": None, "seed": seed, "policy": PRETRAINED, "controller": False}
            _serve(env, "127.0.0.1", port, browser, settings, console)
            return
        from rigid_env.lab.playing import write_video

        make_parents(video)
        with console.status("playing"):
            outcomes = write_video(env, video, range(seed, seed + episodes), accuracy or "balanced")
        for number, outcome in zip(range(seed, seed + episodes), outcomes):
            say(console, f"seed {number}", outcome)
        tell_file(video, console)


def _export(what: str, path: Path, duration: float, settings: dict, console) -> None:
    from rigid_env.viewer.show import to_html

    with console.status("simulating"):
        to_html(what, path, duration=duration, **settings)
    tell_file(path, console)
    say(console, "size", f"{path.stat().st_size / 1e6:.2f} MB")


def _serve(what: str, host: str, port: int, browser: bool, settings: dict, console) -> None:
    """Serve the viewer until Ctrl-C or SIGTERM; print its address once the subject is ready.

    The address for a canonical scene is printed at once, so that the browser loads the page while the engine is
    imported.
    """
    from rigid_env.viewer.servers import start_viewer_server, stop_server

    server = start_viewer_server(what, host, port)
    try:
        is_sure = what in names.CANONICAL and not any(settings.values())
        if is_sure:
            _tell_address(server, browser, console)
        from rigid_env.viewer.server import Viewer
        from rigid_env.viewer.session import Session
        from rigid_env.viewer.subject import open_subject

        session = Session(open_subject(what, **settings))
        if not is_sure:
            _tell_address(server, browser, console)
        viewer = Viewer(session, server)
        viewer.play_once_seen()
        viewer.run()
    finally:
        stop_server(server)


def _tell_address(server, browser: bool, console) -> None:
    """Print the address of a viewer's server, and open it in a browser if `browser` is True."""
    from rigid_env.viewer.servers import address_of, directions

    for text in directions(server):
        console.print(text, soft_wrap=True, highlight=False)
    if browser:
        import webbrowser

        webbrowser.open(address_of(server))
