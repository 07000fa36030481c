"""The hard cases: situations in which rigid-body simulators break, each with a known outcome (docs/hard-cases.md)."""
