"""Contact between the geoms of a model compiled by MuJoCo: friction of pairs, and errors for other properties."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from physics.io.mjcf.contacts import LEAST_FRICTION, Surface, dynamic_friction
from physics.io.mjcf.model import Model
from physics.io.mjcf.text import ModelError

# MuJoCo's defaults. A contact that is at least as hard and as damped as these counts as rigid.
TIME_CONSTANT, DAMPING_RATIO = 0.02, 1.0
IMPEDANCE = (0.9, 0.95)


class Touching:
    """Contact between the geoms of a model: which pairs touch, with which friction.

    Parameters
    ----------
    model : Model
        Model compiled by MuJoCo.
    """

    def __init__(self, model: Model):
        m = model.data
        self._model = model
        self._is_off = model.disables("CONSTRAINT", "CONTACT")
        self._overrides = model.enables("OVERRIDE")
        self._pairs = {frozenset(map(int, (m.pair_geom1[k], m.pair_geom2[k]))): k for k in range(m.npair)}
        self._excluded = {frozenset((int(code) >> 16, int(code) & 0xFFFF)) for code in m.exclude_signature}
        bodies = {body for pair in self._excluded for body in pair}
        self._told = {g for pair in self._pairs for g in pair}
        self._special = self._told | {g for g in range(m.ngeom) if int(m.geom_bodyid[g]) in bodies}

    def may_touch(self, geom: int) -> bool:
        """True if anything can touch the geom with this number; False for geoms that are only visible."""
        m = self._model.data
        return bool(m.geom_contype[geom] or m.geom_conaffinity[geom] or geom in self._told)

    def surface(self, geom: int) -> Surface:
        """Contact properties of the geom with this number."""
        m = self._model.data
        friction = m.opt.o_friction[0] if self._overrides else m.geom_friction[geom, 0]
        return Surface(
            self._model.label("geom", geom),
            self._model.line("geom", geom),
            *(int(array[geom]) for array in (m.geom_contype, m.geom_conaffinity, m.geom_condim)),
            float(friction),
            int(m.geom_priority[geom]),
            geom if geom in self._special else -1,
        )

    def are_alike(self, first: int, second: int) -> bool:
        """True if two geoms have the same contact properties, in the model's list of pairs, too."""
        a, b = (self.surface(geom) for geom in (first, second))
        return replace(a, geom=b.geom) == b and self._partners(first) == self._partners(second)

    def _partners(self, geom: int) -> dict[int, tuple]:
        """Numbers of the geoms with which a pair of the list names this one, and the pair's properties."""
        m = self._model.data
        found = {pair: k for pair, k in self._pairs.items() if geom in pair}
        return {min(pair - {geom}): (int(m.pair_dim[k]), float(m.pair_friction[k, 0])) for pair, k in found.items()}

    def friction_of(self, a: Surface, b: Surface) -> float | None:
        """Friction coefficient of two surfaces; None if they do not touch."""
        if self._is_off:
            return None
        pair = self._pair(a, b)
        if pair is None:
            return None if self._are_excluded(a, b) else dynamic_friction(a, b)
        m = self._model.data
        if m.pair_dim[pair] == 1:
            return 0.0
        friction = m.opt.o_friction[0] if self._overrides else m.pair_friction[pair, 0]
        return max(LEAST_FRICTION, float(friction))

    def _pair(self, a: Surface, b: Surface) -> int | None:
        return self._pairs.get(frozenset((a.geom, b.geom))) if a.geom >= 0 and b.geom >= 0 else None

    def _are_excluded(self, a: Surface, b: Surface) -> bool:
        if a.geom < 0 or b.geom < 0:
            return False
        bodies = self._model.data.geom_bodyid
        return a.geom != b.geom and frozenset(map(int, (bodies[a.geom], bodies[b.geom]))) in self._excluded

    def faults(self, geoms: Iterable[int]) -> Iterator[ModelError]:
        """Iterate over errors for the contact properties of these geoms that a scene cannot hold, such as softness."""
        known = set(geoms)
        for geom in sorted(known):
            for told in self._geom_faults(geom):
                yield self._model.error("geom", geom, told)
        for pair, k in self._pairs.items():
            if pair <= known:
                for told in self._pair_faults(k):
                    yield self._model.error("pair", k, told)
        if self._overrides:
            opt = self._model.data.opt
            for told in _softness(opt.o_solref, opt.o_solimp, opt.o_margin, 0.0):
                yield ModelError(f"<option> overrides contacts and {told}")

    def _geom_faults(self, geom: int) -> Iterator[str]:
        m, value = self._model.data, self._model.value
        yield from _resistance(m.geom_condim[geom])
        if not self._overrides:
            yield from _softness(m.geom_solref[geom], m.geom_solimp[geom], m.geom_margin[geom], m.geom_gap[geom])
        for name, told in (("geom_adhesion", "adhesion"), ("geom_surfacevel", "surfacevel")):
            found = np.ravel(value(name, np.zeros(m.ngeom))[geom])
            if found.any():
                yield f"has {told} {_shown(found)}; allowed is none"

    def _pair_faults(self, k: int) -> Iterator[str]:
        m, value = self._model.data, self._model.value
        yield from _resistance(m.pair_dim[k])
        if m.pair_dim[k] > 1 and m.pair_friction[k, 0] != m.pair_friction[k, 1]:
            yield f"has friction {_shown(m.pair_friction[k, :2])} in two directions; allowed is one coefficient"
        if not self._overrides:
            yield from _softness(m.pair_solref[k], m.pair_solimp[k], m.pair_margin[k], m.pair_gap[k])
        if np.any(m.pair_solreffriction[k]):
            yield f"has solreffriction {_shown(m.pair_solreffriction[k])}; allowed is none"
        if np.any(value("pair_adhesion", np.zeros(m.npair))[k]):
            yield f"has adhesion {m.pair_adhesion[k]:g}; allowed is none"


def _shown(numbers: np.ndarray) -> str:
    return " ".join(f"{number:g}" for number in numbers)


def _resistance(condim: int) -> Iterator[str]:
    if condim > 3:
        yield f"has condim {condim}, friction that opposes spin; allowed are 1 and 3"


def _softness(solref: np.ndarray, solimp: np.ndarray, margin: float, gap: float) -> Iterator[str]:
    """Iterate over messages about a contact that is softer or less damped than MuJoCo's default, or acts at a distance.

    The arguments are MuJoCo's contact parameters of these names.
    """
    time, ratio = solref
    if not (time > 0 and ratio >= DAMPING_RATIO and time * ratio <= TIME_CONSTANT):
        allowed = f"a damping ratio of at least {DAMPING_RATIO:g}, and a product of at most {TIME_CONSTANT:g} s"
        yield f"has solref {_shown(solref)}, a soft contact; allowed is {allowed}"
    if np.any(solimp[:2] < IMPEDANCE):
        yield f"has solimp {_shown(solimp)}, a soft contact; allowed is at least {_shown(np.array(IMPEDANCE))}"
    for name, number in (("margin", margin), ("gap", gap)):
        if number:
            yield f"has {name} {number:g}; allowed is 0"
