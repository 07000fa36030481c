"""Kernels compiled together: every part is lowered once, and only what Python calls is optimised.

Each count is taken in a process of its own with a cache of its own, so that it is the count of a first use.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core.codegen import JITCodeLibrary

from physics.compiler.decorators import cold_kernel, inlined, kernel, runtime_kernel, shared_kernel
from tests.kernels.anew import anew


@kernel
def square(x):
    return x * x


@kernel
def never_squares(x):
    for _ in range(0):
        x = square(x)
    return x


@kernel
def squares(x):
    return square(x)


@kernel
def both(x):
    return never_squares(x) + squares(x)


def test_a_callee_that_its_first_caller_lost_is_linked_for_the_next():
    """The optimiser takes the call out of `never_squares`: linked right after it alone, `square` would be dropped."""
    assert both(3.0) == 12.0


def test_a_kernel_that_only_kernels_call_is_never_made_machine_code():
    both(3)
    assert both.signatures
    assert not squares.signatures
    assert squares(4) == 16  # until Python calls it
    assert len(squares.signatures) == 1


@kernel
def calls_three_deep(x):
    return both(x) + 1


def test_nobody_outside_can_call_a_part(monkeypatch):
    """So that what it does not read of its arguments is not handed to it: a hundred arrays, in a world of bodies."""
    linkage, optimise = {}, JITCodeLibrary._optimize_final_module

    def noted(library):
        functions = [f for f in library._final_module.functions if not f.is_declaration]
        linkage.update((f.name, f.linkage.name) for f in functions)
        optimise(library)

    monkeypatch.setattr(JITCodeLibrary, "_optimize_final_module", noted)
    assert anew(calls_three_deep)(complex(3.0)) == 13.0  # of a type that nothing else asks for
    for part in ("both", "squares", "never_squares", "square"):
        assert {kind for name, kind in linkage.items() if f"test_linking{len(part)}{part}B" in name} == {"internal"}
    assert "external" in {kind for name, kind in linkage.items() if "calls_three_deep" in name}


@kernel
def halved(x):
    return 0.5 * x


@inlined
def quartered(x):
    return halved(halved(x))


@kernel
def calls_what_is_inlined(x):
    return quartered(x)


def test_what_an_inlined_function_calls_is_not_inlined_for_that():
    """Left to itself Numba hands the option on to callees: copies of a whole contact solver, and minutes to compile."""
    assert anew(calls_what_is_inlined)(8.0) == 2.0
    inlined_parts = {
        function.__name__: [part.fndesc.inline for part in function._part.overloads.values()]
        for function in (halved, quartered)
    }
    assert inlined_parts == {"halved": [False], "quartered": [True]}


@cold_kernel
def tripled(x):
    return 3.0 * x


@kernel
def doubled(x):
    return 2.0 * x


@kernel
def calls_each_once(x):
    return tripled(x) + doubled(x)


def test_of_a_cold_kernel_a_call_is_left(monkeypatch):
    """Names the calls that LLVM leaves: of a kernel called from one place none, but of a cold one, however short."""
    left, optimise = [], JITCodeLibrary._optimize_final_module

    def noted(library):
        optimise(library)
        left.extend(f.name for f in library._final_module.functions if not f.is_declaration)

    monkeypatch.setattr(JITCodeLibrary, "_optimize_final_module", noted)
    assert anew(calls_each_once)(complex(2.0)) == 10.0
    assert [part for part in ("tripled", "doubled") if any(f"{len(part)}{part}B" in name for name in left)] == [
        "tripled"
    ]


@runtime_kernel
def with_a_closure(x):
    twice = lambda y: 2.0 * y  # noqa: E731 (a closure is what this is about)
    return twice(x)


@kernel
def calls_a_closure(x):
    return with_a_closure(x)


def test_what_users_write_may_be_more_than_a_kernel():
    """Passes of kernels leave closures out; functions that others hand over go through all of Numba's."""
    assert calls_a_closure(3.0) == 6.0


