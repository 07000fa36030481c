"""The event-driven scheme where contacts can share their forces in many ways: one is found, once."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import physics
from physics import scenes

HALF = np.array(scenes.SIZE) / 2
MU = 0.5

# --- a face slides round a corner of it that holds --------------------------------------------------------------------

CORNERS = np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)]) * HALF[[0, 2]]  # x and z in the body; the first one holds
ROUND_Y = scenes.MASS / 3 * (HALF[0] ** 2 + HALF[2] ** 2)  # moment of inertia about the vertical


def pivoting(angle, rate, force, torque):
    """(angular acceleration, normal forces, force of the corner that holds along x and z) from six balances.

    Unknown are the angular acceleration α about the vertical, the normal forces p = y0 + y1 x + y2 z, affine in the
    place in the body, and the horizontal force f of the corner that holds. Of forces along x and z, of those along y,
    and of moments about the centre of mass, which has no acceleration but that of a circle about the corner:

        m (α ŷ x r - ω² r) = F + f - μ Σ p_k d_k,    Σ p_k = m g - F_y,    Σ r_k x f_k + T = I_y α ŷ
    """
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, s], [-s, c]])  # of (x, z) about y
    places = CORNERS @ turn.T
    arms = np.column_stack([places[:, 0], np.full(4, -HALF[1]), places[:, 1]])
    to_center = -places[0]  # from the corner that holds
    spun = np.array([to_center[1], -to_center[0]])  # ŷ x r in (x, z)
    slips = np.array([(p[1], -p[0]) for p in places - places[0]]) * np.sign(rate)
    pushes = np.zeros((4, 3))
    pushes[:, 1] = 1.0
    for k in range(1, 4):
        pushes[k, [0, 2]] = -MU * slips[k] / np.linalg.norm(slips[k])
    shapes = np.column_stack([np.ones(4), CORNERS])  # (corner, coefficient)
    A, b = np.zeros((6, 6)), np.zeros(6)  # unknowns α, y0, y1, y2, f_x, f_z
    A[:3, 1:4] = pushes.T @ shapes
    A[3:, 1:4] = np.cross(arms, pushes).T @ shapes
    for column, unit in ((4, (1, 0, 0)), (5, (0, 0, 1))):
        A[:3, column], A[3:, column] = unit, np.cross(arms[0], unit)
    A[[0, 2], 0], A[4, 0] = -scenes.MASS * spun, -ROUND_Y
    center = -scenes.MASS * rate**2 * to_center
    b[:3] = np.array([center[0], scenes.MASS * scenes.GRAVITY, center[1]]) - force
    b[3:] = -np.asarray(torque)
    alpha, *coefficients, fx, fz = np.linalg.solve(A, b)
    return alpha, shapes @ coefficients, np.array([fx, fz])


@pytest.mark.interpreted
def test_a_face_slides_round_a_corner_that_holds():
    """Pose and force after 50 ms against SciPy's integral of the six balances, to the tolerance of the scheme.

    Each smooth step is right to 1e-10 of the body's size (3.1 m) and speed (1.5 m/s); there are a few: 1e-9.
    """
    rate, torque, duration = 0.5, (0.0, 8.0, 0.0), 0.05
    _, _, needed = pivoting(0.0, rate, np.zeros(3), torque)
    force = np.array([needed[0], 0.0, needed[1]])  # so that the corner has little to hold
    for angle in (0.0, rate * duration):
        _, normal, held = pivoting(angle, rate, force, torque)
        assert normal.min() > 0.0
        assert np.linalg.norm(held) < 0.9 * MU * normal[0]
    found = solve_ivp(
        lambda t, y: (y[1], pivoting(y[0], y[1], force, torque)[0]), (0, duration), (0.0, rate), rtol=1e-12, atol=1e-13
    )
    angle, rate_after = found.y[:, -1]

    start = (0.0, HALF[1], 0.0)
    velocity = np.cross((0.0, rate, 0.0), (-HALF[0], 0.0, -HALF[2]))
    world = physics.World(
        scenes.block_in_box(start, None, MU, linvel=tuple(velocity), angvel=(0.0, rate, 0.0)), dt=duration,
        accuracy="precise",
    )  # fmt: skip
    report = world.step(np.concatenate([force, torque])[None, None])
    assert report.messages() == {}
    assert report.fallbacks[0] == 0
    quat = np.array([np.cos(angle / 2), 0.0, np.sin(angle / 2), 0.0])
    c, s = np.cos(angle), np.sin(angle)
    corner = HALF[[0, 2]] @ np.array([[c, -s], [s, c]])
    np.testing.assert_allclose(world.quat[0, 0], quat, atol=1e-9)
    np.testing.assert_allclose(world.angvel[0, 0], (0.0, rate_after, 0.0), atol=1e-9)
    np.testing.assert_allclose(world.pos[0, 0, [0, 2]], HALF[[0, 2]] - corner, atol=1e-9)


# --- states in which the search went round in circles -----------------------------------------------------------------

# Five control periods of an agent that pushes with all its strength, found by the soak of the environments. Before,
# each was hundreds of events, and impulses where a force would have done (`fallbacks`): up to 245 of them.
FULL = scenes.MASS * scenes.GRAVITY / np.sqrt(3) * np.repeat([0.9, 0.5 * HALF[0]], 3)  # limits of the environments
FOUND = {
    "an edge at the wall and a corner of the face on the floor hold": {
        "pos": (7.3455476245511955, 1.0000000000000082, -11.989267720744875),
        "quat": (-0.040297879851569914, 0.04029787985156753, -0.7059575630868107, -0.7059575630868111),
        "linvel": (-0.4161562959762989, -7.66100299297333e-21, -0.91602491358501),
        "angvel": (-6.227886252554421e-18, -0.345098732635767, 3.7596687066560143e-17),
        "wrench": FULL * (1, 1, -1, 1, -1, 1),
    },
    "at rest with an edge at the wall, about to turn round it": {
        "pos": (-7.087763200377351, 1.0, -0.5073028367334308),
        "quat": (0.20475935855296135, 0.20475935855296368, -0.6768113511791732, 0.676811351179175),
        "linvel": (0.0, 0.0, 0.0),
        "angvel": (0.0, 0.0, 0.0),
        "wrench": FULL * (-1, -1, 1, -1, -1, 1),
    },
    "an edge slides along the wall until a corner of the face stops": {
        "pos": (8.640437856076483, 1.5000000000000202, -23.515899773612137),
        "quat": (0.7577085736121091, 3.0040303154803035e-15, -0.6525930718868406, -2.474699159554593e-15),
        "linvel": (0.1834347062349704, 7.632342729606735e-18, -0.3618809059284579),
        "angvel": (-7.527312547084163e-17, -0.07892610465423205, -5.89290168167364e-16),
        "wrench": FULL * (1, -1, 1, 1, 1, 1),
    },
    "an edge comes down on the floor while the other one rocks at the wall": {
        "pos": (-8.999341890740029, 1.5134765614931458, 6.289713221114279),
        "quat": (-0.7070111235117651, 0.0019085198935965407, 0.7071972740444877, -0.0019090223920493704),
        "linvel": (-0.030445005561924213, -0.34419259442809214, 3.4453326562472837),
        "angvel": (0.13808552797686233, 0.01217910766600346, -6.575353023939253e-05),
        "wrench": FULL * (-1, 1, 1, -1, -1, 1),
    },
    "a face slides slowly until a corner stops": {
        "pos": (0.5032951959112072, 1.4999999999999982, -2.083458415796585),
        "quat": (0.39846821368036284, 4.7693754433585e-16, 0.9171821425902168, -1.0495789073293625e-15),
        "linvel": (0.0009896183365934366, -9.244463733058732e-33, -0.002106528388869894),
        "angvel": (1.5985218538414058e-32, -0.0008643759004472738, 6.162975822039155e-33),
        "wrench": np.array([
            22.369581999957564,
            25.74521567344666,
            0.4823432036004961,
            -1.689292122144252,
            -42.512405057251456,
            -14.842331745475532,
        ]),
    },
    "a face slides along the floor and another along the wall": {
        "pos": (-9.302349469622936, 0.379041599684555, 5.850879345899166),
        "quat": (-0.4999999949068348, 0.4999999949068348, -0.5000000050931652, -0.5000000050931652),
        "linvel": (3.3698275059559644e-06, 2.0813865496578654e-13, 0.34310176581869156),
        "angvel": (3.359869182611392e-14, -4.1837456202200636e-06, 2.885194047547827e-13),
        "wrench": np.repeat([38.87810997622269, 17.3970261874063], 3) * (-1, 1, -1, -1, -1, 1),
        "parameters": {
            "mass": 7.627008922988802,
            "size": (1.6109140674010616, 1.395301093572757, 0.75808319936911),
            "friction": 0.33426581827808055,
        },
    },
    "a corner flies close along the floor": {
        "pos": (3.334396879642637, 1.5021191631934394, -4.0079165797110345),
        "quat": (0.27661855399709956, -0.6657612036167873, 0.6385688295777686, -0.26921003925366443),
        "linvel": (3.3731850505249037, 0.1888003886952484, -6.444248062299282),
        "angvel": (-0.5691296667791957, 12.328763883503369, 0.32626276821936806),
        "wrench": np.repeat([385.6800050764047, 315.3753481611172], 3) * (-1, 1, -1, -1, 1, 1),
        "parameters": {
            "mass": 75.6617243465574,
            "size": (2.943764878749948, 1.0052111445564467, 1.2741579279558306),
            "friction": 0.31785030247968304,
        },
    },
}  # fmt: skip
EVENTS = 30  # contact problems at most: each event poses one or two, and what happens here is a dozen events


@pytest.mark.parametrize("name", FOUND)
def test_what_holds_is_found_once(name):
    """No impulse where a force holds, few events, and nothing deeper than ten slops."""
    state = dict(FOUND[name])
    wrench = state.pop("wrench")
    world = physics.World(scenes.block_in_box((0.0, 6.0, 0.0), 0.2, MU), dt=0.005, accuracy="precise")
    world.set_parameters(**state.pop("parameters", {}))
    world.set_state(**{key: np.reshape(value, (1, 1, -1)) for key, value in state.items()})
    solves, deepest = 0, max(0.0, -physics.diagnose(world).gap[0, 0])  # one was found 3.3e-8 m deep, and stays so
    for _ in range(5):
        report = world.step(wrench[None, None])
        solves += report.solves[0]
        assert report.messages() == {}
        assert report.fallbacks[0] == 0
        assert report.penetration[0] <= deepest + 10 * world.accuracy.slop * np.linalg.norm(HALF)
    assert solves <= EVENTS
