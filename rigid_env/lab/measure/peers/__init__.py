"""Other engines on our scenes: one file per engine, one interface (`contender.Engine`), imported on demand.

Each gives its own settings for a scene, its defaults first and then those that did best on such scenes, and says
`Unsupported` where it cannot express one. What belongs to the scene (masses, gravity, friction, restitution, no
damping) is the same for all of them and no setting.
"""

from __future__ import annotations

import importlib
import importlib.util

from physics.keywords import nearest_first
from rigid_env.lab.measure.peers.contender import Engine, PeerContender, Unsupported

# Name: (module of ours, its class, what has to be importable)
ENGINES = {
    "mujoco": ("rigid_env.lab.measure.peers.mujoco", "MuJoCo", "mujoco"),
    "pybullet": ("rigid_env.lab.measure.peers.pybullet", "PyBullet", "pybullet"),
    "drake": ("rigid_env.lab.measure.peers.drake", "Drake", "pydrake"),
}

__all__ = ["ENGINES", "Engine", "PeerContender", "Unsupported", "is_installed", "load"]


def is_installed(name: str) -> bool:
    """True if the engine of this name can be imported.

    Raises
    ------
    ValueError
        There is no such peer.
    """
    return importlib.util.find_spec(_entry(name)[2]) is not None


def load(name: str) -> Engine:
    """The engine of this name.

    Raises
    ------
    ValueError
        There is no such peer.
    ModuleNotFoundError
        It is not installed; the message names the extra.
    """
    module, kind, package = _entry(name)
    if not is_installed(name):
        raise ModuleNotFoundError(f'{name} is not installed: pip install "rigid-env[peers]"', name=package)
    return getattr(importlib.import_module(module), kind)()


def _entry(name: str) -> tuple[str, str, str]:
    if name not in ENGINES:
        raise ValueError(f"peer is {name!r}; allowed are {', '.join(nearest_first(name, ENGINES))}")
    return ENGINES[name]
