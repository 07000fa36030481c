"""Draw `architecture.svg`: packages that stand on each other, and the life of a step.

``python docs/images/architecture.py`` writes the picture beside this file.
"""

from __future__ import annotations

from html import escape
from pathlib import Path

PICTURE = Path(__file__).with_suffix(".svg")
WIDTH, HEIGHT = 940, 590
LEFT, RIGHT = 20, 490  # of the two halves [px]
HALF_WIDTH = 430
ROW = 26

# Title and rows of folders of each layer, from top to bottom.
LAYERS = (
    ("agents", "#fdf1dc", ("training and evaluation of policies",)),
    (
        "rigid_env", "#fdf1dc",
        ("cli · viewer · lab · hard_cases", "envs · suite · rendering", "tasks · launchers · terminal"),
    ),
    ("physics", "#e3eefb", ("io · work_precision · analysis", "world", "plan · schemes · scene", "mass · parallel")),
    (
        "physics/kernels, compiled", "#dff3e4",
        (
            "queries · multibody | event_driven | time_stepping", "contact_solver · contact_law · half_space",
            "forces · flight · state · lcp · parallel · math",
        ),
    ),
    ("physics/compiler", "#eeeeee", ("decorators of kernels, and three compilers behind them",)),
)  # fmt: skip

PYTHON = ("Env.step(action): check it", "Task.step: clip it to a wrench", "Stepper: make the prepared call")
BEFORE = ("bind a body: parameters, gravity, wrench",)
STAGES = (
    "loads of fields, held over the stage",
    "contact set: features at walls or bodies",
    "impacts: impulses that act at once",
    "stage: free flight, or a midpoint step in contact",
    "cut it where something new is met",
)
AFTER = ("store state, warm start, report",)
LAST = "observe: observation, reward, success"


def text(x: float, y: float, words: str, size: int = 13, anchor: str = "start", weight: str = "normal") -> str:
    """Return a line of text; y is that of its foot."""
    style = f'font-size="{size}" text-anchor="{anchor}" font-weight="{weight}"'
    return f'<text x="{x:g}" y="{y:g}" {style}>{escape(words)}</text>'


def box(x: float, y: float, width: float, height: float, fill: str, dash: str = "") -> str:
    """Return a rectangle with round corners."""
    dashes = f' stroke-dasharray="{dash}"' if dash else ""
    size = f'width="{width:g}" height="{height:g}"'
    return f'<rect x="{x:g}" y="{y:g}" {size} rx="5" fill="{fill}" stroke="#556"{dashes}/>'


def arrow(*points: tuple[float, float]) -> str:
    """Return a line through points with a head at the last one."""
    path = " ".join(f"{x:g},{y:g}" for x, y in points)
    return f'<polyline points="{path}" fill="none" stroke="#556" stroke-width="1.5" marker-end="url(#head)"/>'


def layers() -> list[str]:
    """Left half: each package on those that it imports."""
    parts, y = [text(LEFT, 28, "Each layer imports those below it", 15, weight="bold")], 46
    for title, fill, rows in LAYERS:
        height = 34 + ROW * len(rows)
        parts += [box(LEFT, y, HALF_WIDTH, height, fill), text(LEFT + 12, y + 20, title, 14, weight="bold")]
        for k, row in enumerate(rows):
            cells = row.split(" | ")
            width = (HALF_WIDTH - 24) / len(cells)
            for c, cell in enumerate(cells):
                left, top = LEFT + 12 + c * width, y + 28 + k * ROW
                parts += [
                    box(left, top, width - (6 if c < len(cells) - 1 else 0), ROW - 4, "#ffffff"),
                    text(left + width / 2 - 3, top + 16, cell, anchor="middle"),
                ]
        y += height + 14
    return parts


def step(x: float, y: float, width: float, words: str) -> list[str]:
    """One stage of a step."""
    return [box(x, y, width, ROW - 2, "#ffffff"), text(x + width / 2, y + 16, words, anchor="middle")]


def column(x: float, y: float, width: float, rows: tuple[str, ...], pace: float = 36) -> tuple[list[str], float]:
    """Stages below each other, an arrow between them: (parts, foot of the last one)."""
    parts: list[str] = []
    for k, words in enumerate(rows):
        parts += step(x, y + k * pace, width, words)
        if k:
            parts.append(arrow((x + width / 2, y + k * pace - (pace - ROW + 2)), (x + width / 2, y + k * pace - 2)))
    return parts, y + (len(rows) - 1) * pace + ROW - 2


def life() -> list[str]:
    """Right half: a step from the action to the observation."""
    x, width = RIGHT, HALF_WIDTH
    middle = x + width / 2
    parts = [
        text(x, 28, "A step", 15, weight="bold"),
        box(x, 46, width, 124, "#fdf1dc"),
        text(x + 10, 64, "Python", 14, weight="bold"),
    ]
    more, foot = column(x + 80, 56, width - 120, PYTHON)
    parts += more
    parts += [box(x, 190, width, 380, "#dff3e4"), text(x + 10, 208, "machine code", 14, weight="bold")]
    parts.append(text(x + width - 10, 208, "each world, body, step", 12, "end"))
    parts.append(arrow((middle, foot), (middle, 216)))
    parts += step(x + 40, 218, width - 80, BEFORE[0])
    parts += [box(x + 20, 254, width - 40, 212, "#eef9f0", "5 4"), text(x + 30, 270, "until the step is over", 12)]
    parts.append(arrow((middle, 242), (middle, 276)))
    more, foot = column(x + 40, 278, width - 80, STAGES)
    parts += more
    side = x + width - 28
    parts.append(arrow((x + width - 40, foot - 12), (side, foot - 12), (side, 290), (x + width - 38, 290)))
    parts.append(arrow((middle, foot), (middle, 484)))
    parts += step(x + 40, 486, width - 80, AFTER[0])
    parts.append(arrow((middle, 510), (middle, 532)))
    parts += step(x + 40, 534, width - 80, LAST)
    return parts


def picture() -> str:
    """Text of the SVG file."""
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" '
        'font-family="DejaVu Sans, Verdana, Arial, sans-serif" fill="#223">',
        '<defs><marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path d="M0,0 L8,4 L0,8 z" fill="#556"/></marker></defs>',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>',
    )
    return "\n".join([*head, *layers(), *life(), "</svg>"]) + "\n"


if __name__ == "__main__":
    PICTURE.write_text(picture(), encoding="utf-8")
