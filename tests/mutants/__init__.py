"""Small faults of the source, each with the tests that must notice it: `python -m tests.mutants`.

A test that passes with a fault in the code that it covers checks nothing. Each mutant of the list (`catalogue`) is one
such fault. The runner puts it into a copy of the sources and runs a few tests there, which must fail.
"""
