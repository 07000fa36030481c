"""Every table that a program prints, at 80 and 120 columns and in a pipe: its last column is there, and whole."""

from __future__ import annotations

import io
from types import SimpleNamespace as Namespace

import pytest
from rich.console import Console

import physics
from benchmarks import compile as compiling
from benchmarks import solvers
from physics import Frontier, FrontierPoint, scenes
from rigid_env.hard_cases import registry
from rigid_env.hard_cases.case import Check
from rigid_env.lab import plan_report, replaying
from rigid_env.lab.demo_report import event_table, show
from rigid_env.lab.hard_cases import show as cases
from rigid_env.lab.hard_cases.run import Outcome, Status
from rigid_env.lab.measure import accuracy_table, effects, rows, shares
from rigid_env.lab.measure.accuracy import Found, Job
from rigid_env.lab.measure.table import make_table
from rigid_env.lab.measure.timing import Row, Spread
from rigid_env.lab.measure.truths import CASES as TRUTHS
from rigid_env.lab.tosses.metric import Summary
from rigid_env.lab.tosses.show import case_table, ladder_table, limits_table
from rigid_env.terminal import Table
from rigid_env.terminal.console import UNBROKEN

WIDTHS = (80, 120, UNBROKEN)


def spread(median: float) -> Spread:
    return Spread((0.98765 * median, median, 1.01234 * median))


def bench() -> Table:
    found = [
        Row(key, what, rows.UNIT, spread(2.3051e7), accuracy, rows.MUJOCO, spread(5.888e5), target)
        for key, (what, target, _) in rows.SINGLE.items()
        for accuracy in rows.ACCURACIES
    ]
    batch = Row("batch", "1,024 worlds, 2 threads", "world steps/s", spread(2.97e6), "balanced", "mujoco.rollout",
                spread(9.994e5), 8.0)  # fmt: skip
    memory = Row("m", "growth of the process over 1,000,000 steps", "bytes/step", spread(0.0), target=1.0,
                 is_ratio=False)  # fmt: skip
    start = Row("s", "new process to first World.step", "s", spread(1.1523), target=1.5, is_ratio=False)
    return make_table([*found, batch, memory, start], "steps per second: median, lowest..highest [steps/s]")


def costs() -> Table:
    found = [
        Row(name, name, "steps/s", spread(1.2e7), "reference", "the scene without it", spread(2.3e7))
        for name in effects.CASES
    ]
    return make_table(found, "steps per second with the effect, against the scene without it")


def explained(scene: str, accuracy: str = "balanced") -> Table:
    plan = physics.make_plan(scenes.by_name(scene), physics.PRESETS[accuracy])
    return plan_report.make_table(plan, f"{scene}, accuracy {accuracy}")


def acted() -> Table:
    found = [shares.Share(name, 1.0, Spread((0.21, 0.224, 0.233))) for name in ("TangentialRestitution", "Spring 12")]
    return shares.make_table(found, "5 s in steps of 0.005 s, without a wrench")


def error_against_time() -> Table:
    engines = ("rigid-env", "balanced(substeps=5, solver='sweeps')"), ("mujoco", "implicitfast, one-step 1e-4")
    points = [
        FrontierPoint(engine, setting, dt, {"error": 1.2345e-9}, (123456e-6,))
        for engine, setting in engines
        for dt in (0.02, 0.0005)
    ]
    case = TRUTHS[0]
    frontier = Frontier(tuple(points), "error", {"error": "rad"}, {"error": 1e-11}, "closed form", 2.0, True)
    return accuracy_table.make_table(Found(Job(case.key, case.what, case.scene(), 2.0, case, (), ()), frontier))


def outcomes() -> list[Outcome]:
    checks = [
        Check("worst relative change of the angular momentum, 1e+05 rad/s", 7.3e-16, 1.4e-14, "kg m²/s"),
        Check("period over 2000 flips", 33.195123456, 9.3e-6, "s"),
    ]
    return [
        Outcome(case, "rigid-env", accuracy, dt, list(Status)[k % len(Status)], (checks[k % 2],), "", 12.34)
        for k, case in enumerate(registry.CASES)
        for accuracy in ("balanced", "precise")
        for dt in (0.001, 0.05)
    ]


def replayed() -> Table:
    row = {
        "t": 123.456, "status": "UNCONVERGED", "penetration": 1.23e-12, "residual": 4.56e-7, "impacts": 12,
        "energy": 123456.789, "is_identical": False,
    }  # fmt: skip
    return replaying.make_table([row] * 3, [0, 1, 2])


ERROR = Summary(300, 0.10581, 0.0923, 12.94, 6.98)
FITTED = Namespace(setup=Namespace(name="flights' centre of mass"), trained=ERROR, rest=ERROR, every=ERROR)
TOSSES = Namespace(cases=[FITTED] * 2, ladder=[Namespace(accuracy="reference", rest=ERROR, us=4168.1)])


