"""Write the pages of the environments: ``python -m benchmarks.environment_pages [ENV ...] [--pictures]``.

A page is made of an environment's own documentation and of what `agents.suite` kept in ``benchmarks/results/suite``;
`benchmarks.page_results` writes the section of results. Nothing is trained. With ``--pictures`` the trained policy that
comes with an environment is played for a picture that moves, and the learning curves are drawn.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import gymnasium as gym
import typer

import rigid_env  # noqa: F401 (registers)
from agents.suite import RESULTS, read_results, short_name
from benchmarks import machine
from benchmarks.page_results import rate, results_of
from rigid_env.envs.pretrained import pretrained_ids
from rigid_env.envs.registration import GOALS, MAX_EPISODE_STEPS, NAMESPACE, SUITE
from rigid_env.terminal import make_console

DOCS = Path(__file__).parents[1] / "docs"
PAGES = DOCS / "environments"
PICTURES = PAGES / "images"
TWINS = machine.RESULTS / "twins.json"
PICTURE_SEEDS = (0, 1)
SIZE = (280, 175)  # of a moving picture [px]

HEAD = "<!-- written by python -m benchmarks.environment_pages -->"


def all_ids() -> list[str]:
    """Return the ids of all environments that have a page, in the order of the list."""
    return [f"{NAMESPACE}/{name}-v0" for name in (*MAX_EPISODE_STEPS, *SUITE, *GOALS)]


def page_of(env_id: str) -> Path:
    """Return the file of an environment's page."""
    return PAGES / f"{short_name(env_id)}.md"


def page(env_id: str, results: Path = RESULTS) -> str:
    """Return the page of an environment as Markdown."""
    env = gym.make(env_id)
    described = env.unwrapped.describe()
    env.close()
    found, floors = read_results(results, env_id)
    parts = [HEAD, f"# {short_name(env_id)}", _picture(env_id), described.strip()]
    if found or floors:
        parts.append("\n\n".join(["## Results", *results_of(env_id, found, floors, _curve(env_id))]))
    parts.append(_elsewhere(env_id))
    return "\n\n".join(part for part in parts if part) + "\n"


def _picture(env_id: str) -> str:
    path = PICTURES / f"{short_name(env_id)}.gif"
    return f"![A trained agent](images/{path.name})" if path.is_file() else ""


def _curve(env_id: str) -> str:
    path = PICTURES / f"{short_name(env_id)}-curve.png"
    return f"![Learning curves](images/{path.name})" if path.is_file() else ""


def _elsewhere(env_id: str, file: Path = TWINS) -> str:
    """Return the success of policies in MuJoCo, of an environment with a twin that `judge_elsewhere` has judged."""
    kept = json.loads(file.read_text(encoding="utf-8"))
    engines = ("ours", *kept["settings"])
    rows = [
        (_policy_name(env_id, each["policy"]), *(rate(each["judged"][engine]) for engine in engines))
        for each in kept["rows"] if each["env"] == env_id
    ]  # fmt: skip
    if not rows:
        return ""
    heads = ["policy", "ours", *(f"MuJoCo, {setting}" for setting in kept["settings"])]
    told = f"Success of {kept['episodes']} episodes here and in MuJoCo: `python -m benchmarks.judge_elsewhere`."
    return "\n\n".join(["## Judged in another engine", told, machine.markdown_table(heads, rows)])


def _policy_name(env_id: str, name: str) -> str:
    return "that of the package" if name == short_name(env_id) else name


def index() -> str:
    """Return the list of all environments, with a line about each, and the mean of its seeds or its only one."""
    rows = []
    for env_id in all_ids():
        text = page_of(env_id).read_text(encoding="utf-8")
        first = re.search(r"## Description\n\n(.+?\.)(?:\s|$)", text, re.DOTALL)
        about = " ".join(first[1].split()) if first else ""
        found = re.search(r"^Interquartile mean of .*?: ([\d.]+%)", text, re.MULTILINE)
        found = found or re.search(r"^\| (?:ppo|sac) \| \d+ \| ([\d.]+%)", text, re.MULTILINE)
        rows.append((f"[{short_name(env_id)}]({short_name(env_id)}.md)", about, found[1] if found else ""))
    table = machine.markdown_table(["environment", "what the agent does", "trained"], rows)
    ids = f'The id of each is `{NAMESPACE}/` and its name: `gymnasium.make("{NAMESPACE}:{NAMESPACE}/BlockReach-v0")`.'
    return f"{HEAD}\n\n# Every environment\n\n{ids}\n\n{table}\n"


def draw_pictures(env_id: str, results: Path) -> None:
    """Play a trained policy, and draw the learning curves, for a page."""
    from rigid_env.lab.playing import write_video

    PICTURES.mkdir(parents=True, exist_ok=True)
    if env_id in pretrained_ids():
        write_video(env_id, PICTURES / f"{short_name(env_id)}.gif", PICTURE_SEEDS, size=SIZE, colours=32)
    found, _ = read_results(results, env_id)
    if any(each["is_default"] for each in found):
        _draw_curves([each for each in found if each["is_default"]], PICTURES / f"{short_name(env_id)}-curve.png")


def _draw_curves(found: Sequence[dict[str, Any]], path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.5, 2.8), layout="constrained")
    FigureCanvasAgg(figure)
    axis = figure.subplots()
    for each in found:
        points = [point for point in each["curve"] if point["success_rate"] is not None]
        xs, ys = [point["steps"] / 1e6 for point in points], [point["success_rate"] for point in points]
        axis.plot(xs, ys, label=f"{each['algo']}, seed {each['seed']}")
    axis.set(xlabel="million steps", ylabel="success, exploring", ylim=(-0.02, 1.02))
    axis.grid(alpha=0.3)
    axis.legend(fontsize="small")
    figure.savefig(path, dpi=80)


def main(
    env: Annotated[list[str] | None, typer.Argument(help="Gymnasium ids; none: all.")] = None,
    pictures: Annotated[bool, typer.Option("--pictures", help="Draw pictures anew, too.")] = False,
    results: Annotated[Path, typer.Option(help="Folder of the files of results.")] = RESULTS,
) -> None:
    """Write the pages of the environments."""
    PAGES.mkdir(parents=True, exist_ok=True)
    console = make_console()
    for env_id in env or all_ids():
        if pictures:
            draw_pictures(env_id, results)
        page_of(env_id).write_text(page(env_id, results), encoding="utf-8")
        console.print(f"written     {page_of(env_id)}", soft_wrap=True)
    (PAGES / "README.md").write_text(index(), encoding="utf-8")


if __name__ == "__main__":
    typer.run(main)
