"""The wheel and the sdist hold all that a run needs, and say which extra a command lacks.

The first tests look at the contents. Those marked `exhaustive` install the wheel into empty virtual environments, which
needs the package index, and take minutes.
"""

from __future__ import annotations

import re

import numpy as np
import pytest
import typer

from rigid_env.cli import app
from tests.docs import snippets
from tests.package import distributions
from tests.package.distributions import Environment
from tests.tosses.conftest import make_tosses


@pytest.fixture(scope="module")
def _hatchling():
    pytest.importorskip("hatchling", reason="the extra dev brings hatchling, which builds the wheel")


@pytest.fixture(scope="module")
def wheel(_hatchling, tmp_path_factory):
    """The wheel of this checkout."""
    return distributions.build("wheel", tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def sdist(_hatchling, tmp_path_factory):
    """The sdist of this checkout."""
    return distributions.build("sdist", tmp_path_factory.mktemp("sdist"))


@pytest.fixture(scope="module")
def unpacked(sdist, tmp_path_factory):
    """Sources out of the sdist."""
    return distributions.unpack(sdist, tmp_path_factory.mktemp("unpacked"))


# contents


def test_the_wheel_holds_every_file_of_the_packages_and_nothing_else(wheel):
    found = {name for name in distributions.files_of(wheel) if ".dist-info/" not in name}
    assert found == distributions.files_in(*distributions.PACKAGES)
    rest = {name.partition(".dist-info/")[2] for name in distributions.files_of(wheel)} - {""}
    assert {"METADATA", "RECORD", "entry_points.txt", "licenses/LICENSE"} <= rest


def test_the_sdist_holds_packages_tests_pages_examples_and_measurements(sdist):
    found = distributions.files_of(sdist)
    folders = (*distributions.PACKAGES, *distributions.SOURCE_FOLDERS, *distributions.MAYBE_THERE)
    assert distributions.files_in(*folders) <= found
    assert {*distributions.SOURCE_FILES} <= found
    pages = {path.name for path in distributions.ROOT.glob("*.md")}
    assert pages <= found


def test_the_wheel_of_the_sdist_is_that_of_the_checkout(wheel, unpacked, tmp_path):
    assert distributions.files_of(distributions.build("wheel", tmp_path, unpacked)) == distributions.files_of(wheel)


def test_links_of_the_pages_lead_to_files_of_the_sdist(sdist):
    found = distributions.files_of(sdist)
    folders = {"/".join(name.split("/")[:depth]) for name in found for depth in range(1, name.count("/") + 1)}
    for page in (*snippets.PAGES, *distributions.ROOT.glob("*.md")):
        for target in snippets.links(page):
            path = (page.parent / target).resolve().relative_to(distributions.ROOT.resolve()).as_posix()
            assert path in found | folders, f"{snippets.name_of(page)}: {target}"


# every command in an empty virtual environment

# Words of a quick run, exit status, and the extra that the output names; "" where none is lacking.
WITHOUT_EXTRAS = {
    "demo": (("rest", "--duration", "0.1"), 0, "render"),
    "run": (("rest", "--duration", "0.1", "--csv", "rest.csv"), 0, ""),
    "replay": (("made.npz",), 0, ""),
    "explain": (("rest",), 0, ""),
    "describe": (("rigid_env/BlockReach-v0",), 0, ""),
    "scenes": ((), 0, ""),
    "warmup": ((), 0, ""),
    "bench": (("--quick",), 0, "bench"),
    "effects": (("gravity", "--quick"), 0, ""),
    "accuracy": (("creep", "--quick"), 0, ""),
    "tosses": (("tosses.npz", "--quick"), 0, ""),
    "hard-cases": (("zeno", "--quick"), 0, ""),
    "view": (("rest",), 1, "view"),
    "play": (("rigid_env/BlockReach-v0",), 1, "view"),
}

LACKING = [
    (("run", "rest", "--duration", "0.1", "--plot", "rest.png"), "render"),
    (("accuracy", "creep", "--quick", "--plot", "a.png"), "plot"),
    (("hard-cases", "zeno", "--quick", "--plot", "h.png"), "plot"),
    (("tosses", "tosses.npz", "--quick", "--plot", "t.png"), "plot"),
    (("view", "rest", "--export", "v.html"), "view"),
    (("play", "rigid_env/BlockReach-v0", "--video", "p.gif"), "render"),
]

# Programs that each extra makes run: words, and the files that they write.
WITH_EXTRA = {
    "render": [(("rigid-env", "demo", "rest", "--duration", "0.1"), ("demo/rest.png", "demo/rest.gif"))],
    "plot": [
        (("rigid-env", "accuracy", "creep", "--quick", "--plot", "a.png"), ("a.png",)),
        (("rigid-env", "hard-cases", "zeno", "--quick", "--plot", "h.png"), ("h.png",)),
    ],
    "view": [(("rigid-env", "view", "rest", "--export", "v.html", "--duration", "0.1"), ("v.html",))],
    "agents": [
        (("python", "-m", "agents.train", "--max-steps", "20000", "--no-video", "--out", "runs"), ()),
        (("rigid-env", "demo", "rest", "--duration", "0.1"), ("demo/rest.png",)),
    ],
    "bench": [(("rigid-env", "bench", "--quick"), ())],
    "peers": [(("rigid-env", "accuracy", "creep", "--quick", "--peers", "mujoco,pybullet,drake"), ())],
}

RECORD = """
import physics
world = physics.World(physics.scenes.by_name("rest"))
recorder = physics.Recorder(world, keep=10)
world.step(steps=3)
recorder.save("made.npz")
"""


def five_lines() -> str:
    """The first program of the README."""
    return snippets.blocks(distributions.ROOT / "README.md", "python")[0].code


def check(done, code: int, extra: str) -> None:
    """A command ends with a status, without a traceback, and names the line of an extra where it lacks one."""
    told = done.stdout + done.stderr
    assert done.returncode == code, told
    assert "Traceback" not in told
    assert set(re.findall(r'pip install "rigid-env\[(\w+)\]"', told)) == ({extra} if extra else set())
    assert "pip install -c" not in told  # there is no checkout


def test_every_command_is_tried():
    assert set(typer.main.get_command(app).commands) <= set(WITHOUT_EXTRAS)


@pytest.fixture(scope="module")
def bare(wheel, tmp_path_factory):
    """A virtual environment with the wheel alone, and files for its commands."""
    made = Environment(tmp_path_factory.mktemp("bare"))
    made.install(str(wheel))
    tosses = make_tosses(8, cube())
    np.savez(made.work / "tosses.npz", states=tosses.states, offsets=tosses.offsets, source_index=tosses.numbers)
    done = made.run("python", "-c", RECORD)
    assert done.returncode == 0, done.stderr
    return made


def cube():
    """A cube to toss."""
    from rigid_env.lab.tosses.replay import Cube

    return Cube(friction=0.25, restitution=0.3)


@pytest.mark.exhaustive
def test_the_five_lines_run_from_the_wheel(bare):
    done = bare.run("python", "-c", five_lines())
    assert done.returncode == 0, done.stderr
    done = bare.run("python", "-c", "import physics; print(physics.__file__)")
    assert str(bare.home) in done.stdout


@pytest.mark.exhaustive
@pytest.mark.parametrize("command", sorted(typer.main.get_command(app).commands))
def test_every_command_runs_or_names_its_extra(command, bare):
    words, code, extra = WITHOUT_EXTRAS[command]
    check(bare.run("rigid-env", command, *words), code, extra)


@pytest.mark.exhaustive
@pytest.mark.parametrize(("words", "extra"), LACKING, ids=lambda value: value if isinstance(value, str) else value[0])
def test_every_picture_names_its_extra(words, extra, bare):
    check(bare.run("rigid-env", *words), 1, extra)
    assert not (bare.work / words[-1]).exists()


@pytest.mark.exhaustive
@pytest.mark.parametrize("extra", WITH_EXTRA)
def test_each_extra_brings_its_commands(extra, wheel, tmp_path):
    made = Environment(tmp_path)
    if extra == "agents":  # the small torch, as the README installs it
        made.install("--no-deps", "torch", "--index-url", "https://download.pytorch.org/whl/cpu")
    made.install(f"{wheel}[{extra}]")
    for (program, *words), files in WITH_EXTRA[extra]:
        done = made.run(program, *words)
        assert done.returncode == 0, done.stdout + done.stderr
        assert "pip install" not in done.stdout + done.stderr
        for name in files:
            assert (made.work / name).stat().st_size > 0
    listed = made.run("python", "-m", "pip", "list", "--format", "freeze").stdout
    assert not re.search(r"(?m)^(nvidia|cuda)", listed), listed


# the tests that the sdist holds

COLLECTED = 1500  # tests at least
PARTS = ("tests/docs", "tests/smoke", "tests/cli", "tests/tasks")


@pytest.fixture(scope="module")
def from_sdist(unpacked, tmp_path_factory):
    """A virtual environment with the sources of the sdist, as its README installs them for tests, engines left out."""
    made = Environment(tmp_path_factory.mktemp("from_sdist"))
    made.work = unpacked
    made.install("-e", ".[smoke,render,plot,view]", "pytest-xdist", "mpmath", "hatchling")
    return made


@pytest.mark.exhaustive
def test_the_whole_suite_of_the_sdist_collects(from_sdist):
    done = from_sdist.run("python", "-m", "pytest", "--collect-only", "-p", "no:cacheprovider")
    assert done.returncode == 0, done.stdout[-3000:]
    assert done.stdout.count("::") > COLLECTED


@pytest.mark.exhaustive
@pytest.mark.parametrize("part", PARTS)
def test_the_sdist_passes_its_own_tests(part, from_sdist):
    done = from_sdist.run("python", "-m", "pytest", part, "-n", "2", "-p", "no:cacheprovider", timeout=3600)
    assert done.returncode == 0, done.stdout[-5000:]
