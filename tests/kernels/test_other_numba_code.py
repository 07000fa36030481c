"""Numba compiles the functions of others as it did before: what kernels change of it is theirs alone."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import physics

PROGRAM = '''
import inspect, json, re, sys
import numba, numpy as np
from numba.experimental import jitclass
from numba.extending import overload


def functions():
    """Functions of others, as new ones that nothing has been compiled for."""

    @numba.njit
    def plain(a, t):
        s = 0.0
        for i in range(0, len(a), 2):
            s += max(a[i, -1], min(a[-1, i], 2.0)) ** 3 * t[i % 2] - int(a[i, 0]) / (1 + i)
        return s if s is not None else 0.0, a.reshape(-1)[1:].sum(), 3.0 in t, np.sqrt(s)

    @numba.njit
    def raises(a, k):
        if k > 3:
            raise ValueError("too large")
        return [a[k] for k in range(k)]

    def doubled(x):
        """For an overload."""

    @overload(doubled)
    def doubled_for(x):
        return lambda x: x * 2.0 + x

    @numba.njit
    def overloaded(x):
        return doubled(x)

    @numba.vectorize([numba.float64(numba.float64, numba.float64)])
    def ufunc(x, y):
        return max(x, y) ** 2 + abs(x)

    @numba.guvectorize([(numba.float64[:], numba.float64[:])], "(n)->()")
    def gufunc(a, out):
        out[0] = 0.0
        for k in range(a.shape[0]):
            out[0] += a[k] * a[-1]

    @jitclass([("x", numba.float64[:])])
    class Point:
        def __init__(self, x):
            self.x = x

        def norm(self, p):
            return np.abs(self.x[-1]) ** p

    return plain, raises, overloaded, ufunc, gufunc, Point


def plainly(text):
    """LLVM IR, or a type, without addresses, counters of functions and blocks of this process, and their widths."""
    text = re.sub(r"B\\d+v\\d+B", "", text)
    text = re.sub(r"(picklebuf\\.|dynamic\\.globals\\.|#|_23)[0-9a-f]+", r"\\1", text)
    text = re.sub(r" +|\\[\\d+ x i8\\]", " ", text)
    blocks = {}
    return re.sub(r"\\bB\\d+\\b", lambda label: f"B{blocks.setdefault(label.group(), len(blocks))}", text)


def observe():
    """Results, signatures and LLVM IR of the functions of others."""
    plain, raises, overloaded, ufunc, gufunc, Point = functions()
    a, t = np.arange(16.0).reshape(4, 4), (1.5, 3.0)
    results = [plain(a, t), raises(a, 2), overloaded(2.5), overloaded(2), ufunc(a, 2.0), gufunc(a), Point(a[1]).norm(3)]
    try:
        raises(a, 5)
    except ValueError as error:
        results.append(error)
    norm = Point.class_type.jit_methods["norm"]
    made = {
        f"{each.py_func.__name__} {plainly(str(sig))}": made
        for each in (plain, raises, overloaded, ufunc._dispatcher, gufunc.gufunc_builder.nb_func, norm)
        for sig, made in each.overloads.items()
    }
    signatures = [plainly(str(each.signature)) for each in made.values()]
    code = {name: plainly(each.library.get_llvm_str()) for name, each in made.items()}
    return {"results": [repr(each) for each in results], "signatures": signatures, "code": code}


def numbas():
    """Functions and other attributes of all classes and modules of Numba loaded so far."""
    found = {}
    for name, module in list(sys.modules.items()):
        if name.partition(".")[0] not in ("numba", "llvmlite"):
            continue
        for key, value in list(vars(module).items()):
            if callable(value):
                found[name, key] = value
            if inspect.isclass(value):
                found |= {(name, key, attribute): one for attribute, one in vars(value).items() if callable(one)}
    return found


observe()  # Numba makes some tables when it first needs them
before, attributes = observe(), numbas()
import physics

world = physics.World(physics.Scene([physics.Block((5, 3, 2), 6.0, angvel=(1, 2, 3))]), dt=0.01)
world.step()
now = numbas()
changed = [" ".join(key) for key, value in attributes.items() if now.get(key) is not value]
classes = {key for key, value in attributes.items() if inspect.isclass(value)}
changed += [" ".join(key) for key in now.keys() - attributes.keys() if key[:2] in classes]
from physics.kernels.time_stepping.step import step_worlds

print(json.dumps({
    "before": before, "after": observe(), "changed": changed, "attributes": len(attributes),
    "compiled": sum(step_worlds.stats.cache_misses.values()),
}))
'''


def test_functions_of_others_are_compiled_as_without_physics(tmp_path: Path):
    """In a process that compiles a step between: results, signatures and LLVM IR are the same, Numba's classes, too."""
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    environment = {
        **os.environ, "PYTHONPATH": str(Path(physics.__file__).parents[1]), "NUMBA_CACHE_DIR": str(tmp_path)
    }  # fmt: skip
    done = subprocess.run(
        [sys.executable, str(program)], env=environment, capture_output=True, text=True, check=True, timeout=300
    )
    found = json.loads(done.stdout)
    assert found["compiled"] == 1
    before, after = found["before"], found["after"]
    assert len(before["signatures"]) == 7
    assert after["results"] == before["results"]
    assert after["signatures"] == before["signatures"]
    assert after["code"].keys() == before["code"].keys()
    assert [name for name, text in before["code"].items() if after["code"][name] != text] == []
    assert found["attributes"] > 1000
    assert found["changed"] == []
