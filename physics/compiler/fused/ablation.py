"""Switches of the optimisations of the fused compiler; each can be turned off to measure its benefit.

The environment variable ``RIGID_ENV_WITHOUT=ranges,scalars`` turns off these two; it is read once, on import. Numba's
own method replaces an optimisation that is off, and results differ at most in rounding. Machine code made without some
optimisations is kept in a folder of its own (`cache_folder.folder_name`). All are measured in turns by
``python -m benchmarks.ablation``.
"""

from __future__ import annotations

import hashlib
import os

VARIABLE = "RIGID_ENV_WITHOUT"

# Descriptions by name. A name of a module of this folder stands for everything in that module.
OPTIMISATIONS = {
    "argument_passing": "large tuples are handed on by address, not word by word",
    "array_elements": "elements of arrays are read and written directly, not by way of a copy of the array's words",
    "calling_convention": "a kernel returns its value, not a status with the value in memory",
    "cold_kernels": "a call is left of what a step hardly ever needs",
    "folding_builder": "members of structures and constants are folded while instructions are written",
    "fused_products": "a product in a sum is rounded with it; the last bits of results depend on it",
    "indices_from_front": "no index is asked whether it is negative",
    "inlined_kernels": "no call is left of what is a few instructions long",
    "lowering": "a variable that is assigned once is a value without memory; none is read or cleared to release it",
    "memoised_contexts": "types and lowerings of operations and sizes of types are determined once",
    "one_process": "of several processes that want a kernel one compiles it, and the others wait for its file",
    "passes": "a kernel goes through the passes that it needs, not through all of Numba's",
    "paused_gc": "the garbage collector waits while kernels are compiled",
    "ranges": "loops count without asking whether the step is zero",
    "scalars": "max, min, int and powers of numbers are written in place, not compiled as functions",
    "shared_kernels": "large kernels that know no plan are made machine code once for all plans",
    "simd_types": "an operation on lanes is one of vectors, not one for each lane",
    "type_inference": "a constraint is looked at again only if a type in it has changed",
    "untimed_parts": "no clocks run while a part is compiled",
}

# Modules without a switch, with their tasks or the reasons.
BASES = {
    "atomics": "instructions by which threads share worlds",
    "backend": "the interface of the decorators",
    "cache_files": "files of machine code: no optimisation, and all that is kept on disk rests on it",
    "code_libraries": "without it each caller optimises its parts once more: a first compile takes 2.8 times as long",
    "disk_cache": "what is kept on disk and loaded: shared kernels rest on it; `benchmarks.start` shows its worth",
    "dispatcher": "has kernels compiled: all others hook in there",
    "operation_table": "asks `array_elements`, `ranges`, `scalars` and `simd_types`, which have switches",
    "prepared_calls": "makes the calls that `prepared_entry` is the other end of",
    "prepared_entry": "threads take their calls from a table of prepared ones, and chained calls stand in it",
    "tuples": "without it `t[k]` may raise: 55 kernels of a plan would return a status, and be lowered twice",
    "user_functions": "looks through users' functions before anything moves",
}


def read_names(text: str) -> frozenset[str]:
    """Names of the optimisations in a text such as ``ranges,scalars``, the value of `VARIABLE`.

    Raises
    ------
    ValueError
        A name is not among `OPTIMISATIONS`.
    """
    names = frozenset(filter(None, (each.strip() for each in text.split(","))))
    if names <= OPTIMISATIONS.keys():
        return names
    unknown = ", ".join(sorted(names - OPTIMISATIONS.keys()))
    raise ValueError(f"{VARIABLE}={text!r} names {unknown}; allowed are {', '.join(OPTIMISATIONS)}")


WITHOUT = read_names(os.environ.get(VARIABLE, ""))


def is_on(name: str) -> bool:
    """True unless the optimisation of this name, a key of `OPTIMISATIONS`, is turned off."""
    if name not in OPTIMISATIONS:
        raise KeyError(name)
    return name not in WITHOUT


def folder_suffix() -> str:
    """Suffix of the folder of machine code, a digest of the optimisations that are off; "" if all are on."""
    names = ",".join(sorted(WITHOUT))
    return f"-without-{hashlib.sha256(names.encode()).hexdigest()[:8]}" if names else ""