PROGRAM = """
import collections, json, sys
from numba.core import event
from numba.core.codegen import JITCodeLibrary
import numpy as np
import physics
from physics import scenes
from physics.compiler.fused.calling_convention import MayRaise

optimised, lowered, statuses = collections.Counter(), collections.Counter(), []
MayRaise.__init__ = lambda self, name: statuses.append(name)
optimise = JITCodeLibrary._optimize_final_module

def counted(self):
    if self.name != "nrt":  # Numba's own run time
        optimised[self.name] += 1
    optimise(self)

JITCodeLibrary._optimize_final_module = counted
ends = []
with event.install_recorder("numba:compile") as recorder:
    for accuracy in sys.argv[1].split(","):
        for wrench in (None, np.zeros((1, 1, 6))):
            world = physics.World(scenes.drop(), dt=0.01, accuracy=accuracy)
            world.step(wrench, steps=3)
            ends.append(world.state.tolist())
if len(sys.argv) > 2:
    physics.World(scenes.tower(3), accuracy="fast").step()
for _, what in recorder.buffer:
    if what.is_start:
        lowered[f"{what.data['dispatcher']} {what.data['args']}"] += 1
print(json.dumps({"optimised": optimised, "lowered": lowered, "statuses": statuses, "ends": ends}))
"""


def first_use(accuracies: str, cache: Path, *and_bodies: str) -> dict:
    """List the kernels compiled for the three-wall box in a new process that keeps its kernels in `cache`."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, accuracies, *and_bodies], env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
        capture_output=True, text=True, check=True, timeout=900,
    )  # fmt: skip
    return json.loads(done.stdout)


@pytest.mark.exhaustive
def test_a_contact_plan_is_optimised_once_and_compiled_once_for_all_processes(tmp_path):
    """Two plans, each with and without a wrench, and a tower in one process; then again in another."""
    first = first_use("fast,balanced", tmp_path, "tower")
    assert first["optimised"].pop("step_worlds") == 2  # one machine code for each plan, not for each kind of wrench
    # Of a step those that stand are optimised for themselves (the last resort of `balanced` is in one), and no others:
    # what is left are those that Python calls, before the first step.
    names = (
        "_solve_iteratively",
        "_solve_directly",
        "find_contacts",
        "solve_contacts",
        "correct_positions",
        "solve_all_frictionless",
    )
    assert [first["optimised"].pop(name) for name in names] == [2, 1, 1, 1, 1, 1]
    assert not {"substep", "solve_all_sticking", "cone_sweeps", "interior_point_contacts", "collide_body_wall"} & set(
        first["optimised"]
    )
    # And none is typed twice: `balanced` adds its last resort to what `fast` had.
    names = [key for key in first["lowered"] if "solve_contacts" in key or "solve_all_sticking" in key]
    assert len(names) == 3  # two of the solver, whose arguments tell the plans apart, one of the direct solve
    # (What stands for absent fields and laws is a line, chosen anew by Numba for each kind of caller's flags.)
    lines = ("if_declared", "if_law", "_as_solved", "_as_assembled", "_no_tangential_target", "law_parameter")
    again = {key: count for key, count in first["lowered"].items() if count > 1}
    assert not {key for key in again if not any(line in key for line in lines)}, again

    # No kernel may raise an exception: it would be lowered twice, and so would all that call it.
    assert first["statuses"] == []

    second = first_use("fast,balanced", tmp_path, "tower")
    assert second["optimised"] == {}
    assert second["lowered"] == {}
    assert second["ends"] == first["ends"]


STANDING = """
import collections, sys
from numba.core.codegen import JITCodeLibrary
from physics.compiler.decorators import kernel, shared_kernel

optimised, optimise = collections.Counter(), JITCodeLibrary._optimize_final_module

def counted(self):
    optimised[self.name] += 1
    optimise(self)

JITCodeLibrary._optimize_final_module = counted

@kernel
def squared(x):
    return x * x

@shared_kernel
def cubed(x):
    return squared(x) * x

@shared_kernel
def to_the_ninth(x):
    return cubed(cubed(x))

