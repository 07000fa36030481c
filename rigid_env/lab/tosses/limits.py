"""Limits of the accuracy of replayed tosses: noise of the start, the face they land on, and growth over time."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from rigid_env.lab.tosses import data
from rigid_env.lab.tosses.data import Tosses
from rigid_env.lab.tosses.metric import Errors, Summary
from rigid_env.lab.tosses.replay import attitude

ALONG_PARTS = 20


@dataclass(frozen=True)
class Limits:
    """Sources of the error of the main fit, over the tosses that were not fitted.

    Attributes
    ----------
    noise : Summary
        Distance of replays with disturbed starts from the undisturbed replay. The disturbance is the measurement's
        noise, so no engine can be expected to be nearer to the measurement.
    landed, missed : Summary or None
        Errors of the tosses that end on the measured face, and of the others; None if there are none.
    along_position, along_rotation : (ALONG_PARTS,) float64
        Mean error in each of equal parts of a toss's duration [cube widths, deg].
    """

    noise: Summary
    landed: Summary | None
    missed: Summary | None
    along_position: np.ndarray
    along_rotation: np.ndarray

    def to_dict(self) -> dict:
        """Limits as a dict for JSON."""
        return {
            "noise_floor": asdict(self.noise),
            "landed_on_the_measured_face": self.landed and asdict(self.landed),
            "landed_on_another_face": self.missed and asdict(self.missed),
            "along_the_toss": {"position": self.along_position.tolist(), "rotation": self.along_rotation.tolist()},
        }


def faces_down(quat: np.ndarray) -> np.ndarray:
    """Face (n,) of a cube that points down most, for each attitude: body axis 0 to 2, plus 3 for its positive side."""
    down = -attitude(quat).as_matrix()[:, 2]
    axis = np.abs(down).argmax(axis=1)
    return axis + 3 * (np.take_along_axis(down, axis[:, None], axis=1)[:, 0] > 0.0)


def find_limits(
    tosses: Tosses, chosen: np.ndarray, errors: Errors, poses: np.ndarray, disturbed: list[Errors]
) -> Limits:
    """Find the limits for the chosen tosses.

    Parameters
    ----------
    tosses : Tosses
    chosen : (k,) int
        Indices of the tosses.
    errors : Errors
        Errors of the replay of all tosses.
    poses : (frames, 7) float64
        Poses of this replay.
    disturbed : list of Errors
        Differences between replays from disturbed starts and `poses`.
    """
    ends = tosses.offsets[1:] - 1
    is_same = faces_down(poses[ends, 3:]) == faces_down(tosses.states[ends, data.QUAT])
    groups = [chosen[is_same[chosen]], chosen[~is_same[chosen]]]
    landed, missed = (errors.summary(group) if len(group) else None for group in groups)
    position, rotation = np.mean([one.per_toss() for one in disturbed], axis=0)
    along = errors.subset(chosen).along(ALONG_PARTS)
    return Limits(Summary.of(position[chosen], rotation[chosen]), landed, missed, *along)
