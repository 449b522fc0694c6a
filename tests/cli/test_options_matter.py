"""Each field of a scenario changes a use of it, or is refused, or is noted to have no effect.

The same for the options of each command: they change the command, what it builds or writes.
"""

import hashlib
import re
from pathlib import Path

import numpy as np
import pytest

import phasmid
from phasmid import cli
from phasmid.cli import main, scenario_options
from phasmid.cli.parser import COMMANDS, build_parser, flags
from phasmid.errors import InvalidInput, PhasmidError
from phasmid.experiment import Command
from phasmid.formats import firmware_header
from phasmid.scenario import idle_fields, option_keys
from phasmid.scenario.relevance import UNUSED
from phasmid.scenario.scenario import Scenario
from phasmid.tables import choices
from phasmid.units import UNITS, split_unit

BASE = phasmid.load_scenario("paper").replace(duration=0.1)

OTHER = {
    "name": {"name": "other"},
    "description": {"description": "other"},
    "robot": {"robot": "phantomx-ax"},
    "gait": {"gait": "wave"},
    "duration": {"duration": 0.15},
    "offsets": {"offsets": [0.5, 0, 0.5, 0, 0.5, 0], "duty_factor": 0.5},
    "duty_factor": {"duty_factor": 0.6},
    "sway": {"sway": 0.05},
    "period": {"period": 1.5},
    "stance_radius_mm": {"stance_radius_mm": 165},
    "body_height_mm": {"body_height_mm": 110},
    "payload_g": {"payload_g": 200},
    "speed_gain": {"speed_gain": 50},
    "drive": {"drive": "servo"},
    "dt": {"dt": 0.0005},
    "record_interval": {"record_interval": 0.002},
    "max_steps": {"max_steps": 10},
    "start_height_mm": {"start_height_mm": 140},
    "contact_scale": {"contact_scale": "robot", "robot": "phantomx-mk4"},
    "stiffness": {"stiffness": 8000},
    "damping": {"damping": 20},
    "friction_damping": {"friction_damping": 300},
    "tip_width_mm": {"tip_width_mm": 2},
    "patches": {"patches": [[-1, 1, -1, 1, 0.01]]},
    "terrain_start_mm": {"terrain_start_mm": -300},
    "servo": {"servo": "MX-28"},
    "voltage": {"voltage": 10},
    "torque_limit": {"torque_limit": 0.5},
    "compliance_margin": {"compliance_margin": [2, 2]},
    "compliance_slope": {"compliance_slope": [16, 16]},
    "punch": {"punch": 40},
    "p_gain": {"p_gain": 30},
    "d_gain": {"d_gain": 5},
    "foot_force_noise": {"foot_force_noise": 0.3},
    "contact_threshold": {"contact_threshold": 0.2},
    "edge_x_mm": {"edge_x_mm": [100], "edge_z_mm": [5]},
    "edge_z_mm": {"edge_z_mm": [5], "edge_x_mm": [100]},
    "height_map": {"height_map": "map.png"},
    "depth_range_mm": {"depth_range_mm": 900},
}
"""Other values of fields where half more, one more, or the other choice is none."""

TEXTS = {"name", "description"}
"""Fields that are words in the files written."""

SELDOM = {
    "a simulated walk": {
        *("belly_contact", "servo", "voltage", "ambient_temperature", "torque_limit"),
    },
    "a driven robot": {"belly_contact", "drive", "torque_limit"},
    "a C header": {"drive", "payload_g", "servo", "torque_limit", "voltage"},
}
"""Fields that count in the servo verdict, when the trunk touches the ground or a servo reaches its
limit, or for which a plan is refused; the drive of a driven robot is the servo's already."""

KEYS = [key for key, path in option_keys().items() if path[0] != "robot_import"]


def changed(key):
    """The scenario with another value of a field."""
    if key in OTHER:
        return BASE.replace(**OTHER[key])
    path, table, value = option_keys()[key], Scenario, BASE
    for part in path[:-1]:
        table, value = table.model_fields[part].annotation, getattr(value, part)
    default, ending = getattr(value, path[-1]), split_unit(key)[1]
    options = choices(table.model_fields[path[-1]])
    if options or isinstance(default, bool):
        other = next(option for option in options or (True,) if option != default)
    elif isinstance(default, int):
        other = default + 8
    else:
        other = 1.5 * default if default else 0.1
        other = UNITS[ending].from_si(other) if ending and key != path[-1] else other
    return BASE.replace(**{key: other})