@kernel
def one(x):
    return to_the_ninth(x) + squared(x)

@kernel
def other(x):
    return 2.0 * to_the_ninth(x)

expected = {"squared": 4.0, "one": 516.0, "other": 1024.0}
for name in sys.argv[1].split(","):
    assert globals()[name](2.0) == expected[name], name
print(*sorted(f"{name} {count}" for name, count in optimised.items() if name != "nrt"), sep=", ")
"""


def test_what_stands_is_made_once_and_kept_for_all_that_call_it(tmp_path):
    """Also by one that stands; in whatever order processes meet them, and whatever each has compiled before."""
    program = tmp_path / "standing.py"
    program.write_text(STANDING)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(Path(__file__).parents[2])}

    def optimised(names: str) -> str:
        command = [sys.executable, program, names]
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.strip()

    assert optimised("squared,one") == "cubed 1, one 1, squared 1, to_the_ninth 1"
    assert optimised("other") == "other 1"  # the cube comes from disk
    assert optimised("one,other") == ""
    for kept in tmp_path.rglob("*to_the_ninth*"):
        kept.unlink()
    assert optimised("other,one") == "to_the_ninth 1"  # made anew for wholes that were kept


@shared_kernel
def stands(x):
    return x - 1.0


@kernel
def calls_what_stands(x):
    return stands(x)


def test_nothing_of_what_stands_is_in_what_calls_it():
    whole = anew(calls_what_stands)
    assert whole(2.0) == 1.0
    (whole,) = whole.overloads.values()
    assert [origin.name for origin in whole.library.called] == ["stands"]
    defined = [function.name for function in whole.library.get_defined_functions()]
    assert not [name for name in defined if "6stands" in name]
    assert not stands.signatures  # it is no whole, since Python has not called it


RECORDS = """
import sys
import numpy as np
from physics.compiler.decorators import kernel

@kernel
def total(row):
    s = 0.0
    for k in range(row.numbers.shape[0]):
        s += row.numbers[k]
    return s

@kernel
def totals(rows):
    return total(rows[0])

count = int(sys.argv[1])
rows = np.zeros(1, [("numbers", float, (count,))])
rows["numbers"] = 1.0
assert totals(rows) == count
(part,) = total._part.overloads.values()
print(part.fndesc.mangled_name)
"""


def test_a_symbol_names_the_content_of_a_record_type(tmp_path):
    """Numba numbers record types process by process and names symbols by that number: parts made by two processes had
    the same name, and in a third one, which loaded both from disk, a block on an edge stayed where it was."""
    program = tmp_path / "records.py"
    program.write_text(RECORDS)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(Path(__file__).parents[2])}
    names = set()
    for count in ("2", "3"):
        command = [sys.executable, program, count]
        names.add(subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout)
    assert len(names) == 2


NAMESAKES = f"""
import math, sys
from physics.compiler.decorators import kernel

def make(shift):
    @kernel
    def part(x):
{"".join(f"        x = math.sin(x) + math.cos(x) * math.tan(x) + math.exp(-{k} * x * x){chr(10)}" for k in range(40))}
        return shift + 0.0 * math.tanh(x)
    return part

one, two = make(1.0), make(2.0)

@kernel
def twice_one(x):
    return one(x) + one(2.0 * x)

@kernel
def twice_two(x):
    return two(x) + two(2.0 * x)

print(*(globals()[name](0.5) for name in sys.argv[1].split(",")))
"""


def test_parts_of_one_name_from_two_processes_do_not_meet_in_a_third(tmp_path):
    """As a user's helper does that was edited between two sessions. Too long to be inlined, they keep their names."""
    program = tmp_path / "namesakes.py"
    program.write_text(NAMESAKES)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(Path(__file__).parents[2])}

    def printed(names: str) -> str:
        command = [sys.executable, program, names]
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.strip()

    assert [printed(names) for names in ("twice_one", "twice_two", "twice_one,twice_two")] == ["2.0", "4.0", "2.0 4.0"]