def happened() -> Table:
    events = [{"t": 12.3456789, "kind": "impact", "body": 49, "wall": 2, "impulse": [1.0, 2.0, 2.0], "count": 12}]
    events.append({**events[0], "wall": -1, "other": 3})
    return event_table(events, ["Ellipsoid"] * 50)


def solved() -> Table:
    found = [solvers.Outcome("a wedge between two walls, 60°", "interior point", 1234, 200, 1.2e-7, 1.2345e-2)]
    return solvers.table("Coulomb friction", found)


def compiled() -> Table:
    step = compiling.FirstStep(12.34, 12.56, 123)
    return compiling.make_table([("corner_drop", "reference", {"another plan": [step] * 3})], "commit abcdefg")


def evaluated() -> Table:
    pytest.importorskip("stable_baselines3")
    from agents import evaluate

    result = {
        "env": "rigid_env/BlockReorient-v0", "episodes": 1000, "seed": 0, "success_rate": 0.987,
        "interval": (0.978, 0.993), "return_mean": 12.345, "return_std": 1.234, "length_mean": 123.4,
        "length_max": 500, "seconds": 12.3,
    }  # fmt: skip
    return evaluate.make_table(result, "runs/BlockReorient-v0-ppo-s0-2")


def transferred() -> Table:
    pytest.importorskip("stable_baselines3")
    from agents import accuracy_transfer as transfer

    seen = {"success_rate": 0.987, "interval": (0.978, 0.993)}
    row = transfer.Transfer("balanced", 123.4, 1_980_000, False, seen, seen)
    return transfer.make_table("rigid_env/BlockReach-v0", [row])


TABLES = {
    "bench": bench,
    "effects": costs,
    **{f"explain {name}": lambda name=name: explained(name) for name in scenes.SCENES},
    "explain precise": lambda: explained("drop", "precise"),
    "explain --duration": acted,
    "accuracy": error_against_time,
    "hard-cases": lambda: cases.detail_table(outcomes(), "balanced, 10 ms"),
    "hard-cases --steps": lambda: cases.grid_table(outcomes(), "at which steps each holds"),
    "replay": replayed,
    "tosses": lambda: case_table(TOSSES),
    "tosses, ladder": lambda: ladder_table(TOSSES, FITTED),
    "tosses, limits": lambda: limits_table(Namespace(noise=ERROR, landed=ERROR, missed=ERROR)),
    "run": happened,
    "benchmarks.solvers": solved,
    "benchmarks.compile": compiled,
    "agents.evaluate": evaluated,
    "agents.accuracy_transfer": transferred,
}


def printed(what, width: int) -> str:
    console = Console(width=width, file=io.StringIO(), markup=False, emoji=False, highlight=False)
    console.print(what)
    return console.file.getvalue()


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("name", TABLES)
def test_the_result_column_is_whole(name, width):
    table = TABLES[name]()
    text = printed(table, width)
    assert table.row_count > 0
    assert max(map(len, text.splitlines())) <= width
    assert "…" not in text
    last = len(table.columns) - 1
    for cell in (table.columns[last].name, *(row[last].plain for row in table.rows)):
        for line in cell.split("\n"):
            if table.columns[last].may_break:
                assert set(line.split()) <= set(text.split())
            else:
                assert line in text
    for k, column in enumerate(table.columns):  # and so is every number
        for row in table.rows if column.is_number else ():
            for line in row[k].plain.split("\n"):
                assert line in text, column.name


def test_the_usual_tables_are_tables_at_80_columns():
    """Not lists of lines: a header stands once."""
    for name in ("bench", "effects", "hard-cases", "explain drop", "replay", "tosses", "run", "accuracy"):
        table = TABLES[name]()
        assert table.row_count < 3 or printed(table, 80).count(table.columns[0].name) < table.row_count, name


@pytest.mark.parametrize("width", [80, 120])
def test_a_run_of_many_bodies_is_a_summary(width):
    class Run:
        name, accuracy, duration = "heap", "balanced", 5.0
        scene = physics.Scene([physics.Sphere(0.5, 1.0, pos=(2.0 * k, 0, 0)) for k in range(50)])

    vectors = [[1.0 * k, 2.0, 3.0] for k in range(50)]
    final = {"pos": vectors, "quat": [[1.0, 0, 0, 0]] * 50, "linvel": vectors, "angvel": vectors, "is_at_rest": False}
    counts = ("solves", "iterations", "fallbacks", "unconverged")
    status = {"name": "ok", "message": "every contact problem met its tolerance", "residual": 1e-9, "penetration": 0.0}
    content = {
        "events": [], "final": final, "energy": {"start": 1.0, "end": 1.0, "driven_work": 0.0, "dissipated": 0.0},
        "contacts": {"points": vectors, "forces": vectors}, "status": {**status, **dict.fromkeys(counts, 0)},
    }  # fmt: skip
    console = Console(width=width, file=io.StringIO())
    show(Run, content, console)
    text = console.file.getvalue()
    assert "50 Sphere" in text
    assert "x 0 .. 49" in text
    assert "body 49" in text
    assert "50 points" in text
    assert len(text.splitlines()) < 20
    assert max(map(len, text.splitlines())) <= width
