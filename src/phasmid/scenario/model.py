"""Mechanical model of a scenario."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le

from phasmid.tables import Mass, Number, Table, Time
from phasmid.units import STANDARD_GRAVITY


class ModelTable(Table):
    """``[model]``: assumptions of analysis and simulation on the robot and its mechanics.

    Attributes:
        mass_model: ``as-given``, or ``mid-length``: centres of mass at mid-length and principal
            inertias only, as the printed Eq. 10 assumes.
        mounts: ``as-given``, or ``perpendicular``: all legs square to the direction of walking.
        body_acceleration: Whether the analysis counts the motion (``included``) or only gravity
            (``quasi-static``).
        force_model: How the analysis shares the load among the feet: ``minimum-norm`` of the
            forces, the paper's; ``weighted-minimum-norm``, where forces along the ground count
            more; ``minimum-torque`` of the joints; ``friction-cone``: the minimum norm of forces
            that do not pull or slip; ``smallest-largest-load``, within the same limits.
        tangential_weight: Of ``weighted-minimum-norm``: cost of a force along the ground beside
            that of a normal one.
        torque_limits: Whether ``friction-cone`` and ``smallest-largest-load`` also keep the
            standing legs' joints within the servo's stall torque.
        load_transfer: Time in which the load moves when a foot lands or lifts, centred on the
            event [s]; 0: at once.
        gravity: Acceleration of free fall [m/s²].
        payload: Mass that the robot carries at the centre of its trunk's upper side [kg].
    """

    mass_model: Literal["as-given", "mid-length"] = "as-given"
    mounts: Literal["as-given", "perpendicular"] = "as-given"
    body_acceleration: Literal["included", "quasi-static"] = "included"
    force_model: Literal[
        "minimum-norm",
        "weighted-minimum-norm",
        "minimum-torque",
        "friction-cone",
        "smallest-largest-load",
    ] = "minimum-norm"
    tangential_weight: Annotated[Number, Gt(0), Le(1e6)] = 10.0
    torque_limits: Literal["ignored", "counted"] = "ignored"
    load_transfer: Annotated[Time, Ge(0)] = 0.0
    gravity: Annotated[Number, Gt(0), Le(100)] = STANDARD_GRAVITY
    payload: Annotated[Mass, Ge(0), Le(100)] = 0.0
