"""Find the contact mode of a body at one moment, from the acceleration-level complementarity problem.

Let a contact have the acceleration a, the force f and the velocity u, each with normal (n) and tangential (t) parts:

    a_n >= 0,  f_n >= 0,  a_n f_n = 0;
    u_t = 0:   a_t = 0 and |f_t| <= μ f_n (it sticks),  or  f_t = -μ f_n a_t/|a_t| (it begins to slide);
    u_t ≠ 0:   f_t = -μ f_n u_t/|u_t| (it slides).

If no contact slides, these are the conditions of an impact with accelerations in place of velocities. The solver of
impacts solves them with exact cones, and with pivoting as the fallback. If some contacts slide, contacts change between
open, sticking and sliding until all conditions hold; each trial is one linear system (`contact_forces`). If this search
does not end, the solver of impacts is used, with a large tangential acceleration in place of each contact's sliding. If
its solution stops the sliding, no force is consistent (Painlevé's paradox). Then the velocities jump, by an impulse in
`step`.
"""

from __future__ import annotations

from physics.compiler.decorators import kernel
from physics.kernels.event_driven.acceleration_problem import set_up_resting_problem
from physics.kernels.event_driven.contact_candidates import (
    MODE_CONTACT,
    MODE_FLIGHT,
    MODE_IMPACT,
    MODE_UNDECIDED,
    MODE_UNDECIDED_SLIDING,
    find_candidates,
    has_closing_contact,
    is_candidate_sliding,
)
from physics.kernels.event_driven.contact_forces import free_angular_motion
from physics.kernels.event_driven.contact_mode_search import search_contact_modes


@kernel
def find_contact_mode(y, friction, offset_frame, scratch, motion):
    """Find the contact mode and the acting contacts in the state y: (MODE_ code, count, acceleration, moment).

    `count` is the number of candidates. With `MODE_UNDECIDED` no candidate slides, and a contact problem must decide:
    it is written to `scratch`, and acceleration and moment are those without contact (`read_resting_mode`). With
    `MODE_UNDECIDED_SLIDING` some candidates slide, the search found no mode, and the problem must decide as well.
    """
    zero = (0.0, 0.0, 0.0)
    motion.contacts.count = 0
    count, approaches = find_candidates(y, offset_frame, scratch, motion)
    for s in range(motion.smooth.is_active.shape[0]):
        motion.smooth.is_active[s] = 0
    if approaches:
        return MODE_IMPACT, 0, zero, zero
    if count == 0:
        return MODE_FLIGHT, 0, zero, zero
    R, P, w, alpha = free_angular_motion(y, offset_frame, scratch.body)
    slides = False
    if friction is not None:
        for i in range(count):
            slides = is_candidate_sliding(i, y, R, w, offset_frame, scratch, motion) or slides
    if not slides or not search_contact_modes(count, y, R, P, w, alpha, offset_frame, scratch, motion):
        if slides:
            for i in range(count):
                is_candidate_sliding(i, y, R, w, offset_frame, scratch, motion)
        a, moment = set_up_resting_problem(count, y, R, w, slides, offset_frame, scratch, motion.candidates)
        return (MODE_UNDECIDED_SLIDING if slides else MODE_UNDECIDED), count, a, moment
    if has_closing_contact(count, motion):
        return MODE_IMPACT, 0, zero, zero
    return (MODE_CONTACT if motion.contacts.count > 0 else MODE_FLIGHT), count, zero, zero
