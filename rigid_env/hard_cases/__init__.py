"""The hard cases: situations in which rigid-body simulators break, each with a known outcome (docs/hard-cases.md).

`case` says what a case is, `registry` finds them, `cases` holds them by subject. `rigid_env.lab.hard_cases` runs them.
"""
