"""Scratch memory of one thread for the event-driven scheme: acting contacts, their forces, rows of smooth motion.

`Motion` is a named tuple of groups, one for each part of a step. Each is a record whose fields are named in a function
below, since their sizes depend on the walls and on the features of a body: `contacts` at most act at once, `slots` are
all features at all walls, and there are `unknowns` = 3 contacts.

Besides the workspace of `physics.kernels.time_stepping.workspace`, which the impact solver shares with the
time-stepping scheme.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from physics.kernels.state.layout import VERTEX_COUNT

# Vertices of a block that can lie in one plane.
FACE_VERTICES = 4

# Columns of a smooth state: position, quaternion, velocity, angular momentum.
Y_POSITION, Y_QUATERNION, Y_VELOCITY, Y_ANGULAR_MOMENTUM, Y_SIZE = 0, 3, 7, 10, 13

# Rows of `y`: where the step starts, where it ends, two of the midpoint rule.
ROW_START, ROW_END, ROW_PREVIOUS, ROW_CURRENT, ROW_COUNT = 0, 1, 2, 3, 4

# At most so many midpoint rules are extrapolated, with 2, 4, 6, ... parts: order 16.
MAX_MIDPOINT_RULES = 8


class Motion(NamedTuple):
    """Groups of the scratch memory: arrays of one record in Python, records in a kernel."""

    thresholds: np.ndarray  # what counts as zero and as one
    pace: np.ndarray  # when the next contact mode is looked for, and how far a step is trusted
    contacts: np.ndarray  # contacts that act: kinematics, forces and their margins
    unknowns: np.ndarray  # unknowns of the contact forces, and their equations
    candidates: np.ndarray  # contacts that a contact mode may have
    smooth: np.ndarray  # smooth step: gaps, stages, scales


def _threshold_fields() -> list[tuple]:
    f, i = np.float64, np.int64
    return [
        ("touch_gap", f),  # gap within which a feature touches [m]
        ("rest_speed", f),  # speed of a contact that counts as none [m/s]
        ("slip_stop_speed", f),  # speed along the wall that counts as none [m/s]
        ("rounding_speed", f),  # speed that is rounding [m/s]
        ("simultaneity_time", f),  # impacts within this time are one [s]
        ("is_sequential", i),  # 1: contacts collide in turn, 0: at once
    ]  # fmt: skip


def _pace_fields() -> list[tuple]:
    f, i = np.float64, np.int64
    return [
        ("look_ahead", f),  # time by which the next contact mode is looked for [s]
        ("min_look_ahead", f),  # the least of these [s]
        ("assured_time", f),  # time for which contacts that a guard has let go are known to stay open [s]
        ("next_leap", f),  # length of the next leap over events that crowd [s] (`chatter_control`)
        ("chatter_start", f),  # since when events crowd [s]
        ("chatter_count", i),  # events since then
        ("sequential_impacts", i),  # impacts in turn so far at this moment
        ("skipped_bounce_time", f),  # time that a sequence of bounces would have taken on [s]
        ("step_length", f),  # length of the last smooth step [s]
        ("ended_mode", i),  # the contact mode that a guard of force has ended
        ("distrusted_mode", i),  # the contact mode whose guards of force say nothing; see `mode_acceptance`
        ("watched_length", f),  # length of a step without such guards [s]
        ("end_rate", f, (Y_SIZE,)),  # rate of change at the end of such a step
    ]  # fmt: skip


def _contact_fields(contacts: int, slots: int) -> list[tuple]:
    f, i, n = np.float64, np.int64, contacts
    return [
        ("count", i),  # contacts that act
        ("slot", i, (n,)),  # wall * features + feature
        ("sticks", i, (n,)),  # 1: no velocity at all; 0: slides
        ("slip_direction", f, (n, 3)),  # direction of sliding
        ("start_slip_direction", f, (n, 3)),  # the one at the start of the step
        ("is_starting", i, (n,)),  # 1: the contact was at rest at the start of the step, or nearly
        ("slip_turn_rate", f),  # rate at which the direction turns in which the only contact begins to slide [rad/s]
        ("friction_turn_stiffness", f),  # change by friction of its acceleration across, for each radian [m/s²]
        ("start_slip_speed", f),  # slip speed of the only contact at the start of the step [m/s]
        ("slip_growth", f),  # rate at which that speed grows [m/s²]
        ("arm", f, (n, 3)),  # contact point relative to the centre of mass [m]
        ("velocity", f, (n, 3)),  # of the body there [m/s]
        ("constraint_error", f, (n, 3)),  # what the unknowns are to cancel: acceleration, velocity or gap
        ("force", f, (n, 3)),  # [N]
        ("normal", f, (n,)),  # of it, along the normal [N]
        ("margin", f, (3, 2, n)),  # of push and cone at the ends of a step and inside; see `force_minima` [weights]
        ("margin_rate", f, (2, n)),  # their rates of change at its start
        ("first_unknown", i, (n,)),  # first unknown of the contact alone
        ("patch", i, (n,)),  # first of its wall's three normal forces; NO_PATCH (`contact_forces`): one of its own
        ("patch_coordinate", f, (n, 2)),  # coordinates in the patch, in radii
        ("given_force", f, (n, 3)),  # part of its force that is given, along the wall's axes [N]
        ("last_force", f, (slots, 3)),  # force of every feature when it was last known, along the wall's axes [N]
        ("rebound", f, (3 * slots,)),  # impulses of a rebound that there is not enough energy for [N s]
    ]  # fmt: skip


def _unknown_fields(unknowns: int) -> list[tuple]:
    f, i, m = np.float64, np.int64, unknowns
    return [
        ("given_wrench", f, (2, 3)),  # force and moment of the shares, which the unknowns add to
        ("column_force", f, (m, 3)),  # force per unknown
        ("column_moment", f, (m, 3)),  # moment per unknown about the centre of mass
        ("row", f, (m, 3)),  # direction of the constraint
        ("row_moment", f, (m, 3)),  # its moment
        ("is_skew", i),  # 1: some contact pushes along another line than its row
        ("independent_row", i, (m,)),  # rows that are equations
        ("matrix", f, (m, m + 1)),
        ("order", i, (m,)),
        ("rhs", f, (m,)),  # right-hand sides
        ("value", f, (m,)),
    ]  # fmt: skip


def _candidate_fields(contacts: int) -> list[tuple]:
    f, i, n = np.float64, np.int64, contacts
    return [
        ("count", i),  # contacts that touch and do not leave
        ("slot", i, (n,)),  # wall * features + feature
        ("state", i, (n,)),  # open, held, sliding
        ("direction", f, (n, 3)),  # direction of sliding
        ("is_fresh", i, (n,)),  # slides from rest
        ("changes", i, (n,)),  # changes of its state in this search
    ]  # fmt: skip


def _smooth_fields(walls: int, slots: int) -> list[tuple]:
    f, i = np.float64, np.int64
    return [
        ("is_resting", i),
        ("wall_state", i, (walls,)),  # what the body did at each wall after the last event
        ("gap", f, (2, slots)),  # of every feature, at the start and at the end of the step [m]
        ("gap_rate", f, (2, slots)),  # [m/s]
        ("is_active", i, (slots,)),
        ("weight", f),  # scale of the forces [N]
        ("start_angular_speed", f),  # angular speed at the start of the step [rad/s]
        ("y", f, (ROW_COUNT, Y_SIZE)),
        ("rate", f, (Y_SIZE,)),
        ("first_rate", f, (Y_SIZE,)),
        ("last_rate", f, (Y_SIZE,)),
        ("scale", f, (Y_SIZE,)),
        ("extrapolation_table", f, (MAX_MIDPOINT_RULES, Y_SIZE)),
    ]  # fmt: skip


def make_motion(wall_count: int, features: int, is_sequential: bool) -> Motion:
    """Make the scratch for bodies with `features` contact features each against `wall_count` walls."""
    walls = max(wall_count, 1)
    contacts, slots = walls * (FACE_VERTICES if features == VERTEX_COUNT else 1), walls * features
    groups = (
        _threshold_fields(),
        _pace_fields(),
        _contact_fields(contacts, slots),
        _unknown_fields(3 * contacts),
        _candidate_fields(contacts),
        _smooth_fields(walls, slots),
    )
    motion = Motion(*(np.zeros(1, np.dtype(fields)) for fields in groups))
    motion.thresholds["is_sequential"] = is_sequential
    return motion
