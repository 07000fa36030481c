"""Jobs end with their result or their error, wherever they run."""

from __future__ import annotations

import os
import shlex
import threading
from functools import partial

import pytest
from rich.console import Console
from rich.progress import Progress

from rigid_env import launchers
from rigid_env.launchers import local, place, printed
from rigid_env.launchers.job import RETRIES, Ended, Job, run_job, shell_line
from rigid_env.launchers.place import HERE, Place


def divide(a: float, b: float) -> float:
    return a / b


def refuse(value: int) -> None:
    raise ValueError(f"value is {value};\nallowed is none")


def die_once(path: str) -> str:
    """Kill the process that runs it, the first time."""
    if not os.path.exists(path):
        open(path, "w").close()
        os._exit(1)
    return "lived"


def test_a_job_ends_with_its_result_or_its_error():
    assert run_job(Job("good", partial(divide, 1.0, 4.0), "")) == Ended("good", 0.25)
    assert run_job(Job("bad", partial(divide, 1.0, 0.0), "")).error == "ZeroDivisionError: float division by zero"
    assert run_job(Job("refused", partial(refuse, 3), "")) == Ended("refused", None, "value is 3; allowed is none")


def test_ctrl_c_ends_more_than_the_job():
    def interrupt():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_job(Job("any", interrupt, ""))


def test_processes_run_jobs_and_start_those_of_a_dead_one_again(tmp_path):
    jobs = [Job(f"{k}", partial(divide, float(k), 2.0), "") for k in range(4)]
    jobs.append(Job("dies", partial(die_once, str(tmp_path / "mark")), ""))
    jobs.append(Job("bad", partial(refuse, 1), ""))
    jobs.append(Job("unsent", threading.Lock, ""))
    told = list(Place("local", tmp_path, 2).run(jobs))
    assert sorted(end.name for end in told) == sorted(job.name for job in jobs)  # each ends once
    ends = {end.name: end for end in told}
    assert [ends[f"{k}"].result for k in range(4)] == [0.0, 0.5, 1.0, 1.5]
    assert ends["dies"].result == "lived"
    assert ends["bad"].error == "value is 1; allowed is none"
    assert ends["unsent"].error.startswith("result cannot be sent: TypeError: cannot pickle")


def test_a_job_that_always_kills_its_process_is_given_up(tmp_path):
    (end,) = local.launch([Job("deadly", partial(os._exit, 1), "")], tmp_path, 1)
    assert end.result is None
    assert f"ended {1 + RETRIES} times" in end.error


def test_printed_jobs_are_lines_for_a_shell(tmp_path, capsys):
    jobs = [Job("a", partial(divide, 1.0, 2.0), shlex.join(["echo", "a b"])), Job("b", partial(divide, 1.0, 2.0), "ls")]
    assert list(printed.launch(jobs, tmp_path, 1)) == []
    assert capsys.readouterr().out == "echo 'a b'\nls\n"
    assert Place("print", tmp_path).is_printed
    assert not Place("local", tmp_path).is_printed


def test_a_shell_line_has_the_options_that_are_set():
    line = shell_line("do", 4, names="a b", dt=0.01, quick=True, thorough=False, address=None, seed=0)
    assert shlex.split(line) == ["do", "4", "--names", "a b", "--dt", "0.01", "--quick", "--seed", "0"]


def test_jobs_run_one_after_the_other_in_this_process():
    done = []

    def call(k: int) -> int:
        done.append(k)
        return k

    ends = HERE.watch([Job(str(k), partial(call, k), "") for k in (3, 1)], Console(quiet=True))
    assert next(ends) == Ended("3", 3)
    assert done == [3]
    assert next(ends) == Ended("1", 1)
    assert list(ends) == []


def test_a_bar_names_the_first_job_that_has_not_ended(tmp_path, monkeypatch):
    bar = Progress(console=Console(quiet=True))
    monkeypatch.setattr(place, "progress_bar", lambda console: bar)
    monkeypatch.setattr(Place, "run", lambda self, jobs: (Ended(name, 1) for name in ("two", "one", "three")))
    jobs = [Job(name, partial(divide, 1.0, 2.0), "") for name in ("one", "two", "three")]
    shown = [(end.name, bar.tasks[0].description) for end in Place("local", tmp_path).watch(jobs, Console(quiet=True))]
    assert shown == [("two", "one"), ("one", "three"), ("three", "")]


def test_an_unknown_launcher_is_refused(tmp_path):
    with pytest.raises(ValueError, match="launcher is 'cloud'; allowed are local, ray, submitit, print"):
        Place("cloud", tmp_path)


@pytest.mark.parametrize("name", ["ray", "submitit"])
def test_a_launcher_without_its_library_names_the_extra(name, tmp_path, monkeypatch):
    import sys

    from gymnasium.error import DependencyNotInstalled

    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(DependencyNotInstalled, match=rf"rigid-env\[{name}\]"):
        list(launchers.load(name)([Job("a", partial(divide, 1.0, 2.0), "")], tmp_path, 1, "local"))


@pytest.mark.exhaustive
@pytest.mark.parametrize(("name", "address"), [("ray", None), ("submitit", "local")])
def test_clusters_run_jobs(name, address, tmp_path):
    pytest.importorskip(name)
    jobs = [Job(f"{k}", partial(divide, float(k), 2.0), "") for k in range(3)] + [Job("bad", partial(refuse, 1), "")]
    ends = {end.name: end for end in Place(name, tmp_path, 2, address).run(jobs)}
    assert [ends[f"{k}"].result for k in range(3)] == [0.0, 0.5, 1.0]
    assert ends["bad"].error == "value is 1; allowed is none"
