"""Features of observations with goals: difference between the desired and the achieved goal, linear and squashed."""

from __future__ import annotations

import gymnasium as gym
import torch
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

FINE = 5.0
"""Factor of goal differences before tanh: positions are observed in units of 5 m, so the product is in metres."""


class GoalDifference(BaseFeaturesExtractor):
    """Features extractor that appends the goal difference to the observation, linear and squashed by tanh.

    The features are the observation, the achieved goal, and the desired minus the achieved goal in both forms. A
    network with the two goals as inputs would have to learn to subtract numbers of the size of the room with a
    precision of a fraction of the tolerance. The squashed difference, tanh of `FINE` times it, changes much near the
    goal and little far away.

    Parameters
    ----------
    observation_space : gymnasium.spaces.Dict
        With ``observation``, ``achieved_goal`` and ``desired_goal``.
    """

    def __init__(self, observation_space: gym.spaces.Dict):
        size, goal = (observation_space[key].shape[0] for key in ("observation", "achieved_goal"))
        super().__init__(observation_space, size + 3 * goal)

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """Features (batch, features) of a batch of observations."""
        achieved = observations["achieved_goal"]
        way = observations["desired_goal"] - achieved
        return torch.cat((observations["observation"], achieved, way, torch.tanh(FINE * way)), dim=1)
