"""Other engines on our scenes: one file per engine, one interface (`contender.Engine`), imported on demand.

Each engine lists its own settings for a scene: its defaults first, then settings that did best on such scenes. It
raises `Unsupported` if it cannot express a scene. Properties of the scene (masses, gravity, friction, restitution, no
damping) are the same for all engines and no settings.
"""

from __future__ import annotations

import importlib
import importlib.util

from physics import validation
from rigid_env.lab.measure.peers.contender import Engine, PeerContender, Unsupported

# Name: (module in this package, its class, package of the engine)
ENGINES = {
    "mujoco": ("rigid_env.lab.measure.peers.mujoco", "MuJoCo", "mujoco"),
    "pybullet": ("rigid_env.lab.measure.peers.pybullet", "PyBullet", "pybullet"),
    "drake": ("rigid_env.lab.measure.peers.drake", "Drake", "pydrake"),
}

__all__ = ["ENGINES", "Engine", "PeerContender", "Unsupported", "is_installed", "load"]


def is_installed(name: str) -> bool:
    """True if the package of the engine with this name is installed.

    Raises
    ------
    ValueError
        There is no engine of this name.
    """
    return importlib.util.find_spec(_entry(name)[2]) is not None


def load(name: str) -> Engine:
    """Make the engine of this name.

    Raises
    ------
    ValueError
        There is no engine of this name.
    ModuleNotFoundError
        It is not installed; the message names the extra.
    """
    module, kind, package = _entry(name)
    if not is_installed(name):
        raise ModuleNotFoundError(f'{name} is not installed: pip install "rigid-env[peers]"', name=package)
    return getattr(importlib.import_module(module), kind)()


def _entry(name: str) -> tuple[str, str, str]:
    return ENGINES[validation.one_of(name, ENGINES, "peer")]
