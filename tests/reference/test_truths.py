"""The stored truths: what they say is possible, and they can be had again."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from physics import scenes
from tests.reference import closed_box, hybrid, truths
from tests.reference.hybrid import body
from tests.tiers.sweep import sweep


@pytest.mark.parametrize("name", ["vertex_drop", "drop"])
def test_block_comes_to_rest_on_its_face_outside_the_walls(name):
    truth = truths.load(name)
    problem, _ = hybrid.from_scene(scenes.by_name(name))
    rows = np.hstack([truth[key] for key in truths.STATE])
    assert rows.shape == (len(truth["t"]), 13)
    energies = [body.energy(problem, row) for row in rows]
    # Newton's law with friction could gain energy; here it does not, up to rounding of some 200 J.
    assert np.diff(energies).max() < 1e-12
    for row in rows:
        assert body.gaps(problem, row).min() > -1e-14
    assert truth["events"][-1][1] == "rest"
    assert rows[-1, 1] == pytest.approx(scenes.SIZE[1] / 2, abs=1e-14)
    np.testing.assert_allclose(rows[-1, 7:], 0.0, atol=1e-13)
    assert max(truth["error"][key] for key in truths.STATE) < 1e-8


@pytest.mark.parametrize(("name", "until"), sweep([("vertex_drop", 1.3), ("drop", 1.7)], [("drop", 1.7)]))
def test_event_driven_truth_can_be_had_again(name, until):
    truth = truths.load(name)
    times = np.array(truth["t"])[np.array(truth["t"]) <= until]
    problem, y = hybrid.from_scene(scenes.by_name(name))
    result = hybrid.simulate(problem, y, until, times, truths.FINE)
    for key, columns in truths.STATE.items():
        stored = np.array(truth[key])[: len(times)]
        # On another machine rounding may differ; the stored error bounds more than rounding does.
        np.testing.assert_allclose(result.samples[:, columns], stored, atol=10 * truth["error"][key] + 1e-13)
    counted = [e for e in result.events if e.kind == "impact" and e.impulse[0] > truths.COUNTED]
    stored = [e for e in truth["events"] if e[1] == "impact" and e[0] <= until and e[4] > truths.COUNTED]
    assert [[e.kind, *e.contact] for e in counted] == [e[1:4] for e in stored]


def test_multiple_precision_truth_can_be_had_again():
    truth = truths.load("closed_box")
    problem, _ = hybrid.from_scene(scenes.closed_box())
    with mpmath.workdps(36):
        start = closed_box.start(scenes.closed_box().bodies[0])
        hits, _ = closed_box.ElasticBlock(problem, 28, 0.035).run(start, 3, 1e-3)
        for hit, (t, *name), state in zip(hits, truth["hits"], truth["states"]):
            assert problem.name(hit.contact) == name
            # 30 digits are stored.
            assert abs(hit.t - mpmath.mpf(t)) < 1e-28
            assert truths.distance(closed_box.world_frame(hit.state), [mpmath.mpf(a) for a in state]) < 1e-27
