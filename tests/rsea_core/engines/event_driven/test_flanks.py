"""Worm and backlash together do not stop the event-driven engine.

Ten of the 400 machines of `benchmarks/switching.py` run, nine of which stopped an engine that
knew only flanks that press and flanks that are apart.
"""

import numpy as np
import pytest

from benchmarks.switching import run
from rsea_core.engines.event_driven.flanks import TOUCHING, settled


@pytest.mark.parametrize("seed", [7, 34, 43, 60, 82, 116, 178, 214, 301, 354])
def test_no_machine_stops_by_switching_and_its_energy_balance_closes(seed):
    energy = run(seed).energy
    entered = max(np.ptp(energy.supplied_J), np.ptp(energy.lost_J()))
    assert np.abs(energy.imbalance_J()).max() < 1e-8 * entered


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_flanks_press_touch_or_part_by_their_torque_with_and_without_the_loads_friction(side):
    assert settled(side, 0.1 * side, 0.2 * side) == side
    assert settled(side, -0.1 * side, 0.2 * side) == side * TOUCHING
    assert settled(side, -0.2 * side, -0.1 * side) == 0.0
