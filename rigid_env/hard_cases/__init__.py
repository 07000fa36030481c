"""Hard cases: situations in which rigid-body simulators break, each with a known outcome (docs/hard-cases.md).

`case` defines the classes, `cases` has the cases by subject, and `registry` finds them. `rigid_env.lab.hard_cases` runs
them.
"""
