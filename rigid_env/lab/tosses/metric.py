"""Distance of a replayed toss from the measured one.

For a frame it is the distance of the positions in cube widths, and the angle of the rotation between the attitudes in
degrees. For a toss it is the mean over its frames, the first (where both agree) included. For several tosses it is the
mean and the median of these means.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rigid_env.lab.tosses.data import SIDE


@dataclass(frozen=True)
class Summary:
    """Errors of several tosses as means and medians.

    Attributes
    ----------
    tosses : int
        Number of tosses.
    position_mean, position_median : float
        [cube widths].
    rotation_mean, rotation_median : float
        [deg].
    """

    tosses: int
    position_mean: float
    position_median: float
    rotation_mean: float
    rotation_median: float

    @classmethod
    def of(cls, position: np.ndarray, rotation: np.ndarray) -> Summary:
        """Make the summary of errors per toss (tosses,) [cube widths, deg]."""
        return cls(
            len(position), float(position.mean()), float(np.median(position)), float(rotation.mean()),
            float(np.median(rotation)),
        )  # fmt: skip


@dataclass(frozen=True)
class Errors:
    """Errors of several tosses, frame by frame.

    Attributes
    ----------
    position : (frames,) float64
        [cube widths].
    rotation : (frames,) float64
        [deg].
    offsets : (tosses + 1,) int64
        Toss i has the frames from ``offsets[i]`` to ``offsets[i + 1] - 1``.
    """

    position: np.ndarray
    rotation: np.ndarray
    offsets: np.ndarray

    def per_toss(self) -> tuple[np.ndarray, np.ndarray]:
        """Means over the frames of each toss, (tosses,) each: position [cube widths] and rotation [deg]."""
        frames = np.diff(self.offsets)
        return tuple(np.add.reduceat(values, self.offsets[:-1]) / frames for values in (self.position, self.rotation))

    def summary(self, chosen=slice(None)) -> Summary:
        """Mean and median over all tosses, or over the tosses with the indices `chosen`."""
        return Summary.of(*(values[chosen] for values in self.per_toss()))

    def subset(self, chosen) -> Errors:
        """Errors of the tosses with these indices."""
        frames = np.concatenate([np.arange(self.offsets[i], self.offsets[i + 1]) for i in chosen])
        offsets = np.concatenate(([0], np.cumsum(np.diff(self.offsets)[chosen])))
        return Errors(self.position[frames], self.rotation[frames], offsets)

    def along(self, parts: int) -> tuple[np.ndarray, np.ndarray]:
        """Mean errors (parts,) of position [cube widths] and rotation [deg] in equal parts of a toss's duration.

        The mean of each toss in a part counts once, so that long tosses have the same weight as short ones.
        """
        frames = np.diff(self.offsets)
        index = np.arange(len(self.position)) - np.repeat(self.offsets[:-1], frames)
        part = np.minimum(index * parts // np.repeat(frames, frames), parts - 1)
        cell = np.repeat(np.arange(len(frames)), frames) * parts + part
        size = len(frames) * parts
        count = np.bincount(cell, minlength=size).reshape(-1, parts)
        means = []
        for values in (self.position, self.rotation):
            total = np.bincount(cell, values, minlength=size).reshape(-1, parts)
            means.append((total / np.maximum(count, 1)).sum(axis=0) / np.maximum((count > 0).sum(axis=0), 1))
        return tuple(means)


def angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angle (...) of the rotation between the attitudes of unit quaternions (..., 4) [deg].

    With d = a⁻¹b it is 2 atan2(|vector part of d|, |scalar part of d|). This is accurate at 0 and at 180 degrees, where
    the arc cosine of a·b is not.
    """
    scalar = np.abs((a * b).sum(axis=-1))
    cross = a[..., :1] * b[..., 1:] - b[..., :1] * a[..., 1:] - np.cross(a[..., 1:], b[..., 1:])
    return np.degrees(2.0 * np.arctan2(np.linalg.norm(cross, axis=-1), scalar))


def compare(measured: np.ndarray, replayed: np.ndarray, offsets: np.ndarray) -> Errors:
    """Errors of replayed poses.

    Parameters
    ----------
    measured, replayed : (frames, 7 or more) float64
        Position [m] and unit quaternion (w, x, y, z), both with true or both with recorded lengths.
    offsets : (tosses + 1,) int64
        First frame of each toss, and the end.

    Raises
    ------
    ValueError
        Different numbers of frames.
    """
    if len(measured) != len(replayed) or offsets[-1] != len(measured):
        raise ValueError(
            f"replayed has {len(replayed)} frames and offsets end at {offsets[-1]}; allowed is as many as measured, "
            f"{len(measured)}"
        )
    position = np.linalg.norm(measured[:, :3] - replayed[:, :3], axis=1) / SIDE
    return Errors(position, angle(measured[:, 3:7], replayed[:, 3:7]), np.asarray(offsets))
