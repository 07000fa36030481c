"""Train PPO of RLlib on BlockReach, on two Ray nodes: ``python examples/rllib_reach.py [--address A] [--target R]``."""

import argparse

import gymnasium as gym
import ray
import torch
from ray.cluster_utils import Cluster
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig
from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

from agents.evaluate import evaluation_seeds, run_episodes

ENV = "rigid_env:rigid_env/BlockReach-v0"  # a worker imports the module before the colon
# RLlib takes the step after the end of an episode for its reset, as NextStep has it, and asks no environment for its
# mode. With SameStep it would take the first observation of an episode for the last of the one before, and say nothing.
SETTINGS = {"autoreset_mode": "NextStep"}
parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--address", help="of a Ray cluster; by default two nodes on this machine are one")
parser.add_argument("--target", type=float, default=0.95, help="success rate without exploration that ends training")
asked = parser.parse_args()


def warm() -> None:
    """Compile the kernels of a node: by default RLlib drops a sample that takes over 60 s, as a cold compile may."""
    envs = gym.make_vec(ENV, num_envs=1, vectorization_mode="vector_entry_point", **SETTINGS)
    envs.reset(seed=0)
    envs.step(envs.action_space.sample())


def success(algorithm, episodes: int, seed: int) -> float:
    """Success rate of the mean actions, on episodes with seeds of their own."""
    module = algorithm.get_module()

    def policy(observations):
        return module.forward_inference({"obs": torch.from_numpy(observations)})["action_dist_inputs"][:, :6].numpy()

    return run_episodes(ENV, policy, evaluation_seeds(seed, episodes)).success.mean()


torch.set_num_threads(1)  # of the learner, in this process: its networks are small
if not asked.address:
    cluster = Cluster(True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    cluster.add_node(num_cpus=1)
ray.init(asked.address or cluster.address)
nodes = [NodeAffinitySchedulingStrategy(node["NodeID"], soft=False) for node in ray.nodes() if node["Alive"]]
ray.get([ray.remote(warm).options(num_cpus=0, scheduling_strategy=node).remote() for node in nodes])
config = PPOConfig().environment(ENV, env_config=SETTINGS).debugging(seed=0).env_runners(sample_timeout_s=600)
config.env_runners(num_env_runners=len(nodes), num_envs_per_env_runner=128, gym_env_vectorize_mode="vector_entry_point")
config.training(train_batch_size=16_384, minibatch_size=2048, num_epochs=5, lr=1e-3, lambda_=0.95, clip_param=0.2)
config.training(vf_loss_coeff=0.5, grad_clip=0.5, use_kl_loss=False)
config.rl_module(model_config=DefaultModelConfig(fcnet_hiddens=[64, 64], vf_share_layers=False, free_log_std=True))
algorithm, reached = config.build_algo(), 0.0
while reached < asked.target:
    result = [algorithm.train() for _ in range(5)][-1]
    steps, reached = result["env_runners"]["num_env_steps_sampled_lifetime"], success(algorithm, 200, seed=1)
    print(f"{steps:9,.0f} steps  {result['time_total_s']:5.0f} s  success {reached:.1%}", flush=True)
print(f"success {success(algorithm, 500, seed=0):.1%} of 500 fresh episodes")
ray.shutdown()
