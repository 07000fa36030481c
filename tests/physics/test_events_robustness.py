"""The event-driven scheme under random loads: every step is whole, and what once went wrong stays right."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import physics
from physics import accuracy, scenes

WORLDS, STEPS, DT = 4, 200, 0.02
RADIUS = float(np.linalg.norm(scenes.SIZE)) / 2
# A step of 20 ms has some ten events, a whole sequence of bounces a hundred; 500 are a scheme that gets nowhere. The
# preset's own limit would take a second to be reached.
PRECISE = dataclasses.replace(accuracy.PRESETS["precise"], impacts=500)
# A gap counts as none within a slop; contacts that leave each other's contact mode add theirs.
DEEPEST = 10 * PRECISE.slop * RADIUS


def shove(walls, seed):
    """(worst penetration, reports) of `STEPS` steps of a batch under random wrenches, each held for ten steps."""
    rng = np.random.default_rng(seed)
    world = physics.World(scenes.block_in_box((3.5, 3.5, 3.5), walls=walls), WORLDS, dt=DT, accuracy=PRECISE)
    friction, restitution = rng.uniform(0, 1.2, WORLDS), rng.uniform(0, 0.95, WORLDS)
    friction[0] = restitution[1] = 0.0
    world.set_parameters(friction=friction, restitution=restitution)
    quat = rng.normal(size=(WORLDS, 1, 4))
    quat /= np.linalg.norm(quat, axis=-1, keepdims=True)
    world.set_state(quat=quat, linvel=rng.normal(size=(WORLDS, 1, 3)), angvel=rng.normal(size=(WORLDS, 1, 3)))
    load, deepest, reports = np.zeros((WORLDS, 1, 6)), 0.0, []
    for k in range(STEPS):
        if k % 10 == 0:
            load[:, 0, :3] = rng.normal(size=(WORLDS, 3)) * rng.uniform(0, 200, size=(WORLDS, 1))
            load[:, 0, 3:] = rng.normal(size=(WORLDS, 3)) * rng.uniform(0, 300, size=(WORLDS, 1))
            load[:, 0, :3] -= 5 * world.pos[:, 0] * [1, 0, 1] + [0, 60, 0]  # back to the walls
        reports.append(world.step(load))
        deepest = max(deepest, -physics.diagnose(world).gap.min(), reports[-1].penetration.max())
        assert np.isfinite(world.state).all()
    return deepest, reports


CASES = [(walls, seed) for walls in ("three", "corner") for seed in range(100, 112)]


@pytest.mark.parametrize(("walls", "seed"), CASES)
def test_random_shoves_leave_no_step_unfinished(walls, seed):
    """Every step is resolved, converged and finite, and no deeper than ten slops."""
    deepest, reports = shove(walls, seed)
    wrong = [(k, report.messages()) for k, report in enumerate(reports) if not report.ok]
    assert wrong == []
    assert deepest <= DEEPEST


def found(name, walls, friction, restitution, wrench, **state):
    """One step that once went wrong."""
    return pytest.param(walls, friction, restitution, wrench, state, id=name)


FOUND = [
    found(
        "frictionless vertex on the floor is about to leave",
        "three",
        pos=(0.19406883602610533, 1.043425752243003, 1.7340757446873907),
        quat=(-0.692802893924949, -0.7026445447221205, -0.11742497887617878, 0.1119203657847356),
        linvel=(-3.4281745526249607, -0.45862759248865076, -2.4322305984920183),
        angvel=(0.21670874161485862, -11.261418777662973, -0.4974717348098583),
        wrench=(
            -28.883271381263068,
            -68.52738412126185,
            5.772618047162958,
            -23.554245208032437,
            -18.65524643703243,
            -44.802962487115614,
        ),
        friction=0.0,
        restitution=0.29623987940996116,
    ),
    found(
        "frictionless face on the floor begins to tip",
        "three",
        pos=(-5.58813953574192, 1.0000000000000002, 7.379929023020846),
        quat=(-0.2990383796788884, 0.2990383796788883, 0.6407620833656009, 0.6407620833656007),
        linvel=(-14.651814360294257, 0.0, 1.9167434280971718),
        angvel=(-3.1554436208840472e-30, -4.735057636067783, -3.549874073494553e-30),
        wrench=(
            -188.471101835565,
            -40.474300321016415,
            -208.29825929968976,
            129.85231757361214,
            -15.091634055680682,
            -8.204632402010585,
        ),
        friction=0.0,
        restitution=0.08942221012837923,
    ),
    found(
        "face on the floor slides along a wall",
        "corner",
        pos=(2.503070040791069, 1.0, 4.785264626821475),
        quat=(-0.7071064096627717, -0.7071064096627717, -0.0007248543470706504, 0.0007248543470706487),
        linvel=(0.2662982505439594, 3.077914953700593e-17, -0.3621984094045651),
        angvel=(2.5241323333543595e-20, 0.17814124906519696, 1.2311633939936948e-17),
        wrench=(
            -19.13617031152028,
            -40.618774378578074,
            -22.04053919497428,
            -148.30680136029474,
            403.5200435085438,
            297.3199483610351,
        ),
        friction=0.32374405651664434,
        restitution=0.0,
    ),
    found(
        "face on the floor slides with an edge at the left wall",
        "three",
        pos=(-8.368804704871499, 1.0, -12.033281906051078),
        quat=(0.48648432223504867, -0.48648432223504867, -0.5131598232709819, -0.5131598232709819),
        linvel=(-2.130779084501154, 1.0213789443843286e-09, -1.4383601389880127),
        angvel=(7.897082651555367e-11, 0.881782912873044, 4.816148863531586e-10),
        wrench=(
            22.28933611634818,
            -106.9760214790735,
            58.475353150942354,
            295.491064911806,
            -61.216489187332904,
            160.5279036806301,
        ),
        friction=0.4313052400098878,
        restitution=0.0,
    ),
    found(
        "face on the floor slides with an edge at the right wall",
        "three",
        pos=(7.42640957113994, 1.0, 6.559249140784981),
        quat=(-0.7068744276178461, -0.7068744276178461, 0.018125771154421797, -0.018125771154421804),
        linvel=(-0.5584286472989737, 3.0814879110195774e-33, -0.5462541375867935),
        angvel=(1.0322984501915584e-31, -0.40764122255302204, 4.190823558986625e-31),
        wrench=(
            -1.7948366572142902,
            -267.54580297544555,
            -233.6283481935754,
            156.8777504529895,
            -182.76370029903518,
            34.47910549923591,
        ),
        friction=0.20316396115076113,
        restitution=0.0,
    ),
    found(
        "face on the floor turns with an edge at the wall z = 0",
        "corner",
        pos=(4.277127732280838, 1.0000000000000002, 2.5601627376997143),
        quat=(-0.4895029068235062, 0.4895029068235061, 0.5102812011149714, 0.5102812011149714),
        linvel=(0.8434866312514425, -1.925929944387236e-34, -0.4496620293522583),
        angvel=(-1.1678839182764198e-29, 0.3223763305842398, 7.913646141487152e-31),
        wrench=(
            211.1743419086353,
            -216.1128150612496,
            -223.69065701483035,
            34.745174173905156,
            52.49835659059473,
            -13.8253898524227,
        ),
        friction=0.7095338222752942,
        restitution=0.3459315049759967,
    ),
    found(
        "frictionless face slides into a second vertex at the wall",
        "corner",
        pos=(1.5524257758754123, 0.9999999999999999, 9.60442594158294),
        quat=(-0.4946958818073571, 0.49469588180735713, -0.5052484384170239, -0.5052484384170242),
        linvel=(-2.4787940692577277, -2.447763321362906e-16, -9.005936835300728),
        angvel=(-1.0356488042485885e-16, -1.004460173128561, -3.263487678679518e-16),
        wrench=(
            -487.4410976245098,
            1.3871846590841272,
            -224.07969861286298,
            100.19329457879532,
            332.4593743002285,
            -63.238783516950825,
        ),
        friction=0.0,
        restitution=0.2796121331370818,
    ),
    found(
        "face on the floor swings round to the wall",
        "corner",
        pos=(2.577226712860705, 1.4999999999999996, 1.1751636768734885),
        quat=(-1.3871905771993449e-17, 0.9993675053657469, 1.671935265412116e-17, -0.0355610632440056),
        linvel=(-5.329455193977282, -9.244463733058732e-33, -1.5952410249540758),
        angvel=(-1.279008150137619e-28, -0.6584830690354804, 5.962679107822882e-30),
        wrench=(
            -289.80661931251944,
            -100.05781620271651,
            -29.304638557454005,
            -81.33730337975271,
            165.52737346155075,
            214.90070550886088,
        ),
        friction=0.20316396115076113,
        restitution=0.0,
    ),
    found(
        "face on the floor is turned from rest",
        "corner",
        pos=(2.8325474431456446, 1.0, 9.423375647815028),
        quat=(0.2686708123744441, 0.2686708123744441, -0.6540764439865239, 0.6540764439865239),
        linvel=(0.0, 0.0, 0.0),
        angvel=(0.0, 0.0, 0.0),
        wrench=(
            -18.02206121374278,
            -59.75820746781544,
            -46.13890952868585,
            -360.48175556353414,
            -3.3183534387323563,
            -513.6174025808234,
        ),
        friction=0.5571185557529583,
        restitution=0.1821223575495618,
    ),
]


@pytest.mark.parametrize(("walls", "friction", "restitution", "wrench", "state"), FOUND)
def test_single_steps_that_went_wrong(walls, friction, restitution, wrench, state):
    """Found by random shoves: the state before the step, without what the step before it remembered."""
    world = physics.World(scenes.block_in_box((3.5, 3.5, 3.5), walls=walls), dt=DT, accuracy=PRECISE)
    world.set_parameters(friction=friction, restitution=restitution)
    world.set_state(**{key: np.reshape(value, (1, 1, -1)) for key, value in state.items()})
    report = world.step(np.reshape(wrench, (1, 1, 6)))
    assert report.messages() == {}
    assert report.penetration[0] <= DEEPEST
