"""Drawn texts in MJCF, with a few attributes of many: each gives MuJoCo's own scene, or an error."""

from __future__ import annotations

import numpy as np
import pytest

from physics.io.mjcf.files import from_mjcf

mujoco = pytest.importorskip("mujoco", minversion="3.3.7")
from tests.reference import mujoco_model  # noqa: E402 - it imports mujoco

SAME = 1e-9
SIZES = {"box": ".1 .2 .3", "sphere": ".2", "ellipsoid": ".1 .2 .3", "plane": "5 5 .1"}

# Values of attributes; a comma is between two of them.
GEOM = {
    "contype": "0,1,2", "conaffinity": "0,1,2", "condim": "1,3,4,6", "group": "3", "priority": "0,1",
    "friction": ".3,1 .1 .1,0", "mass": "3", "density": "100", "shellinertia": "true", "solmix": "2",
    "solref": ".01 1,.02 2,-100 -10", "solimp": ".95 .99 .001,.5 .6 .1", "margin": ".1", "gap": ".1",
    "fluidshape": "ellipsoid", "pos": ".1 0 0", "euler": "10 20 30", "surfacevel": "1 0 0", "adhesion": "1",
}  # fmt: skip
JOINT = {"armature": ".1", "damping": ".5,.5 .1", "frictionloss": ".1", "stiffness": "1,1 2", "group": "1"}
BODY = {"gravcomp": "1,.3", "euler": "10 20 30", "pos": "0 1 2", "sleep": "init,never"}
OPTION = {
    "timestep": ".01", "gravity": "1 2 3", "density": "1", "viscosity": ".1", "wind": "1 2 3", "integrator": "RK4",
    "cone": "elliptic", "impratio": "10", "o_friction": ".3 .3 0 0 0", "o_margin": ".1", "o_solref": "1 1",
}  # fmt: skip
FLAG = dict.fromkeys(
    ("constraint", "frictionloss", "contact", "spring", "damper", "gravity", "filterparent", "override", "sleep"),
    "enable,disable",
)
COMPILER = {
    "boundmass": "5", "boundinertia": "5", "settotalmass": "9", "balanceinertia": "true", "alignfree": "true,false",
    "inertiafromgeom": "true,false,auto", "angle": "radian,degree", "eulerseq": "zyx", "inertiagrouprange": "0 1",
}  # fmt: skip
DEFAULT = {name: GEOM[name] for name in ("friction", "contype", "density", "condim")}


def some(rng: np.random.Generator, table: dict[str, str], most: int) -> str:
    """Up to so many attributes of a table; most often none."""
    names = rng.choice(sorted(table), rng.integers(0, most + 1) * rng.integers(0, 2), replace=False)
    return " ".join(f'{name}="{rng.choice(table[name].split(","))}"' for name in names)


def geom(rng, kind: str) -> str:
    return f'<geom type="{kind}" size="{SIZES[kind]}" {some(rng, GEOM, 2)}/>'


def body(rng) -> str:
    """A free body; now and then with masses of its own, or with a fixed part."""
    inertial = f'<inertial pos="0 0 {rng.choice(["0", ".1"])}" mass="2" diaginertia="1 1 1.2"/>'
    part = f'<body pos="0 0 .3">{geom(rng, "box")}</body>'
    shape = geom(rng, rng.choice(["box", "sphere", "ellipsoid"]))
    inside = inertial * (rng.random() < 0.2) + shape + part * (rng.random() < 0.1)
    return f'<body {some(rng, BODY, 1)}><joint type="free" {some(rng, JOINT, 1)}/>{inside}</body>'


def plane(rng) -> str:
    mocap = 'mocap="true"' * (rng.random() < 0.2)
    return geom(rng, "plane") if rng.random() < 0.7 else f"<body {mocap} pos='0 0 -1'>{geom(rng, 'plane')}</body>"


def text(rng) -> str:
    world = "".join(plane(rng) for _ in range(rng.integers(0, 3))) + "".join(
        body(rng) for _ in range(rng.integers(1, 4))
    )
    return (
        f"<mujoco><compiler {some(rng, COMPILER, 1)}/>"
        f"<option {some(rng, OPTION, 2)}><flag {some(rng, FLAG, 2)}/></option>"
        f"<default><geom {some(rng, DEFAULT, 1)}/></default><worldbody>{world}</worldbody></mujoco>"
    )


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_no_text_is_silently_another(rng, is_exhaustive, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo keeps a log in the working folder
    read, drawn = 0, 3000 if is_exhaustive else 300
    for _ in range(drawn):
        model = text(rng)
        try:
            compiled = mujoco_model.load(model)
        except ValueError:  # MuJoCo itself refuses it
            continue
        try:
            scene = from_mjcf(model)
        except ValueError:  # `test_mjcf_compiled` looks at the messages
            continue
        read += 1
        found = mujoco_model.differences(compiled, scene)
        assert max(found.values()) <= SAME, (found, model)
    assert read >= drawn / 6
