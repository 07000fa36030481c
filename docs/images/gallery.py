"""Draw the pictures of docs/gallery.md: ten hard cases, and every environment.

``python docs/images/gallery.py`` writes them into ``gallery`` beside this file; names of pictures choose some of them.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import gymnasium as gym
import numpy as np
from PIL import Image

import physics
import rigid_env  # noqa: F401 (registers the environments)
from rigid_env.hard_cases.case import Setting
from rigid_env.hard_cases.registry import find
from rigid_env.rendering import BodyView, Camera, Frame, Renderer, fit_camera
from rigid_env.rendering.picture import stroboscope, without_bodies, world_frame
from rigid_env.rendering.staging import Stage
from rigid_env.rendering.view import frame_of

HERE = Path(__file__).parent
FOLDER = HERE / "gallery"
EXAMPLES = HERE.parents[1] / "examples"
SIZE = (480, 360)  # [px]
FIELD_OF_VIEW = 24.0  # [deg]
MARGIN = 0.07  # of the picture, on each side of the bodies
FLOOR = 0.3  # seen around the bodies, in sizes of their motion
LARGEST = 60_000  # file [bytes]
LEVEL = 4  # step of brightness, of 256


@dataclass(frozen=True)
class Shown:
    """One hard case in one picture.

    Parameters
    ----------
    case : str
        Name; the first scene that it runs is drawn.
    times : tuple of float
        Of the pictures that are laid on each other, in order [s].
    look : (3,) float
        Direction of the line of sight.
    arrows : bool
        Whether the contacts of the last time are drawn.
    """

    case: str
    times: tuple[float, ...]
    look: tuple[float, float, float] = (-0.35, -0.35, -1.0)
    arrows: bool = False


@dataclass(frozen=True)
class Driven:
    """One environment in one picture.

    Parameters
    ----------
    name : str
    env : str
        Id, without the namespace.
    steps : int
        Control steps before the picture.
    settings : dict
        Arguments of the environment.
    seed : int
    look : (3,) float or None
        Direction of the line of sight of a camera near the bodies and the goal; None: the camera of the environment.
    """

    name: str
    env: str
    steps: int
    settings: dict
    seed: int = 0
    look: tuple[float, float, float] | None = None


CASES = (
    Shown("towers", (0.5,)),
    Shown("pyramids", (0.5,), (-0.25, -0.2, -1.0)),
    Shown("overhang", (0.5,), (-0.25, -0.2, -1.0)),
    Shown("cards", (0.5,), (-0.5, -0.35, -1.0), arrows=True),
    Shown("arch", (0.2,), (-0.4, -0.3, -1.0)),
    Shown("dominoes", (2.8,), (1.0, -0.35, -0.45)),
    Shown("falling-balls", (0.6,)),
    Shown("cradle", (0.0, 0.3, 0.6, 1.0, 1.4), (0.0, -0.3, -1.0)),
    Shown("euler-disk", (0.0, 0.2, 0.4), (-0.2, -0.4, -1.0)),
    Shown("lifts-off", (0.0, 0.04, 0.08, 0.12, 0.16), (-0.2, -0.25, -1.0)),
)

ENVIRONMENTS = (
    Driven("block-reach", "BlockReach-v0", 30, {}),
    Driven("block-reorient", "BlockReorient-v0", 30, {}, 2, (-0.3, -0.6, -1.0)),
    Driven("block-reach-goal", "BlockReachGoal-v0", 20, {}, 3, (0.5, -0.7, -1.0)),
    Driven("block-reorient-goal", "BlockReorientGoal-v0", 20, {"arrows": False}, 2),
    Driven("scene-cart", "Scene-v0", 30, {"scene": EXAMPLES / "cart.toml"}, 0, (-0.2, -0.4, -1.0)),
    Driven("scene-heap", "Scene-v0", 40, {"scene": "heap", "driven": [99], "arrows": False}, 0, (-0.3, -0.5, -1.0)),
)


class _Found(Exception):
    """The first scene of a case."""


class _Finding(Setting):
    def world(self, scene: physics.Scene, worlds: int = 1) -> physics.World:
        raise _Found(scene)


def scene_of(case: str) -> physics.Scene:
    """The first scene that a hard case runs."""
    (found,) = find([case])
    try:
        found.run(_Finding())
    except _Found as scene:
        return scene.args[0]
    raise ValueError(f"case is {case!r}, which runs no world; allowed is one that does")


def draw_case(shown: Shown) -> np.ndarray:
    """(height, width, 3) uint8 picture of a hard case."""
    scene = scene_of(shown.case)
    world, frames, places = physics.World(scene), [], []
    for time in shown.times:
        steps = round((time - world.time) / world.dt)
        if steps:
            world.step(steps=steps)
        frames.append(world_frame(world, arrows=shown.arrows and time == shown.times[-1]))
        places.append(world.pos[0].copy())
    stage = Stage(scene, frames[-1], np.array(places))
    frames = [stage.place(frame) for frame in frames]
    renderer = Renderer(*SIZE, camera=camera_at(frames, shown.look), bounds=_wider(stage.bounds))
    pictures = [renderer.draw(frame) for frame in frames]
    empty = renderer.draw(without_bodies(frames[-1], renderer.camera(frames[-1])))
    return stroboscope(pictures, empty) if len(pictures) > 1 else pictures[0]


def camera_at(frames: list[Frame], look: tuple[float, float, float]) -> Camera:
    """Camera that has the bodies of all frames in sight."""
    signs = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T
    extents = [np.abs(frame.poses.rotation) @ _half(frame)[:, :, None] for frame in frames]
    corners = [frame.poses.pos[:, None] + signs * extent[:, None, :, 0] for frame, extent in zip(frames, extents)]
    return fit_camera(np.concatenate(corners).reshape(-1, 3), look, SIZE, FIELD_OF_VIEW, MARGIN)


def _wider(bounds: tuple[np.ndarray, np.ndarray] | None) -> tuple[np.ndarray, np.ndarray] | None:
    """Bounds with some floor around the bodies."""
    if bounds is None:
        return None
    more = FLOOR * float(np.max(bounds[1] - bounds[0])) * np.array((1.0, 0.0, 1.0))
    return bounds[0] - more, bounds[1] + more


def _half(frame: Frame) -> np.ndarray:
    """(bodies, 3) half extents along the body axes [m]."""
    return np.array([body.dimensions * (0.5 if body.kind == "block" else 1.0) for body in frame.bodies])


def draw_environment(driven: Driven) -> np.ndarray:
    """(height, width, 3) uint8 picture of an environment after some steps of smooth random actions."""
    if driven.look is None:
        return run_environment(driven).render()
    frame = frame_of(run_environment(driven).unwrapped.task, arrows=False)
    if frame.goal is not None and frame.goal.pos is not None:
        disc = BodyView("sphere", np.full(3, frame.goal.radius), frame.goal.pos)
        frame = replace(frame, bodies=(*frame.bodies, disc))
    return run_environment(driven, camera=camera_at([frame], driven.look)).render()


def run_environment(driven: Driven, **settings) -> gym.Env:
    """Environment after its steps."""
    size = dict(zip(("width", "height"), SIZE))
    env = gym.make(f"rigid_env/{driven.env}", render_mode="rgb_array", **size, **driven.settings, **settings)
    env.reset(seed=driven.seed)
    rng, action = np.random.default_rng(driven.seed), np.zeros(env.action_space.shape)
    for _ in range(driven.steps):
        action = 0.9 * action + 0.3 * rng.standard_normal(action.shape)
        env.step(action.clip(-1.0, 1.0).astype(np.float32))
    return env


def write(name: str, picture: np.ndarray) -> None:
    """Write a picture in fewer levels of brightness, which is hardly seen; one that is large still, in 256 colours."""
    FOLDER.mkdir(exist_ok=True)
    path = FOLDER / f"{name}.png"
    coarse = np.minimum(picture.astype(int) + LEVEL // 2, 255) // LEVEL * LEVEL
    image = Image.fromarray(coarse.astype(np.uint8))
    image.save(path, optimize=True)
    if path.stat().st_size > LARGEST:
        palette = image.quantize(256, Image.Quantize.MAXCOVERAGE)
        image.quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG).save(path, optimize=True)


PICTURES: dict[str, Callable[[], np.ndarray]] = {
    **{shown.case: lambda shown=shown: draw_case(shown) for shown in CASES},
    **{driven.name: lambda driven=driven: draw_environment(driven) for driven in ENVIRONMENTS},
}
"""Functions that draw, by the names of the files."""


def main(names: list[str]) -> None:
    """Draw the pictures of these names, or all."""
    for name in names or PICTURES:
        if name not in PICTURES:
            raise SystemExit(f"picture is {name!r}; allowed are {', '.join(PICTURES)}")
        write(name, PICTURES[name]())
        print(name, (FOLDER / f"{name}.png").stat().st_size)


if __name__ == "__main__":
    main(sys.argv[1:])
