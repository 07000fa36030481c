"""The slow independent truth: one rigid block or sphere among half-spaces, event by event.

Laws. Contacts are the pairs of a wall and a vertex (of a sphere: its point at -R n); gap = n·(x + r) - offset,
u = v + ω x r, a = v̇ + ω̇ x r + ω x ṙ (of a sphere ṙ = 0).

1. Flight (`contact_mode`): ẋ = v, q̇ = ½ ω q, v̇ = g + F/m, I ω̇ = τ - ω x I ω, by DOP853. The gaps are integrated along,
   so that a hop of 1e-17 m is still a parabola.
2. Impact (`motion.collide`, `contact.solve`): Newton's law of restitution and Coulomb's cone at once at all touching
   contacts, u⁺ = u⁻ + W p; a contact that does not approach has the target u_n⁺ >= 0.
3. Rest (`contact.solve`, `contact_mode.choose`): the same problem for accelerations and forces, a = A f + b, with the
   friction of contacts that slide opposed to their velocity; four contacts of one wall share the normal force as
   max(0, ℓ(place)), ℓ affine.
4. Bounces in ever shorter time (`motion`): a flight that would be shorter than a threshold is not made; its time,
   flight / (1 - e), is added to `Result.left_out`.

Sources: Baraff and Witkin, *Physically Based Modeling*, SIGGRAPH course notes, 1997, "Rigid Body Simulation II",
for contact as complementarity of forces and accelerations; Glocker, *Set-Valued Force Laws*, 2001, for Newton's and
Coulomb's laws of impact in the one-shot form; Hairer, Nørsett and Wanner, *Solving Ordinary Differential Equations
I*, 2nd ed., 1993, section II.6, for events on the dense output.

    body           state, kinematics, mass         contact   the contact problem of one instant
    contact_mode   smooth motion between events    motion    the events
    slip           how sliding begins              hits      when the next gap closes
"""

from tests.reference.hybrid.body import Problem, from_scene
from tests.reference.hybrid.motion import Event, Options, Result, simulate

__all__ = ["Event", "Options", "Problem", "Result", "from_scene", "simulate"]