def digest(recording):
    """A number that is another one if any channel is."""
    found = hashlib.sha1(usedforsecurity=False)
    for name in sorted(recording.variables):
        found.update(name.encode() + np.ascontiguousarray(recording[name].values).tobytes())
    return found.hexdigest()


def walked(scenario):
    """The recording of a planned walk, its model's forces included."""
    return digest(phasmid.simulate(scenario, phasmid.plan(scenario)))


def driven(scenario):
    return digest(phasmid.drive(scenario, None, Command(velocity=(0.05, 0.0, 0.1))))


def header(scenario):
    return firmware_header(phasmid.plan(scenario))


USES = {"a simulated walk": walked, "a driven robot": driven, "a C header": header}


@pytest.mark.parametrize(
    "use",
    [pytest.param(use, marks=[pytest.mark.slow] * (use != "a C header")) for use in USES],
)
def test_each_field_has_an_effect_or_is_noted(use, compiled_engine):
    reference, silent = USES[use](BASE), []
    for key in KEYS:
        try:
            scenario = changed(key)
            noted = idle_fields(scenario.driven() if "driven" in use else scenario, use=use)
            is_noted = any(sentence.startswith(f"{key} has no effect") for sentence in noted)
            if not is_noted and USES[use](scenario) == reference:
                silent.append(key)
        except PhasmidError:
            # It is refused with a sentence.
            continue
    assert set(silent) <= TEXTS | SELDOM[use]


@pytest.mark.parametrize("use", UNUSED)
def test_a_field_without_effect_is_noted(use):
    """A value other than the default of each field that a use leaves out."""
    for table, unused in UNUSED[use].items():
        for key, path in option_keys().items():
            if path[:-1] == ((table,) if table else ()) and path[-1] in unused:
                try:
                    scenario = changed(key)
                except InvalidInput:
                    continue
                noted = idle_fields(scenario, use=use)
                assert any(words.startswith(f"{key} has no effect") for words in noted), key


ALONE = {
    "walk": ["--live-host 0.0.0.0", "--live-pace 2", "--trajectory-unit deg"],
    "drive --velocity 0,0,0": ["--calibration a.toml", "--baud 57600", "--after-exit hold"],
    "check": ["--frame hip"],
    "bus scan /dev/null": ["--once", "--robot phantomx-ax", "--seed 0", "--fault x", "--out a"],
    "bus monitor /dev/null": ["--pose zero", "--model AX-12A", "--force"],
    "bus calibrate /dev/null": ["--once", "--calibration a.toml", "--return-delay-us 0"],
    "bus emulate": ["--protocol 1", "--out a.toml", "--once"],
    "study s.toml --only 1": ["--workers 2", "--part 1/2", "--retry failed", "--ray"],
    "identify a.csv": ["--scenario paper", "--leg right_front"],
    "identify a.csv --compare": ["--mass-g 1", "--model m1", "--voltage 9", "--hanging-deg 0"],
    "export b.nc": ["--gait wave", "--servo AX-12A", "--strict"],
}
"""Options without effect on a command line that lacks what they belong to."""


@pytest.mark.parametrize(
    "line", [f"{command} {option}" for command, options in ALONE.items() for option in options]
)
def test_an_option_without_effect_is_refused(line, capsys, here):
    assert main(line.split()) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"phasmid: --{line.rpartition(' --')[2].split()[0]} ")
    assert not list(here.iterdir())


@pytest.mark.parametrize("command", COMMANDS)
def test_every_option_of_a_command_is_read(command):
    """An option that no module of the command line names does nothing."""
    source = "".join(path.read_text("utf-8") for path in Path(cli.__file__).parent.glob("*.py"))
    names = {flag.lstrip("-").replace("-", "_") for flag in flags(build_parser(command))}
    for name in names - {*option_keys(), "help", "h", "version"}:
        assert re.search(rf"options\.{name}\b|[\"']{name}[\"']", source), name


@pytest.mark.parametrize("command", scenario_options.COMMANDS)
def test_commands_of_a_scenario_have_the_same_options(command):
    names = {f"--{key.replace('_', '-')}" for key in option_keys()}
    assert names | {"--strict"} <= set(flags(build_parser(command)))
