"""Controllers of phasmid's own, as a recording tells of them and as they are made again from it."""

from __future__ import annotations

import json
from dataclasses import fields, is_dataclass
from typing import Any

from phasmid.control import (
    Controller,
    EngineSettings,
    LocomotionEngine,
    Player,
    SafetyFilter,
    SafetySettings,
    Sequencer,
    SequenceSettings,
)
from phasmid.control.estimation.settings import EstimatorSettings
from phasmid.control.feed_forward.settings import FeedForwardSettings
from phasmid.errors import InvalidInput, plain
from phasmid.gait import Gait
from phasmid.motion import Motion, plan, trajectory_from_text
from phasmid.recording import Recording
from phasmid.scenario import Scenario

OWN = "scenario's own"
"""Name of the controller that a scenario has where nobody gives one."""

SETTINGS = {
    kind.__name__: kind
    for kind in (
        EngineSettings,
        FeedForwardSettings,
        EstimatorSettings,
        Gait,
        SafetySettings,
        SequenceSettings,
    )
}
"""What settings may consist of, beside numbers, texts and lists of them."""


def controller_attributes(controller: Controller, *, own: bool) -> dict[str, str]:
    """What a recording tells of a controller.

    Args:
        controller: What decides.
        own: Whether it is the scenario's own.
    """
    if own:
        return {"controller": OWN}
    if type(controller) in (SafetyFilter, Sequencer):
        return _wrapped(controller)
    kind = type(controller)
    if kind is LocomotionEngine:
        settings = _told(controller.settings)  # type: ignore[attr-defined]
        return {"controller": "locomotion engine", "controller_settings": json.dumps(settings)}
    if kind is Player:
        told = {name: getattr(controller, name) for name in ("rate", "lead")}
        return {"controller": "player", "controller_settings": json.dumps(told)}
    return {"controller": f"{kind.__module__}.{kind.__qualname__}"}


def _wrapped(controller: Any) -> dict[str, str]:
    """What a recording tells of a controller within safety, sequences or both."""
    around = []
    while type(controller) in (SafetyFilter, Sequencer):
        if type(controller) is SafetyFilter:
            around.append(_told(controller.monitor.settings))
            controller = controller.controller
        else:
            around.append(_told(controller.settings))
            controller = controller.walker
    inner = controller_attributes(controller, own=False)
    return {**inner, "controller_around": json.dumps(around)}


def recorded_controller(recording: Recording, scenario: Scenario) -> Controller | None:
    """The controller of a recorded run, made again; None: the scenario's own.

    Args:
        recording: Of a driven run.
        scenario: Its own, with its robot.

    Raises:
        InvalidInput: It was somebody's own.
    """
    name = str(recording.attrs["controller"])
    if name == OWN:
        return None
    try:
        settings = _made(json.loads(str(recording.attrs.get("controller_settings", "null"))))
        around = _made(json.loads(str(recording.attrs.get("controller_around", "[]"))))
    except (ValueError, TypeError, KeyError):
        settings, around = None, ()
    found: Controller | None = None
    if name == "locomotion engine" and isinstance(settings, EngineSettings):
        found = LocomotionEngine(scenario.load_robot(), settings)
    elif name == "player" and isinstance(settings, dict):
        found = Player(_motion(recording, scenario), rate=settings["rate"], lead=settings["lead"])
    for outer in reversed(around):
        if found and isinstance(outer, SequenceSettings):
            found = Sequencer(found, scenario.load_robot(), outer)
        elif found and isinstance(outer, SafetySettings):
            found = SafetyFilter(found, scenario.load_robot(), outer)
        else:
            found = None
    if found:
        return found
    raise InvalidInput(
        f"the run was driven by {plain(name)}, which a recording does not hold; it cannot be run "
        "again.",
        hint="phasmid.drive with that controller",
    )


def _motion(recording: Recording, scenario: Scenario) -> Motion:
    text = recording.attrs.get("trajectory")
    if text is None:
        return plan(scenario)
    return trajectory_from_text(str(text), scenario.load_robot())


def _told(value: Any) -> Any:
    """A setting as JSON holds it."""
    if is_dataclass(value) and not isinstance(value, type):
        inner = {field.name: _told(getattr(value, field.name)) for field in fields(value)}
        return {"is": type(value).__name__, **inner}
    if isinstance(value, tuple | list):
        return [_told(each) for each in value]
    return value if value is None or isinstance(value, str | int | float) else repr(value)


def _made(value: Any) -> Any:
    """A setting again."""
    if isinstance(value, dict):
        inner = {name: _made(each) for name, each in value.items() if name != "is"}
        return SETTINGS[value["is"]](**inner) if "is" in value else inner
    return tuple(_made(each) for each in value) if isinstance(value, list) else value
