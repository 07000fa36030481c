"""Model compiled by MuJoCo: access to its arrays, and names, lines and frames of its elements."""

from __future__ import annotations

import contextlib
import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from physics.io.mjcf.text import Element, ModelError, label
from physics.rotations import product, rotation_matrices

# Name of the list of `mujoco.MjSpec` that holds the elements of each kind.
LISTS = {
    "actuator": "actuators", "body": "bodies", "equality": "equalities", "flex": "flexes", "geom": "geoms",
    "joint": "joints", "pair": "pairs", "tendon": "tendons",
}  # fmt: skip
PARSED = (".xml", ".urdf")  # endings of files that MuJoCo opens


class Pose(NamedTuple):
    """Origin (3,) [m] and unit quaternion (4,) of a frame in another frame."""

    pos: np.ndarray
    quat: np.ndarray

    def __matmul__(self, inner: Pose) -> Pose:
        """Compose two poses: `inner` is given in the frame of this pose, the result in the frame around both."""
        return Pose(self.pos + self.R @ inner.pos, product(self.quat, inner.quat))

    @property
    def inverse(self) -> Pose:
        """Inverse pose: the outer frame, given in the inner frame."""
        return Pose(-self.R.T @ self.pos, self.quat * (1, -1, -1, -1))

    @property
    def R(self) -> np.ndarray:
        """Rotation matrix (3, 3), from the inner frame to the outer frame."""
        return rotation_matrices(self.quat)


ORIGIN = Pose(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))


class Model:
    """Model that MuJoCo compiles, with names, lines and frames of its elements.

    Parameters
    ----------
    mujoco : module
        The package `mujoco`.
    spec : mujoco.MjSpec
        Model as MuJoCo has read it; it is compiled here.
    root : Element
        Root element of the same text, parsed here, for lines that `spec` does not know.

    Attributes
    ----------
    data : mujoco.MjModel
        The compiled model.
    frames : list of Pose
        Pose of each body, in the frame of the moving body to which it is fixed, or of the world.
    geom_frames : list of Pose
        Pose of each geom, in the frame of the moving body to which it is fixed, or of the world.
    """

    def __init__(self, mujoco: ModuleType, spec: Any, root: Element):
        self._mujoco, self.root = mujoco, root
        self._spec = spec  # older versions free its elements with it
        self.data = spec.compile()
        self._found = {kind: {e.id: e for e in getattr(spec, name, [])} for kind, name in LISTS.items()}
        m = self.data
        self.frames = [ORIGIN]
        for b in range(1, m.nbody):
            inner = Pose(m.body_pos[b], m.body_quat[b])
            self.frames.append(ORIGIN if m.body_dofnum[b] else self._parent(b) @ inner)
        self.geom_frames = [self.frames[m.geom_bodyid[g]] @ Pose(m.geom_pos[g], m.geom_quat[g]) for g in range(m.ngeom)]

    def _parent(self, b: int) -> Pose:
        return self.frames[self.data.body_parentid[b]]

    def moves(self, b: int) -> bool:
        """True if the body with number `b`, or the body to which it is fixed, has a joint."""
        return bool(self.data.body_dofnum[self.data.body_weldid[b]] > 0)

    def value(self, name: str, default: Any) -> Any:
        """Array `name` of the compiled model, or `default` if this version of MuJoCo lacks it."""
        return getattr(self.data, name, default)

    def disables(self, *flags: str) -> bool:
        """True if the model disables any of these features of MuJoCo, such as "GRAVITY"."""
        bits = [getattr(self._mujoco.mjtDisableBit, f"mjDSBL_{flag}", 0) for flag in flags]
        return any(self.data.opt.disableflags & int(bit) for bit in bits)

    def enables(self, flag: str) -> bool:
        """True if the model enables this feature of MuJoCo, such as "OVERRIDE"."""
        bit = getattr(self._mujoco.mjtEnableBit, f"mjENBL_{flag}", 0)
        return bool(self.data.opt.enableflags & int(bit))

    def kind(self, enumeration: str, prefix: str, number: int) -> str:
        """Name of the value `number` in one of MuJoCo's enumerations, such as ``box``, without `prefix`."""
        return getattr(self._mujoco, enumeration)(int(number)).name.removeprefix(prefix).lower()

    def spec(self, kind: str, k: int) -> Any:
        """Element number `k` of a kind, such as "geom", in MuJoCo's `MjSpec`; None if MuJoCo added the element."""
        return self._found[kind].get(k)

    def name(self, kind: str, k: int) -> str:
        """Name of element number `k` of a kind, such as "geom"; "" if it has none."""
        return self._mujoco.mj_id2name(self.data, getattr(self._mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), k) or ""

    def label(self, kind: str, k: int) -> str:
        """Label of element number `k` of a kind in messages; a geom or joint without a name is labelled by its body."""
        name = self.name(kind, k)
        if name or kind not in ("geom", "joint"):
            return label(kind, name)
        body = int(self.data.geom_bodyid[k] if kind == "geom" else self.data.jnt_bodyid[k])
        return f"{label(kind, name)} of {label('body', self.name('body', body))}" if body else label(kind, name)

    def line(self, kind: str, k: int) -> int:
        """Line of element number `k` of a kind in the text; 0 if unknown, as in an included file."""
        found = re.search(r"line (\d+)", getattr(self.spec(kind, k), "info", "") or "")
        if not found and kind == "joint":
            return self.line("body", int(self.data.jnt_bodyid[k]))
        return int(found.group(1)) if found else 0

    def stated_points(self, mesh: int) -> np.ndarray | None:
        """Points (n, 3) of the mesh with this number as the text states them; None if they are in a file."""
        for element in self.root.iter("mesh"):
            if element.get("name") == self.name("mesh", mesh) and element.get("vertex"):
                return np.array(element.get("vertex", "").split(), dtype=float).reshape(-1, 3)
        return None

    def error(self, kind: str, k: int, message: str) -> ModelError:
        """Make the error about element number `k` of a kind; `message` follows the element's label."""
        return ModelError(f"{self.label(kind, k)} {message}", self.line(kind, k))


