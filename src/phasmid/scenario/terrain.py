"""The ground."""

from __future__ import annotations

from typing import Annotated

from annotated_types import Ge, Le

from phasmid.tables import Number, Table


class TerrainTable(Table):
    """``[terrain]``: level ground.

    Attributes:
        friction: Coefficient of Coulomb friction between foot and ground.
    """

    friction: Annotated[Number, Ge(0), Le(10)] = 0.7
