"""Policies from files: models of Stable-Baselines3, and small networks as plain arrays.

The ending of a file's name decides how it is read. Reading an ``.npz`` runs no code. A ``.zip`` is a model of
Stable-Baselines3, and code in it runs while it is read.

A policy is a function from observations with the worlds first, (n, entries) or a dict of such arrays, to actions
(n, numbers).

Plain arrays are a NumPy archive (``.npz``) of a fully connected network:

| array | shape | meaning |
| --- | --- | --- |
| `w0`, `w1`, ... | (inputs, outputs) | weights of the layers, in their order |
| `b0`, `b1`, ... | (outputs,) | biases: a layer gives ``x @ w + b`` |
| `activation` | text | after each layer except the last: `tanh` (default), `relu`, `elu`, `sigmoid` or `linear` |
| `output` | text | activation after the last layer; `linear` by default |
| `mean`, `std` | (entries,) | optional: the input x of the network is ``(observation - mean) / std`` |
| `squash` | (entries, n) | optional: n more inputs ``tanh(x @ squash)`` of the first layer, after x |

The parts of an observation that is a dict are joined in the order of their names. Actions are clipped to ±1.
"""

from __future__ import annotations

import json
import os
import re
import sys
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from physics import validation
from physics.keywords import nearest_first
from rigid_env.envs.pretrained import is_id, pretrained_ids, pretrained_path
from rigid_env.extras import require

MODEL, ARRAYS = ".zip", ".npz"
"""Endings of policy files: a model of Stable-Baselines3, the only one read by `pickle`, and plain arrays."""

NAMED = 3  # ids that the error about a missing file names, those spelt like it first

WITHOUT_REPLAY = {"replay_buffer_class": None, "replay_buffer_kwargs": {}, "buffer_size": 1}
"""Arguments for loading a model that only acts, without replay buffer and environment."""

ACTIVATIONS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, 0.0),
    "elu": lambda x: np.where(x > 0.0, x, np.expm1(np.minimum(x, 0.0))),
    "sigmoid": lambda x: 0.5 * (1.0 + np.tanh(0.5 * x)),
    "linear": lambda x: x,
}

SETTINGS = {"PPO": "clip_range", "SAC": "target_entropy", "TD3": "policy_delay", "A2C": "gae_lambda"}
"""Algorithms of Stable-Baselines3 for continuous actions, each with a setting that the following ones lack.

DDPG is TD3 with other settings.
"""

KNOWN = ", ".join((*SETTINGS, "DDPG"))

OTHER_POLICIES = ("sb3_contrib", "sbx")
"""Packages whose policies have the same settings as an algorithm above but cannot be used here."""

Observations = np.ndarray | Mapping[str, np.ndarray]


def load_policy(path: str | os.PathLike) -> Callable[[Observations], np.ndarray]:
    """Read the policy of a file, or the trained one that comes with an environment.

    Parameters
    ----------
    path : str or Path
        An id such as ``rigid_env/BlockReach-v0``, for the policy that comes with it; else a file, whose ending decides.
        ``.npz``: plain arrays, without code. ``.zip``: a model of Stable-Baselines3, which needs the extra `agents`.
        Code in a model runs while it is read, and a line on standard error says so: read only models from people whom
        you trust.

    Returns
    -------
    callable
        Function from observations with the worlds first to the most likely actions (n, numbers).

    Raises
    ------
    ValueError
        There is no such file, or it has another format.
    gymnasium.error.DependencyNotInstalled
        It is a model, and the extra is not installed.
    """
    if is_id(os.fspath(validation.path(path, "policy"))) and not Path(path).exists():
        return Network.load(pretrained_path(os.fspath(path)))
    path = Path(path)
    near = ", ".join(nearest_first(str(path), pretrained_ids())[:NAMED])
    ids = f"the id of an environment that comes with one, as {near}"
    allowed = f"allowed are a model of Stable-Baselines3 ({MODEL}), plain arrays ({ARRAYS}), or {ids}"
    if not path.is_file():
        raise ValueError(f"policy is {str(path)!r}, which is no file; {allowed}")
    ending = path.suffix.lower()
    if ending == ARRAYS:
        return Network.load(path)
    if ending != MODEL:
        raise ValueError(f"policy is {str(path)!r}, whose ending says nothing; {allowed}")
    return greedy(load_model(path))


