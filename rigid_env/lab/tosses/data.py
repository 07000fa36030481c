"""Measured cube tosses: read them from files, and split them into tosses to fit and tosses to test.

Two formats are read. Both are of the public ContactNets data set (Pfrommer, Halm and Posa, *ContactNets: Learning
Discontinuous Contact Dynamics with Smooth, Implicit Representations*, CoRL 2020):

- a ``.npz`` in SI units: ``states`` (frames of all tosses, 13), ``offsets`` (tosses + 1,) and, optionally,
  ``source_index`` (tosses,);
- a folder of ``<number>.pt``, the data set's own files: one torch tensor each, (frames, 19) or (1, frames, 19), of
  position (3), quaternion (4), velocity (3), angular velocity (3) and control (6, not used), with lengths in
  half-widths of the cube, `HALF_WIDTH`.

In both, z is up, the table is z = 0, the quaternion is (w, x, y, z) from body to world, and the angular velocity is in
the body frame.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rigid_env.extras import require

SAMPLE_DT = 1.0 / 148.0  # [s]
HALF_WIDTH = 0.0524  # half the cube's edge [m]
SIDE = 2.0 * HALF_WIDTH  # nominal edge of the cube [m]
MASS = 0.37  # [kg]
INERTIA = 0.00081  # nominal moment of inertia about every axis [kg m²]
GRAVITY = 9.81  # [m/s²]

STATE_SIZE = 13
POS, QUAT, LINVEL, ANGVEL = slice(0, 3), slice(3, 7), slice(7, 10), slice(10, 13)
FILE_SIZE = 19  # columns of the data set's own files

# Largest deviation of a quaternion from unit length; files have single precision, or rounded numbers.
UNIT_ERROR = 1e-3

TRAINING_SHARE = 0.25
SPLIT_SEED = 0


@dataclass(frozen=True)
class Tosses:
    """Measured tosses, one after the other in one array.

    Attributes
    ----------
    states : (frames, 13) float64
        Position [m], unit quaternion, velocity [m/s] in the world frame, angular velocity [rad/s] in the
        **body** frame.
    offsets : (tosses + 1,) int64
        Toss i is ``states[offsets[i]:offsets[i + 1]]``.
    numbers : (tosses,) int64
        Numbers of the tosses in the public data set.
    source : str
        Path that they were read from.
    """

    states: np.ndarray
    offsets: np.ndarray
    numbers: np.ndarray
    source: str = ""

    def __len__(self) -> int:
        return len(self.numbers)

    def __iter__(self) -> Iterator[np.ndarray]:
        return (self.states[a:b] for a, b in zip(self.offsets[:-1], self.offsets[1:]))

    @property
    def lengths(self) -> np.ndarray:
        """Number of frames (tosses,) int64 of each toss."""
        return np.diff(self.offsets)

    @property
    def first(self) -> np.ndarray:
        """First frame (tosses, 13) float64 of each toss."""
        return self.states[self.offsets[:-1]]

    @property
    def duration(self) -> float:
        """Total duration of all tosses [s]."""
        return float((self.lengths - 1).sum() * SAMPLE_DT)

    def subset(self, chosen) -> Tosses:
        """Tosses with these indices, in this order."""
        chosen = np.asarray(chosen, dtype=np.int64)
        parts = [self.states[self.offsets[i] : self.offsets[i + 1]] for i in chosen]
        return join(parts, self.numbers[chosen], self.source)


def join(parts: list[np.ndarray], numbers, source: str = "") -> Tosses:
    """Make `Tosses` from one array (frames, 13) for each toss, and their numbers."""
    offsets = np.concatenate(([0], np.cumsum([len(part) for part in parts]))).astype(np.int64)
    return Tosses(np.concatenate(parts), offsets, np.asarray(numbers, dtype=np.int64), source)


def split(count: int, seed: int = SPLIT_SEED, share: float = TRAINING_SHARE) -> tuple[np.ndarray, np.ndarray]:
    """Split `count` tosses: sorted indices of the tosses to fit, and of the rest.

    The tosses to fit are the first ``share * count`` of a random permutation with this seed.

    Raises
    ------
    ValueError
        Fewer than two tosses, or a share that leaves one side empty.
    """
    fitted = round(share * count)
    if not 0 < fitted < count:
        raise ValueError(f"{count} tosses cannot be divided with share {share!r}; allowed is at least one on each side")
    order = np.random.default_rng(seed).permutation(count)
    return np.sort(order[:fitted]), np.sort(order[fitted:])


def load(path: str | Path) -> Tosses:
    """Read tosses from a ``.npz`` file or from a folder of ``<number>.pt`` files, whose formats the module describes.

    Raises
    ------
    ValueError
        A file or a field that is not as described, named with its value.
    FileNotFoundError
        Nothing at `path`.
    gymnasium.error.DependencyNotInstalled
        A folder of ``.pt`` without torch.
    """
    path = Path(path)
    if path.is_dir():
        return _load_folder(path)
    if not path.exists():
        raise FileNotFoundError(f"{path} does not exist; give a .npz file, or a folder of <number>.pt files")
    if path.suffix != ".npz":
        raise ValueError(f"{path} is neither a .npz file nor a folder of <number>.pt files")
    return _load_npz(path)


def _load_npz(path: Path) -> Tosses:
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except (ValueError, OSError, EOFError) as error:
        raise ValueError(f"{path} cannot be read as a .npz file: {error}") from error
    for name in ("states", "offsets"):
        if name not in arrays:
            raise ValueError(f"{path} has no array {name!r}, only {sorted(arrays)}; see rigid_env/lab/tosses/data.py")
    states, offsets = _checked_states(arrays["states"], f"{path}: states"), arrays["offsets"]
    is_cut = offsets.ndim == 1 and len(offsets) > 1 and np.issubdtype(offsets.dtype, np.integer)
    if not (is_cut and offsets[0] == 0 and offsets[-1] == len(states) and (np.diff(offsets) > 1).all()):
        raise ValueError(
            f"{path}: offsets is {offsets!r}; allowed are integers from 0 to the {len(states)} frames of states, "
            "each at least 2 more than the one before"
        )
    count = len(offsets) - 1
    numbers = arrays.get("source_index", np.arange(count))
    if numbers.shape != (count,):
        raise ValueError(f"{path}: source_index has shape {numbers.shape}; allowed is {(count,)}, one per toss")
    return Tosses(states, offsets.astype(np.int64), numbers.astype(np.int64), str(path))


def _load_folder(path: Path) -> Tosses:
    files = sorted((int(file.stem), file) for file in path.glob("*.pt") if re.fullmatch(r"\d+", file.stem))
    if not files:
        raise ValueError(f"{path} holds no <number>.pt file; give the folder with the tosses themselves")
    torch = _torch()
    return join([_read_pt(file, torch) for _, file in files], [number for number, _ in files], str(path))


def _torch():
    require("agents", "torch", purpose="reading .pt files")
    import torch

    return torch


def _read_pt(file: Path, torch) -> np.ndarray:
    """Read one toss from a ``.pt`` file, converted to SI units: (frames, 13)."""
    try:
        tensor = torch.load(file, map_location="cpu", weights_only=True)
    except Exception as error:  # the unpickler can raise any error
        raise ValueError(f"{file} cannot be read as a torch tensor: {error}") from error
    if not isinstance(tensor, torch.Tensor):
        raise ValueError(f"{file} holds a {type(tensor).__name__}; allowed is a tensor of shape (frames, {FILE_SIZE})")
    rows = tensor.detach().numpy().astype(np.float64)
    if rows.ndim == 3 and rows.shape[0] == 1:
        rows = rows[0]
    if rows.ndim != 2 or rows.shape[1] != FILE_SIZE or len(rows) < 2:
        raise ValueError(f"{file} has shape {rows.shape}; allowed is (frames, {FILE_SIZE}) with at least 2 frames")
    states = rows[:, :STATE_SIZE].copy()
    states[:, POS] *= HALF_WIDTH
    states[:, LINVEL] *= HALF_WIDTH
    return _checked_states(states, str(file))


def _checked_states(states: np.ndarray, field: str) -> np.ndarray:
    """Check states (frames, 13), and return them as float64 with unit quaternions; `field` names them in an error."""
    if states.ndim != 2 or states.shape[1] != STATE_SIZE or not np.issubdtype(states.dtype, np.number):
        raise ValueError(f"{field} has shape {states.shape}; allowed are numbers of shape (frames, {STATE_SIZE})")
    states = states.astype(np.float64)
    bad = np.flatnonzero(~np.isfinite(states).all(axis=1))
    if len(bad):
        raise ValueError(f"{field}: frame {bad[0]} is {states[bad[0]].tolist()}; allowed are finite numbers")
    norms = np.linalg.norm(states[:, QUAT], axis=1, keepdims=True)
    bad = np.flatnonzero(np.abs(norms[:, 0] - 1.0) > UNIT_ERROR)
    if len(bad):
        raise ValueError(
            f"{field}: the quaternion of frame {bad[0]} is {states[bad[0], QUAT].tolist()}; allowed is length 1"
        )
    states[:, QUAT] /= norms
    return states
