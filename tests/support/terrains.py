"""One terrain of each kind that the PhantomX of the paper can walk."""

import numpy as np

from phasmid.terrain import height_text

_X, _Y = np.meshgrid(np.arange(120) * 0.02, np.arange(60) * 0.02)
_HILLS = 0.010 * (1 - np.cos(2 * np.pi * _X / 0.5)) * (1 + 0.5 * np.sin(2 * np.pi * _Y / 0.6))

TERRAINS = {
    "slope-up": {"terrain": "slope", "slope_deg": 15},
    "slope-down": {"terrain": "slope", "slope_deg": -15},
    "slope-sideways": {"terrain": "slope", "slope_deg": 15, "terrain_yaw_deg": 90},
    "stairs": {"terrain": "stairs", "terrain_start_mm": 260},
    "stairs-down": {"terrain": "stairs", "rise_mm": -20, "terrain_start_mm": 260},
    "step": {"terrain": "step", "rise_mm": 40, "terrain_start_mm": 260},
    "gap": {"terrain": "gap", "gap_width_mm": 60, "terrain_start_mm": 260},
    "steps": {"terrain": "steps", "edge_x_mm": [280, 400], "edge_z_mm": [30, -10]},
    "blocks": {"terrain": "blocks", "terrain_start_mm": 260},
    "waves": {"terrain": "waves", "terrain_start_mm": 260},
    "rough": {"terrain": "rough", "terrain_start_mm": 260},
    "height-map": {
        "terrain": "height-map",
        "height_map": height_text(_HILLS),
        "map_cell_mm": 20,
        "terrain_start_mm": 260,
    },
    "ice": {"terrain": "ice", "terrain_start_mm": 260},
}
"""Fields of a scenario, by name."""
