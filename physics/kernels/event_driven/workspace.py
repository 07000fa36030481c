"""Scratch memory of one thread for the event-driven scheme, `motion`: thresholds, contacts, forces, smooth motion.

`Motion` is a named tuple of groups. Each group is a record; a function below gives its fields, since their sizes depend
on the numbers of walls and features. There are at most `contacts` acting contacts, `slots` features at all walls
together, and `unknowns` = 3 contacts. The scheme also uses the workspace `scratch` of
`physics.kernels.time_stepping.workspace`, mainly for the contact solver.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from physics.kernels.state.layout import VERTEX_COUNT

# Vertices of a block that can lie in one plane.
FACE_VERTICES = 4

# Columns of a smooth state: position, quaternion, velocity, angular momentum.
Y_POSITION, Y_QUATERNION, Y_VELOCITY, Y_ANGULAR_MOMENTUM, Y_SIZE = 0, 3, 7, 10, 13

# Rows of `y`: states at the start and at the end of the step, and two states of the midpoint rule.
ROW_START, ROW_END, ROW_PREVIOUS, ROW_CURRENT, ROW_COUNT = 0, 1, 2, 3, 4

# Largest number of midpoint rules that are extrapolated, with 2, 4, 6, ... parts: order 16.
MAX_MIDPOINT_RULES = 8


# Entries of a state that the implicit rule solves for: velocity and angular momentum.
IMPLICIT_SIZE = Y_SIZE - Y_VELOCITY


class Motion(NamedTuple):
    """Groups of the event-driven scheme's scratch memory: arrays of one record in Python, records in a kernel."""

    thresholds: np.ndarray  # gaps, speeds and times that count as zero
    pace: np.ndarray  # look-ahead to the next contact mode, leaps, and lengths of steps
    contacts: np.ndarray  # acting contacts: kinematics, forces and their margins
    unknowns: np.ndarray  # unknowns of the contact forces, and their equations
    candidates: np.ndarray  # candidate contacts of the search for a contact mode
    smooth: np.ndarray  # smooth step: states, rates, gaps, scales


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
        ("look_ahead", f),  # time after an event at which the next contact mode is searched [s]
        ("min_look_ahead", f),  # smallest look-ahead [s]
        ("assured_time", f),  # time for which contacts that a guard has opened are known to stay open [s]
        ("next_leap", f),  # length of the next leap, after chatter [s] (`chatter_control`)
        ("chatter_start", f),  # start of the period in which events are counted [s]
        ("chatter_count", i),  # events in this period
        ("sequential_impacts", i),  # sequential impacts so far at this moment
        ("skipped_bounce_time", f),  # time that the bounces left out would have taken [s]
        ("step_length", f),  # length suggested for the next smooth step [s]
        ("is_stiff", i),  # 1: smooth steps are made by the implicit rule (`implicit_extrapolation`)
        ("slowest_slip", f),  # speed of the slowest sliding contact at the start of such a step [m/s]
        ("ended_mode", i),  # hash of the contact mode that a force guard has ended
        ("distrusted_mode", i),  # hash of the contact mode whose force guards are ignored (`mode_acceptance`)
        ("watched_length", f),  # length of the next step without force guards [s]
        ("end_rate", f, (Y_SIZE,)),  # rate of change at the end of such a step
    ]  # fmt: skip


class Workspaces(NamedTuple):
    """Both workspaces of a thread, arrays of one record in Python, records in a kernel."""

    scratch: np.ndarray  # of `physics.kernels.time_stepping.workspace`
    motion: Motion