def act(policy: Callable[[Observations], np.ndarray], observation: Observations) -> np.ndarray:
    """Return the action (numbers,) of a policy for one observation (entries,), or for a dict of its parts."""
    if isinstance(observation, Mapping):
        return policy({name: part[None] for name, part in observation.items()})[0]
    return policy(observation[None])[0]


def tell_code_runs(path: Path) -> None:
    """Print a warning on standard error that the file about to be read can run code."""
    told = "a model of Stable-Baselines3: code in it runs while it is read; take it from those you trust only"
    print(f"rigid-env: {path} is {told}", file=sys.stderr, flush=True)


def greedy(model: Any) -> Callable[[Observations], np.ndarray]:
    """Make a policy of a model of Stable-Baselines3: the most likely action for each observation."""
    return lambda observations: model.predict(observations, deterministic=True)[0]


def load_model(path: Path) -> Any:
    """Load a model of Stable-Baselines3 that only acts; a line on standard error warns first that its code runs.

    Raises
    ------
    ValueError
        The file is no such model, or its algorithm is not in `SETTINGS`.
    gymnasium.error.DependencyNotInstalled
        The extra `agents` is not installed.
    """
    algorithm = _algorithm(path)
    require("agents", "torch", "stable_baselines3", purpose="a policy of Stable-Baselines3")
    import stable_baselines3

    tell_code_runs(path)
    return getattr(stable_baselines3, algorithm).load(path, device="cpu", custom_objects=WITHOUT_REPLAY)


def _algorithm(path: Path) -> str:
    """Name of the algorithm of a model's file, found by its settings without running code."""
    try:
        with zipfile.ZipFile(path) as content:
            settings = content.read("data")
    except Exception:  # any error means that the file is no model
        told = f"allowed with the ending {MODEL} is a model of Stable-Baselines3, as its `save` writes it"
        raise ValueError(f"policy is {str(path)!r}, which is none; {told}") from None
    try:
        kept = json.loads(settings)
        algorithm = next(algorithm for algorithm, setting in SETTINGS.items() if setting in kept)
        source = kept.get("policy_class", {}).get("__module__", "")
    except (ValueError, AttributeError, StopIteration):
        raise ValueError(f"policy is {str(path)!r}, of an unknown algorithm; allowed are {KNOWN}") from None
    if source.split(".")[0] in OTHER_POLICIES:
        why = "which remembers earlier observations" if "recurrent" in source else "which Stable-Baselines3 cannot load"
        raise ValueError(f"policy is {str(path)!r}, of {source}, {why}; allowed are {KNOWN}")
    return algorithm


