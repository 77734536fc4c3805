"""An effect is not claimed where no figure of it differs from that of a machine without it."""

import numpy as np
import pytest

from rsea_core.effects.variant import Law, Unknown
from rsea_core.identify.judgement.reported_values import shown, sizes_with_std


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


def law_of(*unknowns: Unknown) -> Law:
    return Law(effect="e", law="l", subsystem="drive", kind=None, write=lambda *_: None,
               unknowns=unknowns, starts=())  # fmt: skip


def unknown(name: str, scale: float, *, log: bool = False) -> Unknown:
    return Unknown(name=name, unit="", low=0.01, high=100.0, scale=scale, log=log)


def test_a_size_two_deviations_from_none_shows_a_law_whose_figure_is_unsure():
    slip = law_of(unknown("stiffness_1_Nm_per_rad", 0.01), unknown("yield_1_rad", 0.2, log=True))
    figures = {"loop_width_Nm": {"value": 0.039, "std": 0.031}}
    sure = sizes_with_std(slip, np.array([86.0, -28.0]), np.array([6.6, 6.7]))
    assert sure == [(86.0, 6.6)]  # a yield is no size
    assert shown(figures, sure)
    assert not shown(figures, sizes_with_std(slip, np.array([9.0, -28.0]), np.array([6.6, 6.7])))
    assert not shown(figures)


@pytest.mark.parametrize(("log", "none"), [(True, 0.0), (False, 100.0)])
def test_none_of_a_ratio_is_one(log, none):
    ratio = law_of(unknown("scale", 0.01, log=log))
    ((distance, std),) = sizes_with_std(ratio, np.array([none + 3.0]), np.array([1.0]))
    assert (distance, std) == (pytest.approx(3.0), 1.0)


def test_a_logarithm_of_a_size_is_never_that_of_none():
    assert (
        sizes_with_std(law_of(unknown("coulomb_Nm", 0.1, log=True)), np.ones(1), np.ones(1)) == []
    )
