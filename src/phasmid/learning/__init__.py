"""Reinforcement learning: Gymnasium environments of walking robots, policies and their gates.

Importing this package registers the environments with Gymnasium.
"""

from phasmid.errors import InvalidInput
from phasmid.extras import install_hint

try:
    import gymnasium
except ModuleNotFoundError as error:
    raise InvalidInput(
        "learning needs Gymnasium, which is not installed.", hint=install_hint("learn")
    ) from error

from phasmid.learning.environment import WalkEnv, WalkVectorEnv
from phasmid.learning.export import export_task
from phasmid.learning.gates import Assessment, assess
from phasmid.learning.policy import Policy, PolicyController, policy_names, save_policy
from phasmid.learning.task import Task, load_task, task_names

__all__ = [
    "Assessment",
    "Policy",
    "PolicyController",
    "Task",
    "WalkEnv",
    "WalkVectorEnv",
    "assess",
    "export_task",
    "load_task",
    "policy_names",
    "save_policy",
    "task_names",
]

for _name in task_names():
    gymnasium.register(
        f"Phasmid/{_name.capitalize()}-v0",
        entry_point="phasmid.learning:WalkEnv",
        vector_entry_point="phasmid.learning:WalkVectorEnv",
        kwargs={"task": _name},
    )
