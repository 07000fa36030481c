"""Plans: declared effects are compiled, others are not there."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import physics
from physics import scenes
from physics.accuracy import resolve

BLOCK = physics.Block((5, 3, 2), 6.0, pos=(0, 5, 0))
CUBE = physics.Block((2, 2, 2), 6.0, pos=(0, 5, 0))
FLOOR = [physics.HalfSpace((0, 1, 0))]


def switches(*effects, body=BLOCK, walls=(), accuracy="balanced"):
    plan = physics.make_plan(physics.Scene([body], walls, effects), resolve(accuracy))
    names = ("gravity", "contact", "friction", "restitution", "gyroscopic", "pivots")
    return {name for name in names if getattr(plan, name)}


def test_only_what_is_declared_is_on():
    gravity, contact, friction = physics.Gravity(), physics.Contact(), physics.Friction()
    assert switches() == {"gyroscopic"}
    assert switches(body=CUBE) == set()
    assert switches(gravity) == {"gravity", "gyroscopic"}
    assert switches(gravity, contact) == {"gravity", "gyroscopic"}  # nothing to touch
    assert switches(contact, walls=FLOOR) == {"contact", "gyroscopic", "pivots"}
    assert switches(contact, walls=FLOOR, accuracy="fast") == {"contact", "gyroscopic"}
    assert switches(physics.Contact(0.0), friction, walls=FLOOR, body=CUBE) == {
        "contact", "friction", "restitution", "pivots",
    }  # fmt: skip


def test_bodies_that_meet_have_one_kernel_for_two_presets():
    """Their solver knows no pivoting."""
    assert len({physics.make_plan(scenes.tower(3), resolve(name)).key for name in ("fast", "balanced")}) == 1


@pytest.mark.filterwarnings("ignore::physics.SceneWarning")
def test_explain_names_every_effect_and_its_reason():
    text = physics.make_plan(scenes.drop(), resolve("balanced")).explain()
    for word in ("gravity", "wall contact", "friction", "restitution", "gyroscopic torque", "applied wrench"):
        assert word in text
    assert "off  not declared" in physics.make_plan(scenes.tumble(), resolve("balanced")).explain()
    assert "walls do not act" in physics.make_plan(physics.Scene([BLOCK], FLOOR), resolve("fast")).explain()


# What becomes machine code with the step of a scene, and what that calls, before the optimiser makes functions fewer.
LINKED = """
import json, sys, physics
from numba.core.codegen import JITCodeLibrary
from physics.compiler.fused.code_libraries import SharedLibrary
linked, optimise = set(), JITCodeLibrary._optimize_final_module

def noted(library):
    if library.name == "step_worlds" or isinstance(library, SharedLibrary):
        linked.update(f.name for f in library._final_module.functions if not f.is_declaration)
    optimise(library)

JITCodeLibrary._optimize_final_module = noted
"""

PROGRAM = (
    LINKED
    + """
effects = eval(sys.argv[1])
world = physics.World(physics.Scene([physics.Block((5, 3, 2), 6.0, pos=(0, 5, 0))],
                      [physics.HalfSpace((0, 1, 0))], effects), dt=0.01)
world.step()
names = ["collect_wall_contacts", "solve_contacts", "cone_sweeps", "solve_pyramid_lcp", "normal_sweeps",
         "free_rotation", "apply_resistance_torques", "reject_energy_gain", "set_tangential_targets", "bind_laws",
         "hold_linked_loads", "unstretch_tangents"]
print(json.dumps([name for name in names if any(name in function for function in linked)]))
"""
)


def compiled_names(effects: str, cache: Path) -> set[str]:
    """Names of the kernels that become machine code with the step of a scene, compiled in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, effects], env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
        capture_output=True, text=True, check=True, timeout=600,
    )  # fmt: skip
    return set(json.loads(done.stdout))


@pytest.mark.parametrize(
    ("effects", "present", "absent"),
    [
        (
            "[physics.Gravity()]",
            {"free_rotation"},
            {"collect_wall_contacts", "solve_contacts", "cone_sweeps", "normal_sweeps"},
        ),
        pytest.param(
            "[physics.Contact()]",
            {"collect_wall_contacts", "normal_sweeps"},
            {
                "cone_sweeps",
                "solve_pyramid_lcp",
                "apply_resistance_torques",
                "reject_energy_gain",
                "set_tangential_targets",
                "bind_laws",
            },
            marks=pytest.mark.exhaustive,
        ),
        pytest.param(
            "[physics.Contact(), physics.Friction()]",
            {"cone_sweeps"},
            {"unstretch_tangents", "bind_laws"},
            marks=pytest.mark.exhaustive,
        ),
        pytest.param(
            "[physics.Contact(), physics.Friction((0.1, 0.2), (0, 0, 1))]",
            {"cone_sweeps", "unstretch_tangents", "bind_laws"},
            set(),
            marks=pytest.mark.exhaustive,
        ),
    ],
)
def test_machine_code_holds_nothing_that_is_not_declared(effects, present, absent, tmp_path):
    names = compiled_names(effects, tmp_path)
    assert present <= names
    assert not absent & names


