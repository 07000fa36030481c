"""Optimisations of the compiler can be left out one by one, and results stay the same."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import typer

import physics
from benchmarks import ablation as benchmark
from physics.compiler import cache_folder
from physics.compiler.fused import ablation

SOURCES = Path(physics.__file__).parent


def test_a_name_that_is_unknown_is_refused_with_those_allowed():
    with pytest.raises(
        ValueError, match=r"RIGID_ENV_WITHOUT='ranges, rangs' names rangs; allowed are .*ranges"
    ) as told:
        ablation.read_names("ranges, rangs")
    for name in ablation.OPTIMISATIONS:
        assert name in str(told.value)
    assert ablation.read_names("") == frozenset()
    assert ablation.read_names(" ranges,,scalars ") == {"ranges", "scalars"}
    with pytest.raises(KeyError):
        ablation.is_on("rangs")


def test_each_switch_is_looked_at_where_its_optimisation_hooks_in():
    text = "".join(path.read_text(encoding="utf-8") for path in SOURCES.rglob("*.py") if path.stem != "ablation")
    assert [name for name in ablation.OPTIMISATIONS if f'is_on("{name}")' not in text] == []


def test_each_module_has_a_switch_or_a_reason_for_having_none():
    modules = {path.stem for path in (SOURCES / "compiler" / "fused").glob("*.py")}
    named = ablation.OPTIMISATIONS.keys() | ablation.BASES.keys() | {"__init__", "ablation"}
    assert modules - named == set()
    assert not ablation.OPTIMISATIONS.keys() & ablation.BASES.keys()


PROGRAM = """
import json
from pathlib import Path
import numpy as np
from physics.compiler import cache_folder
from physics.compiler.decorators import inlined, kernel

@inlined
def largest(row):
    found = row[0]
    for k in range(1, row.shape[0]):
        found = max(found, row[k])
    return found

@kernel
def total(table, out):
    s = 0.0
    for i in range(table.shape[0]):
        s += table[i, -1] * largest(table[i]) ** 3 - (1.0, 2.0, 4.0)[i % 3]
    out[0] = s

table, out = np.arange(12.0).reshape(4, 3), np.zeros(1)
total(table, out)
(made,) = total.overloads.values()
print(json.dumps({"result": out[0], "code": made.library.get_asm_str(), "folder": cache_folder.folder_name()}))
"""


def run_without(names: str, folder: Path) -> dict:
    """Result, machine code and folder of a kernel without some optimisations."""
    program = folder / "program.py"
    program.write_text(PROGRAM)
    environment = {
        **os.environ, "PYTHONPATH": str(SOURCES.parent), "NUMBA_CACHE_DIR": str(folder), ablation.VARIABLE: names
    }  # fmt: skip
    done = subprocess.run(
        [sys.executable, str(program)], env=environment, capture_output=True, text=True, check=True, timeout=120
    )
    return json.loads(done.stdout)


@pytest.mark.exhaustive
def test_switches_leave_the_result_as_it_is_and_kernels_in_folders_of_their_own(tmp_path):
    """Each changes machine code; all of them at once still compile."""
    everything = ",".join(ablation.OPTIMISATIONS)
    expected = run_without("", tmp_path)
    folders = {expected["folder"]}
    assert folders == {cache_folder.folder_name()}
    for names in ("ranges", "scalars,lowering", everything):
        found = run_without(names, tmp_path)
        assert found["result"] == pytest.approx(expected["result"], rel=1e-14)
        assert found["code"] != expected["code"]
        assert found["folder"].startswith(f"{expected['folder']}-without-")
        folders.add(found["folder"])
    assert len(folders) == 4


def test_a_process_with_an_unknown_name_ends_with_it():
    environment = {**os.environ, ablation.VARIABLE: "rangs"}
    done = subprocess.run([sys.executable, "-c", "import physics"], env=environment, capture_output=True, text=True)
    assert done.returncode == 1
    assert "ValueError: RIGID_ENV_WITHOUT='rangs' names rangs; allowed are " in done.stderr


def test_the_benchmark_takes_ratios_turn_by_turn_and_measures_no_row_again(tmp_path, capsys, monkeypatch):
    """Rows that the file holds are shown; a name that is unknown is refused."""
    samples = {"with": [dict.fromkeys(benchmark.COLUMNS, 2.0)] * 3}
    samples["without"] = [dict.fromkeys(benchmark.COLUMNS, each) for each in (2.0, 3.0, 8.0)]
    path = tmp_path / "rows.json"
    path.write_text(json.dumps({"rows": {"ranges": {"machine": "some machine", "samples": samples}}}))
    monkeypatch.setattr(benchmark, "sample", lambda *_: pytest.fail("measured again"))
    monkeypatch.setenv(ablation.VARIABLE, "lowering")
    benchmark.main(repeats=1, only=["ranges"], json=path)
    out = capsys.readouterr().out
    assert "1.50" in out
    assert "prepared_entry has no switch" in out
    with benchmark.left_out("scalars"):
        assert os.environ[ablation.VARIABLE] == "scalars"
    assert os.environ[ablation.VARIABLE] == "lowering"
    with pytest.raises(typer.BadParameter, match="rangs; allowed are "):
        benchmark.main(only=["rangs"])
