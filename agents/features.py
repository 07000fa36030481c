"""Features of observations with goals: how far the goal is, coarsely and finely."""

from __future__ import annotations

import gymnasium as gym
import torch
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

FINE = 5.0
"""Factor of the differences that are squashed: places are told in units of 5 m, so that these are in metres."""


class GoalDifference(BaseFeaturesExtractor):
    """Observation and achieved goal, then the wanted goal minus the achieved one, as it is and squashed.

    A network that gets the two goals side by side has to learn to subtract numbers of the size of the room down to a
    fraction of a tolerance. The squashed difference, tanh of `FINE` times it, is fine near the goal and flat far away.

    Parameters
    ----------
    observation_space : gymnasium.spaces.Dict
        With ``observation``, ``achieved_goal`` and ``desired_goal``.
    """

    def __init__(self, observation_space: gym.spaces.Dict):
        size, goal = (observation_space[key].shape[0] for key in ("observation", "achieved_goal"))
        super().__init__(observation_space, size + 3 * goal)

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """(batch, features) from batches of the three parts."""
        achieved = observations["achieved_goal"]
        way = observations["desired_goal"] - achieved
        return torch.cat((observations["observation"], achieved, way, torch.tanh(FINE * way)), dim=1)