def test_an_undeclared_effect_and_one_that_cannot_act_leave_the_same_bits():
    """Friction and restitution on a floor that is never reached change nothing of a flight."""
    flights = []
    for effects in ([physics.Gravity()], [physics.Gravity(), physics.Contact(0.5), physics.Friction(0.3)]):
        body = physics.Block((5, 3, 2), 6.0, pos=(0, 500, 0), angvel=(1, 2, 3))
        world = physics.World(physics.Scene([body], FLOOR, effects), dt=0.01)
        world.step(steps=300)
        flights.append(world.state.tobytes())
    assert flights[0] == flights[1]


def test_an_offset_center_is_compiled_only_where_a_body_has_it():
    effects = [physics.Gravity(), physics.Contact()]

    def plan(center, moments=(3.0, 4.0, 5.0)):
        body = physics.Block((2, 2, 2), 6.0, center=center, inertia_body=moments, pos=(0, 5, 0))
        return physics.make_plan(physics.Scene([CUBE, body], FLOOR, effects), resolve("balanced"))

    without = physics.Scene([CUBE, physics.Block((2, 2, 2), 6.0, inertia_body=(3.0, 4.0, 5.0), pos=(0, 5, 0))],
                            FLOOR, effects)  # fmt: skip
    even, uneven = plan((0, 0, 0)), plan((0, 0.1, 0))
    assert even.offset_frame is None
    assert even.key == physics.make_plan(without, resolve("balanced")).key
    assert uneven.offset_frame
    assert [a for a, b in zip(even.key, uneven.key) if a != b] == [None]
    assert "center of body 1 is not 0" in uneven.explain()
    assert "is not 0" not in even.explain()
    isotropic = plan((0.1, 0, 0), (4.0, 4.0, 4.0))
    assert isotropic.offset_frame
    assert isotropic.gyroscopic is None


def test_fields_are_part_of_the_plan_and_their_order_is_not():
    spring, drag = physics.Spring(), physics.Drag()

    def plan(*effects):
        return physics.make_plan(physics.Scene([BLOCK], effects=effects), resolve("balanced"))

    assert plan().fields == ()
    assert plan().field_columns == 0
    assert plan(spring, drag).key == plan(drag, spring).key
    assert plan(spring, spring, drag).key != plan(spring, drag).key
    assert plan(physics.Drag(0.9)).key == plan(drag).key  # strength is a number, not a kernel
    assert (
        physics.World(physics.Scene([BLOCK], effects=[drag])).params.shape[1]
        == 2 + physics.World(physics.Scene([BLOCK])).params.shape[1]
    )
    text = plan(drag).explain()
    assert "declared: Drag(coefficient=0.47" in text
    for name in ("angular drag", "magnus", "wind", "buoyancy", "spring", "push"):
        assert f"{name} " in text


FIELD_PROGRAM = (
    LINKED
    + """
body = physics.Block((5, 3, 2), 6.0, pos=(0, 5, 0))
world = physics.World(physics.Scene([body], effects=eval(sys.argv[1])), dt=0.01)
world.step()
names = ["field_load", "hold_loads", "drag", "buoyancy", "_wet_block", "spring", "_gust", "magnus", "push"]
found = [name for name in names if any(name in function for function in linked)]
print(json.dumps({"names": found, "members": list(world.scratch[0]["body"].dtype.names)}))
"""
)


def test_machine_code_holds_only_the_fields_that_are_declared(tmp_path, is_exhaustive):
    """Names of compiled functions in the step of a scene: those of its fields, of no field where it has none."""

    def look(effects: str) -> dict:
        done = subprocess.run(
            [sys.executable, "-c", FIELD_PROGRAM, effects], env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
            capture_output=True, text=True, check=True, timeout=600,
        )  # fmt: skip
        return json.loads(done.stdout)

    bare, air = look("[]"), look("[physics.Drag()]")
    assert bare["names"] == []
    assert {"field_load", "drag"} <= set(air["names"])
    assert not {"buoyancy", "_wet_block", "spring", "_gust", "magnus", "push"} & set(air["names"])
    if is_exhaustive:
        water = look("[physics.Buoyancy()]")
        assert {"field_load", "buoyancy", "_wet_block"} <= set(water["names"])
        assert not {"drag", "spring", "_gust", "magnus", "push"} & set(water["names"])
    stored = set(air["members"]) - set(bare["members"])
    assert stored == {
        "held_acceleration", "held_torque", "call_start", "now", "is_felt", "columns", "load_drag_1x2",
        "is_textbook", "is_stiff", "is_coarse", "is_put_back", "rate", "damping", "stage_start", "stage_energy",
    }  # fmt: skip
