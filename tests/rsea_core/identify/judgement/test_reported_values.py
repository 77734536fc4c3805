"""An effect is not claimed where no figure of it differs from that of a machine without it."""

import pytest

from rsea_core.effects.variant import Unknown
from rsea_core.identify.judgement.reported_values import shown


@pytest.mark.parametrize(
    ("figures", "expected"),
    [
        ({"offset": (-0.0042, 0.0045)}, False),
        ({"offset": (-0.0100, 0.0045)}, True),
        ({"scale": (1.02, 0.005)}, True),  # none of a scale is one
        ({"scale": (1.004, 0.005)}, False),
        ({"drive_efficiency": (0.9965, 0.0164), "backdrive_efficiency": (0.9968, 0.0165)}, False),
        ({"stiffness_rise_fast_over_static": (1.02, 0.015)}, False),
        ({"torque_amplitude_Nm": (0.0075, 0.0108), "angle_rad": (3.1, 2.2)}, False),
        ({"wheel_rad": (0.0, 6e-4), "worm_rad": (2e-4, 3e-6)}, True),  # one figure is enough
        ({"loop_width_Nm": (0.0, 0.02), "loop_energy_J": (0.0, 0.01)}, False),
        ({"resistance_rise_fraction": (0.01, 0.02), "peak_winding_C": (40.0, 3.0)}, True),
        ({"law": ("table", None)}, True),  # nothing to judge it by
    ],
)
def test_a_figure_two_deviations_from_none_shows_an_effect(figures, expected):
    entries = {name: {"value": value, "std": std} for name, (value, std) in figures.items()}
    assert shown(entries) is expected


def test_a_size_that_is_fitted_by_its_logarithm_is_never_absent():
    figures = {"loop_width_Nm": {"value": 0.039, "std": 0.031}}
    log = Unknown(name="stiffness_1_Nm_per_rad", unit="Nm/rad", low=1e-3, high=10.0, scale=0.1,
                  log=True)  # fmt: skip
    offset = Unknown(name="offset", unit="Nm", low=-1.0, high=1.0, scale=0.1)
    assert not shown(figures)
    assert shown(figures, (log,))
    assert not shown(figures, (log, offset))
    ratio = Unknown(name="scale", unit="-", low=0.05, high=20.0, scale=0.01, log=True)
    assert not shown({"scale": {"value": 1.004, "std": 0.005}}, (ratio,))