def compile_model(mujoco: ModuleType, text: str, root: Element, path: Path | None) -> Model:
    """Compile a model with MuJoCo.

    Parameters
    ----------
    mujoco : module
        The package `mujoco`.
    text : str
        Text of the model, MJCF or URDF.
    root : Element
        Root element of the parsed text.
    path : Path, optional
        File of the text; included files and meshes are searched beside it.

    Raises
    ------
    ValueError
        MuJoCo refuses the model; the message holds MuJoCo's own.
    """
    try:
        with _told_warnings(mujoco):
            if path is not None and path.suffix.lower() in PARSED:
                spec = mujoco.MjSpec.from_file(str(path))
            else:
                spec = mujoco.MjSpec.from_string(text)
                spec.modelfiledir = str(path.parent) if path is not None else ""
            return Model(mujoco, spec, root)
    except (ValueError, mujoco.FatalError) as error:
        raise _refusal(str(error), root) from None


def _refusal(message: str, root: Element) -> ModelError:
    """Make the error with MuJoCo's `message`, followed by the value of the attribute that the message names."""
    told = ", ".join(line.strip() for line in message.splitlines() if line.strip())
    place, attribute = re.search(r", line (\d+)", told), re.search(r"attribute:? '(\w+)'", told)
    line = int(place.group(1)) if place else 0
    for element in root.iter():
        value = element.get(attribute.group(1)) if attribute and element.line == line else None
        if value is not None:
            told += f"; {attribute.group(1)} is {value!r}"
            break
    return ModelError(f"MuJoCo refuses it: {told}", line)


@contextlib.contextmanager
def _told_warnings(mujoco: ModuleType) -> Iterator[None]:
    """Context manager in which MuJoCo's warnings become Python warnings, each once, instead of lines of a log file."""
    before, told = mujoco.get_mju_user_warning(), []
    mujoco.set_mju_user_warning(told.append)
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            yield
    finally:
        mujoco.set_mju_user_warning(before)
    longer = [str(warning.message) for warning in caught]
    shorter = [message for message in told if not any(text.startswith(message) for text in longer)]
    for message in dict.fromkeys(longer + shorter):
        warnings.warn(message, stacklevel=7)  # the call of `load_mjcf`
