"""Options of commands that draw: position and target of the camera, and whether arrows are drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rigid_env.rendering import Camera
    from rigid_env.rendering.staging import Shot

Point = tuple[float, float, float]

EyeOption = Annotated[
    Point | None, typer.Option("--eye", metavar="X Y Z", help="Place of the camera [m]; chosen by default.")
]
TargetOption = Annotated[
    Point | None, typer.Option("--target", metavar="X Y Z", help="Place in the middle of the picture [m], with --eye.")
]
ArrowsOption = Annotated[
    bool, typer.Option("--arrows/--no-arrows", help="Draw contact points, forces and torques, or leave them out.")
]


def checked_camera(eye: Point | None, target: Point | None) -> Camera | None:
    """Make the camera that the options describe; None without an eye. Up is y, or -z for a view along y.

    Parameters
    ----------
    eye : (3,) float or None
        Position of the camera, world frame [m].
    target : (3,) float or None
        Point in the middle of the picture, world frame [m]; None: the origin.

    Raises
    ------
    typer.BadParameter
        A target without an eye, numbers that are not finite, or equal points.
    """
    from rigid_env.rendering.camera_argument import as_camera, upwards

    if eye is None:
        if target is not None:
            raise typer.BadParameter(f"--target is {target} without --eye; allowed is --eye alone, or both")
        return None
    target = (0.0, 0.0, 0.0) if target is None else target
    try:
        return as_camera({"eye": eye, "target": target, "up": upwards(eye, target)})
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error


def checked_shot(eye: Point | None, target: Point | None, arrows: bool) -> Shot:
    """Make the `Shot` that the options describe; without a target the camera looks at the middle of the motion.

    Raises
    ------
    typer.BadParameter
        As of `checked_camera`.
    """
    from rigid_env.rendering.staging import Shot

    anywhere = (0.0, 0.0, 0.0) if eye is None or any(eye) else (0.0, 0.0, -1.0)  # the middle is known later
    checked_camera(eye, anywhere if eye is not None and target is None else target)
    return Shot(eye, target, arrows)
