"""Coefficients of friction and restitution of two bodies: by default, or by the scene's rules and exceptions."""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.contact_law.materials import combine


@inlined
def _find_pair(key, keys):
    """Index of `key` among the sorted `keys`; -1 if it is not among them."""
    low, high = 0, keys.shape[0]
    while low < high:
        middle = (low + high) // 2
        if keys[middle] < key:
            low = middle + 1
        else:
            high = middle
    return low if low < keys.shape[0] and keys[low] == key else -1


@kernel
def _coefficient(key, keys, numbers, rule, one, other):
    """Find the coefficient of the pair `key`; without one combine those of its bodies, `one` and `other`, by a rule."""
    place = _find_pair(key, keys)
    return numbers[place] if place >= 0 else combine(rule, one, other)


def _default_coefficients(a, b, many):
    one, other = many.bodies.body[a], many.bodies.body[b]
    return math.sqrt(one.mu * other.mu), max(one.restitution, other.restitution)


@if_given("many.materials", _default_coefficients)
def pair_coefficients(a, b, many):
    """Coefficients of friction and restitution of bodies a and b, by the rules and exceptions in `many.materials`.

    Where the scene has none, these are the geometric mean of both frictions, and the larger restitution.
    """
    one, other, materials = many.bodies.body[a], many.bodies.body[b], many.materials
    key = min(a, b) * many.bodies.state.shape[0] + max(a, b)
    pairs, numbers = materials.friction_pairs, materials.friction
    mu = _coefficient(key, pairs, numbers, materials.rules[0], one.mu, other.mu)
    pairs, numbers = materials.restitution_pairs, materials.restitution
    return mu, _coefficient(key, pairs, numbers, materials.rules[1], one.restitution, other.restitution)
