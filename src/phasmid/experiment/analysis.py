"""Options of the analysis of a planned walk."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le

from phasmid.tables import Number, Table, Time


class Analysis(Table):
    """How the analysis of a planned walk finds the feet's forces and the joints' torques.

    Attributes:
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
    """

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
