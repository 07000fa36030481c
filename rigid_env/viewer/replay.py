"""Looks of a saved motion: those of a `physics.Trajectory`, whose scene gives the shapes."""

from __future__ import annotations

from collections.abc import Iterator

from physics import Scene, Trajectory, World
from rigid_env.rendering.picture import world_frame
from rigid_env.viewer.look import Look


def trajectory_looks(scene: Scene, trajectory: Trajectory) -> Iterator[Look]:
    """Looks at the samples of a trajectory; forces are not in it, and are not drawn.

    Parameters
    ----------
    scene : Scene
        The one that was simulated.
    trajectory : Trajectory

    Yields
    ------
    Look

    Raises
    ------
    ValueError
        If scene and trajectory have different numbers of bodies.
    """
    bodies = trajectory.pos.shape[1]
    if bodies != len(scene.bodies):
        raise ValueError(
            f"trajectory has {bodies} bodies; allowed is one of as many as the scene's {len(scene.bodies)}"
        )
    world = World(scene, dt=0.01)
    for k, time in enumerate(trajectory.t.tolist()):
        world.set_state(
            pos=trajectory.pos[k], quat=trajectory.quat[k], linvel=trajectory.linvel[k], angvel=trajectory.angvel[k]
        )
        yield world_look(world, time, arrows=False)


def world_look(world: World, time: float | None = None, arrows: bool = True) -> Look:
    """Look at the first world of a batch now.

    Parameters
    ----------
    world : World
    time : float, optional
        Instead of the world's [s].
    arrows : bool
        Whether contacts are found.
    """
    frame = world_frame(world, arrows=arrows)
    return Look(
        frame, world.time if time is None else time, world.linvel[0].copy(), world.angvel[0].copy(), world.asleep[0],
        frame.poses.radius, None, None,
    )  # fmt: skip
