"""Scenarios: robot, gait, stride, ground and simulation of one experiment, as data."""

from phasmid.scenario.file import (
    load_scenario,
    recorded_scenario,
    scenario_names,
    scenario_to_toml,
    with_robot,
)
from phasmid.scenario.relevance import idle_fields
from phasmid.scenario.rerun import Difference, Replay, replay
from phasmid.scenario.scenario import Scenario, option_keys

__all__ = [
    "Difference",
    "Replay",
    "replay",
    "Scenario",
    "idle_fields",
    "load_scenario",
    "option_keys",
    "recorded_scenario",
    "scenario_names",
    "scenario_to_toml",
    "with_robot",
]