def _contact_fields(contacts: int, slots: int) -> list[tuple]:
    f, i, n = np.float64, np.int64, contacts
    return [
        ("count", i),  # contacts that act
        ("slot", i, (n,)),  # wall * features + feature
        ("sticks", i, (n,)),  # 1: no velocity at all; 0: slides
        ("slip_direction", f, (n, 3)),  # direction of sliding
        ("start_slip_direction", f, (n, 3)),  # the one at the start of the step
        ("is_starting", i, (n,)),  # 1: the contact was at rest at the start of the step, or nearly
        ("slip_turn_rate", f),  # rate at which the slip direction of a single contact turns at its onset [rad/s]
        ("friction_turn_stiffness", f),  # acceleration of a single contact across its slip, per radian [m/s²]
        ("start_slip_speed", f),  # slip speed of a single contact at the start of the step [m/s]
        ("slip_growth", f),  # growth of this speed [m/s²]
        ("arm", f, (n, 3)),  # contact point relative to the centre of mass [m]
        ("velocity", f, (n, 3)),  # velocity of the body at the contact point [m/s]
        ("constraint_error", f, (n, 3)),  # acceleration, velocity or gap that the unknowns are to cancel
        ("force", f, (n, 3)),  # contact force, world frame [N]
        ("normal", f, (n,)),  # normal component of the force [N]
        ("margin", f, (3, 2, n)),  # push and cone margins at both ends of a step and inside (`force_minima`) [weights]
        ("margin_rate", f, (2, n)),  # rates of change of these margins at the start
        ("first_unknown", i, (n,)),  # first unknown of the contact alone
        ("patch", i, (n,)),  # first of its wall's three normal unknowns, or NO_PATCH (`contact_forces`)
        ("patch_coordinate", f, (n, 2)),  # coordinates in the patch, in radii
        ("given_force", f, (n, 3)),  # given part of the force, along the wall's axes [N]
        ("last_force", f, (slots, 3)),  # last known force of every feature, along the wall's axes [N]
        ("rebound", f, (3 * slots,)),  # impulses of a full rebound, where it would gain energy [N s]
    ]  # fmt: skip


def _unknown_fields(unknowns: int) -> list[tuple]:
    f, i, m = np.float64, np.int64, unknowns
    return [
        ("given_wrench", f, (2, 3)),  # total force and moment of the given forces, which the unknowns add to
        ("column_force", f, (m, 3)),  # force per unknown
        ("column_moment", f, (m, 3)),  # moment per unknown about the centre of mass
        ("row", f, (m, 3)),  # direction of the constraint
        ("row_moment", f, (m, 3)),  # moment of this direction about the centre of mass
        ("is_skew", i),  # 1: some contact has a force in another direction than its row
        ("independent_row", i, (m,)),  # indices of linearly independent rows
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
        ("state", i, (n,)),  # CANDIDATE_OPEN, CANDIDATE_STICKING or CANDIDATE_SLIDING
        ("direction", f, (n, 3)),  # direction of sliding
        ("is_fresh", i, (n,)),  # 1: has no slip yet; if it slides, it begins to slide
        ("changes", i, (n,)),  # changes of its state in this search
    ]  # fmt: skip


def _smooth_fields(walls: int, slots: int) -> list[tuple]:
    f, i = np.float64, np.int64
    return [
        ("is_resting", i),  # 1: the body rests
        ("wall_state", i, (walls,)),  # contact at each wall after the last event (`mode_transitions`)
        ("gap", f, (2, slots)),  # gap of every feature, at the start and at the end of the step [m]
        ("gap_rate", f, (2, slots)),  # rates of these gaps [m/s]
        ("is_active", i, (slots,)),  # 1: the feature acts
        ("weight", f),  # scale of the forces [N]
        ("start_angular_speed", f),  # angular speed at the start of the step [rad/s]
        ("y", f, (ROW_COUNT, Y_SIZE)),  # states
        ("rate", f, (Y_SIZE,)),  # rate of change of the last evaluated state
        ("first_rate", f, (Y_SIZE,)),  # rate of change at the start of the step
        ("last_rate", f, (Y_SIZE,)),  # rate of change at the end of the step
        ("scale", f, (Y_SIZE,)),  # units of the errors of the state
        ("extrapolation_table", f, (MAX_MIDPOINT_RULES, Y_SIZE)),  # a row of Neville's table
        ("jacobian", f, (IMPLICIT_SIZE, IMPLICIT_SIZE)),  # change of the rates of (v, L) with (v, L)
        ("implicit_matrix", f, (IMPLICIT_SIZE, IMPLICIT_SIZE + 1)),  # linear system of a part of the implicit rule
        ("implicit_order", i, (IMPLICIT_SIZE,)),
        ("implicit_change", f, (IMPLICIT_SIZE,)),  # its solution
    ]  # fmt: skip


def make_motion(wall_count: int, features: int, is_sequential: bool) -> Motion:
    """Make the scratch memory `Motion` for bodies with `features` contact features each (8 or 1) at `wall_count` walls.

    With `is_sequential` contacts of one moment collide one after the other, otherwise simultaneously.
    """
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
