"""Video of episodes of a trained agent or a baseline: ``python -m agents.record RUN_DIR``."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import gymnasium as gym
import numpy as np
import typer

from agents.baselines import Policy
from agents.config import RunFolder
from agents.environments import make_single_env
from agents.evaluate import choose_subject, evaluation_seeds
from agents.options import AccuracyOption, BaselineOption, EnvOption, RunArgument, SeedOption
from rigid_env.cli.camera_options import ArrowsOption, EyeOption, TargetOption, checked_camera
from rigid_env.cli.common import at_least
from rigid_env.envs.policy_files import act
from rigid_env.terminal import make_console, run_program

SIZE = (640, 400)  # width and height of the picture [px]; even numbers, which the video's colour format requires
PAUSE = 0.5  # time for which the last picture of an episode is shown [s]
GIF_STEP = 2  # every second picture: a GIF counts in hundredths of a second and gets large


def record(env: str, policy: Policy, seeds: range, path: Path, **arguments: Any) -> Path:
    """Write a video of one episode for each seed.

    Parameters
    ----------
    env : str
        Gymnasium id.
    policy : callable
        Function from observations (n, entries) to actions (n, 6).
    seeds : sequence of int
    path : Path
        File with the suffix ``.mp4`` or ``.gif``. Without ffmpeg, ``.mp4`` becomes ``.gif``.
    **arguments
        Arguments of the environment, such as ``camera`` and ``arrows`` of its pictures.

    Returns
    -------
    Path
        Path of the file.

    Raises
    ------
    ValueError
        On another suffix.
    """
    if path.suffix not in (".mp4", ".gif"):
        raise ValueError(f"video is {str(path)!r}; allowed are files named .mp4 or .gif")
    width, height = SIZE
    single = make_single_env(env, render_mode="rgb_array", width=width, height=height, **arguments)
    fps = single.metadata["render_fps"]
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        if path.suffix == ".mp4" and _has_ffmpeg():
            return _write_mp4(path, _pictures(single, policy, seeds, round(PAUSE * fps)), fps)
        return _write_gif(path.with_suffix(".gif"), _pictures(single, policy, seeds, round(PAUSE * fps)), fps)
    finally:
        single.close()


def _pictures(single: gym.Env, policy: Policy, seeds: range, pause: int) -> Iterator[np.ndarray]:
    """Yield pictures (height, width, 3) uint8 of all episodes; the last one of each is repeated `pause` times."""
    for seed in seeds:
        observation, _ = single.reset(seed=seed)
        has_ended = False
        yield single.render()
        while not has_ended:
            observation, _, terminated, truncated, _ = single.step(act(policy, observation))
            has_ended = terminated or truncated
            picture = single.render()
            yield picture
        for _ in range(pause):
            yield picture


def _has_ffmpeg() -> bool:
    try:
        import imageio_ffmpeg

        imageio_ffmpeg.get_ffmpeg_exe()
    except (ImportError, RuntimeError):
        return False
    return True


def _write_mp4(path: Path, pictures: Iterator[np.ndarray], fps: float) -> Path:
    import imageio_ffmpeg

    writer = imageio_ffmpeg.write_frames(
        str(path), SIZE, fps=fps, codec="libx264", quality=7, macro_block_size=2, ffmpeg_log_level="error"
    )
    writer.send(None)
    for picture in pictures:
        writer.send(np.ascontiguousarray(picture))
    writer.close()
    return path


def _write_gif(path: Path, pictures: Iterator[np.ndarray], fps: float) -> Path:
    from rigid_env.rendering.picture import write_gif

    write_gif(path, [picture for k, picture in enumerate(pictures) if k % GIF_STEP == 0], fps / GIF_STEP)
    return path


def main(
    run: RunArgument = None,
    baseline: BaselineOption = None,
    env: EnvOption = "rigid_env/BlockReach-v0",
    episodes: Annotated[
        int, typer.Option(callback=at_least(1), help="How many, the first that agents.evaluate counts.")
    ] = 4,
    seed: SeedOption = 0,
    accuracy: AccuracyOption = None,
    out: Annotated[Path | None, typer.Option(help="File to write, .mp4 or .gif.")] = None,
    eye: EyeOption = None,
    target: TargetOption = None,
    arrows: ArrowsOption = True,
) -> None:
    """Video of episodes of a trained agent or a baseline."""
    try:
        subject = choose_subject(run, baseline, env, seed, accuracy)
        path = out or (RunFolder(run).video if run else Path(f"{baseline}-{env.rpartition('/')[2]}.mp4"))
        seeds = evaluation_seeds(seed, episodes)
        view = {"camera": checked_camera(eye, target), "arrows": arrows}
        chosen = {name: value for name, value in view.items() if value is not None and value is not True}
        path = record(subject.env, subject.policy, seeds, path, **{**subject.arguments, **chosen})
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    make_console().print(f"{subject.title}: {episodes} episodes in {path}", soft_wrap=True)


if __name__ == "__main__":
    run_program(main)
