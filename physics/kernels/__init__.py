"""Kernels: compiled pure functions on plain numbers and arrays, which carry out the steps.

They do not use scenes, worlds or environments. Conventions: see ``docs/conventions.md`` (SI units; quaternions are
(w, x, y, z), body to world). These arguments have the same meaning in all kernels for bodies at walls:

y : state (x, q, v, L) of a body: position, quaternion, velocity, angular momentum, world frame
body : record of a body, with its parameters and loads (`time_stepping.workspace.body_fields`)
scratch : workspace of a thread: body, walls, contacts, settings (`time_stepping.workspace`)
motion : scratch memory of the event-driven scheme (`event_driven.workspace.Motion`)
n : number of contacts in the contact set, or a wall's normal
R : rotation matrix, nine scalars row by row
J : inverse principal moments of inertia [1/(kg m²)]
h : length of a step, substep or stage [s]
contact, flight, gyroscopic, offset_frame : switches, None where off (`state.groups`)
memory, records : contact memory, and all arrays that a step writes besides the state (`state.groups.Records`)
"""
