"""Contact mode of a moment, from the acceleration-level complementarity problem.

    a_n >= 0,  f_n >= 0,  a_n f_n = 0;    a contact that has no tangential velocity holds (a_t = 0, |f_t| <= μ f_n)
    or starts to slide (f_t = -μ f_n a_t/|a_t|); one that has slides on (f_t = -μ f_n u_t/|u_t|)

When no contact slides, these are the conditions of an impact with accelerations in place of velocities, and the same
solver gives them: exact cones, with pivoting as the fallback. When some slide, contacts change between open, sticking
and sliding until all conditions hold; each trial is one linear system (`contact_forces`). If the search goes round in
circles, the solver is called again, with a large tangential acceleration in place of each contact's sliding. If it can
only stop the sliding (Painlevé's paradox: a sliding contact may have no force), the velocities have to jump, and `step`
applies an impulse.
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
    """Find contact mode and acting contacts at y: (contact mode, number of candidates, acceleration, moment).

    `MODE_UNDECIDED`: none of the candidates slides, and the contact problem with this acceleration and moment, which is
    posed in `scratch`, decides (`read_resting_mode`). `MODE_UNDECIDED_SLIDING`: some do, no mixture was found, and that
    problem decides for them, too.
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