class Network:
    """Fully connected network of plain arrays; see the table in this module.

    Parameters
    ----------
    layers : sequence of pairs of arrays
        Weights (inputs, outputs) and biases (outputs,) of each layer.
    activation, output : str
        Activation after each layer except the last, and after the last; keys of `ACTIVATIONS`.
    mean, std : (entries,) array_like, optional
        The layers get x = (observation - mean) / std.
    squash : (entries, n) array_like, optional
        The first layer gets n inputs tanh(x @ squash) more, after x.

    Raises
    ------
    ValueError
        Arrays that do not fit each other or are not finite, or an unknown activation.
    """

    def __init__(
        self,
        layers: Sequence[tuple[np.ndarray, np.ndarray]],
        activation: str = "tanh",
        output: str = "linear",
        mean: np.ndarray | None = None,
        std: np.ndarray | None = None,
        squash: np.ndarray | None = None,
    ):
        if not layers:
            raise ValueError("layers is empty; allowed is at least one pair of weights and biases")
        self.layers = [(_numbers(w, f"w{k}", 2), _numbers(b, f"b{k}", 1)) for k, (w, b) in enumerate(layers)]
        self.squash = None if squash is None else _numbers(squash, "squash", 2)
        size = len(self.layers[0][0])
        if self.squash is not None and len(self.squash) != self.inputs:
            raise ValueError(f"squash has shape {self.squash.shape}; w0 of {size} inputs allows ({self.inputs}, n)")
        for k, (w, b) in enumerate(self.layers):
            if w.shape != (size, *b.shape):
                raise ValueError(f"w{k} has shape {w.shape}, b{k} {b.shape}; allowed is w{k} of ({size}, len(b{k}))")
            size = len(b)
        self.activation = validation.one_of(activation, ACTIVATIONS, "activation")
        self.output = validation.one_of(output, ACTIVATIONS, "output")
        self.mean = np.zeros(self.inputs) if mean is None else validation.finite(mean, (self.inputs,), "mean")
        self.std = np.ones(self.inputs) if std is None else validation.positive(std, (self.inputs,), "std")

    @property
    def inputs(self) -> int:
        """Number of entries of an observation."""
        more = 0 if self.squash is None else self.squash.shape[1]
        return len(self.layers[0][0]) - more

    def __call__(self, observations: Observations) -> np.ndarray:
        """Actions (n, numbers) float32 for observations (n, entries), or for a dict of parts of them.

        Raises
        ------
        ValueError
            Observations of another length.
        """
        if isinstance(observations, Mapping):
            observations = np.concatenate([observations[name] for name in sorted(observations)], axis=-1)
        x = np.asarray(observations, dtype=np.float64)
        if x.ndim != 2 or x.shape[1] != self.inputs:
            raise ValueError(f"observations have shape {x.shape}; the policy allows (n, {self.inputs})")
        x = (x - self.mean) / self.std
        if self.squash is not None:
            x = np.concatenate([x, np.tanh(x @ self.squash)], axis=1)
        inner = ACTIVATIONS[self.activation]
        for w, b in self.layers[:-1]:
            x = inner(x @ w + b)
        w, b = self.layers[-1]
        return np.clip(ACTIVATIONS[self.output](x @ w + b), -1.0, 1.0).astype(np.float32)

    def save(self, path: str | os.PathLike) -> Path:
        """Write the network to a file whose name ends in ``.npz``, for `load_policy`; return the path."""
        if Path(validation.path(path)).suffix.lower() != ARRAYS:
            raise ValueError(f"path is {str(path)!r}; allowed is the ending {ARRAYS}")
        arrays = {f"{name}{k}": _short(part) for k, pair in enumerate(self.layers) for name, part in zip("wb", pair)}
        if self.squash is not None:
            arrays["squash"] = _short(self.squash)
        with open(path, "wb") as file:
            np.savez(file, **arrays, activation=self.activation, output=self.output, mean=self.mean, std=self.std)
        return Path(path)

    @classmethod
    def load(cls, path: str | os.PathLike) -> Network:
        """Read a network without running code from the file.

        Raises
        ------
        ValueError
            The file contains no network, or a damaged one.
        """
        if not zipfile.is_zipfile(path):
            raise ValueError(f"policy is {str(path)!r}, which holds no network; allowed is what Network.save writes")
        try:
            with np.load(path, allow_pickle=False) as file:
                parts = dict(file)
            count = sum(re.fullmatch(r"w\d+", name) is not None for name in parts)
            layers = [(parts[f"w{k}"], parts[f"b{k}"]) for k in range(count)]
            words = {name: str(parts[name]) for name in ("activation", "output") if name in parts}
            return cls(layers, **words, mean=parts.get("mean"), std=parts.get("std"), squash=parts.get("squash"))
        except Exception as error:  # any error means that the file holds no network
            told = f"there is no {error}" if isinstance(error, KeyError) else error
            raise ValueError(f"policy is {str(path)!r}, which holds no network ({told})") from None


def _numbers(array: np.ndarray, name: str, axes: int) -> np.ndarray:
    """Check that an array has finite numbers, `axes` axes, and is not empty; returns it as float64."""
    array = np.asarray(array)
    if array.dtype.kind not in "fiu" or array.ndim != axes or array.size == 0 or not np.isfinite(array).all():
        raise ValueError(f"{name} has shape {array.shape} of {array.dtype}; allowed are finite numbers, {axes} axes")
    return array.astype(np.float64)


def _short(array: np.ndarray) -> np.ndarray:
    """Return an array in single precision where that loses nothing."""
    single = array.astype(np.float32)
    return single if np.array_equal(single, array) else array
