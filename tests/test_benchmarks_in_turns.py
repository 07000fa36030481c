"""The comparison of the speed of two commits, in turns."""

from __future__ import annotations

import pytest

from benchmarks import in_turns


class Side:
    """A checkout whose steps take so long, and that remembers when it was asked."""

    def __init__(self, name: str, step_seconds: float, asked: list):
        self.name, self.step_seconds, self.asked = name, step_seconds, asked

    def ask(self, scene: str, count: int) -> None:
        self.asked.append((self.name, count))

    def answer(self) -> float:
        return self.step_seconds * self.asked[-1][1]


def test_a_ratio_is_the_time_there_over_the_time_here_and_who_begins_changes():
    asked = []
    here, there = Side("here", 1e-4, asked), Side("there", 2e-4, asked)
    assert in_turns.compare(here, there, "drop", 3).ratio.samples == pytest.approx([2.0] * 3)
    assert [name for name, _ in asked[-6:]] == ["here", "there", "there", "here", "here", "there"]
    assert len({count for _, count in asked[-6:]}) == 1
    assert asked[-1][1] * here.step_seconds >= in_turns.SAMPLE_SECONDS


@pytest.mark.exhaustive
def test_processes_step_a_scene_and_an_environment():
    side = in_turns.Checkout(in_turns.WORKER.parents[1], worker=in_turns.WORKER)
    assert in_turns.seconds(side, "kick", 10) > 0
    assert in_turns.seconds(side, in_turns.ENVIRONMENT, 2) > 0
    side.close()
