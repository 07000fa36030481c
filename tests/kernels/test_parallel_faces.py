"""Rounding must not choose which of two faces that lie on each other is clipped, however small the slop is."""

from __future__ import annotations

import numpy as np
import pytest

from physics.kernels.multibody.data.arrays import NUM_CONTACTS
from physics.kernels.multibody.narrowphase.dispatch import find_contacts
from tests.kernels.called import called
from tests.kernels.test_many import blocks

TILTS = (-3e-9, -1e-9, 0.0, 1e-9, 3e-9)
"""Angles [rad] by which the second block is tilted: its corners move by up to 3e-9 m, 3,000 slops."""


def ids(tilt: float, is_error_controlled: bool) -> set[int]:
    """Ids of the contacts of a low block with a cube beside it, which reaches farther up and down, and is tilted."""
    c, s = np.cos(tilt), np.sin(tilt)
    turned = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    many = blocks([(0, 0.25, 0), (0.1, 0.45, 0.75)], [np.eye(3), turned], [(0.5, 0.25, 0.25), (0.5, 0.5, 0.5)])
    many.bodies.body["slop"] = 1e-12
    many.bodies.body["acceleration"] = 9.81
    many = many._replace(even=np.zeros(0) if is_error_controlled else None)
    called(find_contacts, 0.01, None, None, 0, None, many)
    return set(many.contacts.id[: many.counts[NUM_CONTACTS]].tolist())


@pytest.mark.interpreted
def test_contacts_keep_their_ids_under_error_control():
    level = ids(0.0, True)
    assert len(level) == 4
    assert all(ids(tilt, True) == level for tilt in TILTS)
    assert any(ids(tilt, False) != level for tilt in TILTS), "the tilts are too small to try anything"
