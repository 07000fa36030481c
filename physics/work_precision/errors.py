"""Errors of a trajectory against a true one, and against laws of physics: plain NumPy, the same for all engines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from physics.rotations import rotation_matrices
from physics.scene.effects import RESISTANCES, Contact, Friction, Gravity
from physics.scene.force_field import Field
from physics.scene.scene import Scene
from physics.scene.support import support


def angles_between(quat: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Angles (...) of the rotations from one attitude to another [rad]; accurate for small angles, too.

    Parameters
    ----------
    quat, true : (..., 4) float64
        Unit quaternions; the sign of either does not matter.
    """
    quat, true = np.asarray(quat, dtype=float), np.asarray(true, dtype=float)
    chord = np.minimum(np.linalg.norm(quat - true, axis=-1), np.linalg.norm(quat + true, axis=-1))
    return 4.0 * np.arcsin(np.minimum(1.0, 0.5 * chord))


def distances(scene: Scene, pos, quat, true_pos, true_quat) -> np.ndarray:
    """Upper bound of the distances of a body's points from their true places [m], (samples, bodies).

    The bound is |Δx| + 2 r sin(θ/2): a rotation by θ moves no point of a body of bounding radius r by more than the
    chord 2 r sin(θ/2).

    Parameters
    ----------
    scene : Scene
        Scene with the bodies.
    pos, true_pos : (samples, bodies, 3) float64
        Positions and true positions of the centres of mass [m].
    quat, true_quat : (samples, bodies, 4) float64
        Attitudes and true attitudes (w, x, y, z).
    """
    radii = np.array([body.bounding_radius(body.dimensions) + np.linalg.norm(body.center) for body in scene.bodies])
    turn = 2.0 * radii * np.sin(0.5 * angles_between(quat, true_quat))
    return np.linalg.norm(pos - true_pos, axis=-1) + turn


def root_mean_square(difference: np.ndarray) -> float:
    """Root of the mean over samples of the largest |difference|² of any body; `difference` is (samples, bodies, 3).

    It measures errors of velocities. Their largest error would tell little: if an impact comes a moment early, the
    velocity is wrong by the whole jump during this moment, however short it is.
    """
    return float(np.sqrt(np.mean(np.sum(difference * difference, axis=-1).max(axis=-1))))


def mechanical_energy(scene: Scene, pos, quat, linvel, angvel) -> np.ndarray:
    """Sum of kinetic energy and of the potential energy of gravity [J], (samples, bodies); 0 potential at the origin.

    It serves samples of other engines; a `Trajectory` of this engine has its energy. A fixed body has none. The
    arguments are (samples, bodies, 3|4|3|3), in the world frame.
    """
    gravity = scene.effect(Gravity)
    pull = np.array(gravity.acceleration if gravity else (0.0, 0.0, 0.0))
    mass = np.array([0.0 if body.fixed else body.mass for body in scene.bodies])
    inertia = np.array([np.zeros((3, 3)) if body.fixed else body.inertia for body in scene.bodies])
    spin = np.einsum("nbji,nbj->nbi", rotation_matrices(quat), angvel)
    turning = 0.5 * np.einsum("nbi,bij,nbj->nb", spin, inertia, spin)
    return 0.5 * mass * np.sum(linvel * linvel, axis=-1) + turning - mass * (pos @ pull)


def conserves_energy(scene: Scene) -> bool:
    """True if the scene conserves energy: without contact, or with elastic contact without friction; without drag."""
    if any(law is not False for law in _field_laws(scene)):
        return False
    contact, friction = scene.effect(Contact), scene.effect(Friction)
    if contact is None or not scene.walls:
        return True
    if any(scene.effect(kind) is not None and scene.effect(kind).radius > 0 for kind in RESISTANCES):
        return False
    return contact.restitution == 1.0 and (friction is None or friction.coefficient == 0.0)


def _field_laws(scene: Scene) -> list[bool | None]:
    return [effect.takes_energy for effect in scene.effects if isinstance(effect, Field)]


def energy_error(scene: Scene, energy: np.ndarray) -> float:
    """Error of the `energy` [J] (samples, bodies) against the scene's law of energy, in J.

    If the scene conserves energy, it is the largest departure of a body's energy from the start. Else it is the largest
    rise above an earlier value; a passive scene never has one. Bodies must not exchange energy. NaN if a field or
    a driven body may add energy.
    """
    if None in _field_laws(scene) or any(body.motion is not None for body in scene.bodies):
        return float("nan")
    if conserves_energy(scene):
        return float(np.abs(energy - energy[0]).max())
    return float((energy - np.minimum.accumulate(energy, axis=0)).max())


def deepest_penetration(scene: Scene, pos, quat) -> float:
    """Largest depth of any body in any wall over all samples [m]; 0 if no wall is touched.

    `pos` (samples, bodies, 3) [m] and `quat` (samples, bodies, 4) are in the world frame.
    """
    if not scene.walls or scene.effect(Contact) is None:
        return 0.0
    worst = 0.0
    for b, body in enumerate(scene.bodies):
        R = rotation_matrices(quat[:, b])
        for wall in scene.walls:
            normal = np.array(wall.normal)
            direction = np.einsum("nji,j->ni", R, normal)
            gap = pos[:, b] @ normal + direction @ body.center - wall.offset - support(body, -direction)
            worst = 0.0 + float(np.maximum(worst, -gap.min()))  # keeps NaN, and turns -0.0 into 0.0
    return worst


def event_error(events: Sequence, true: Sequence) -> float | None:
    """Largest difference of the times of corresponding events [s]; None if no events correspond.

    Events of one kind correspond in the order of time. A kind counts only if both sequences have equally many events
    of it; otherwise any pairing would be a guess. Faults are ignored.

    Parameters
    ----------
    events, true : sequence of Event
        Events of a trajectory, and the true ones.
    """
    worst = None
    for kind in {event.kind for event in events} - {"fault"}:
        mine, theirs = (sorted(event.t for event in some if event.kind == kind) for some in (events, true))
        if len(mine) == len(theirs):
            worst = max(worst or 0.0, *(abs(a - b) for a, b in zip(mine, theirs)))
    return worst
