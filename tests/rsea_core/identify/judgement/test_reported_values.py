"""An effect is not claimed where no figure of it differs from that of a machine without it."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.effects.variant import Law, Unknown
from rsea_core.identify.judgement.covariance import Spread
from rsea_core.identify.judgement.reported_values import shown, sizes_shown


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
        ({"stiffness_rise_fast_over_static": (1.0, 0.0)}, False),  # that of none, of no value
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


def in_spread(law: Law, x, covariance, *others) -> bool:
    spread = Spread(sources=tuple(np.array(C, float) for C in (covariance, *others)))
    return sizes_shown(law, 0, np.array(x, float), spread)


def test_a_size_two_deviations_from_none_shows_a_law_whose_figure_is_unsure():
    slip = law_of(unknown("stiffness_1_Nm_per_rad", 0.01), unknown("yield_1_rad", 0.2, log=True))
    covariance = np.diag([6.6**2, 6.7**2])
    assert in_spread(slip, [86.0, -28.0], covariance)
    assert in_spread(slip, [13.3, -28.0], covariance)
    assert not in_spread(slip, [13.1, -28.0], covariance)  # a yield is no size
    assert not in_spread(slip, [86.0, -28.0], covariance, np.diag([50.0**2, 6.7**2]))
    assert in_spread(slip, [86.0, -28.0], covariance, np.zeros((2, 2)))  # one recording alone


def test_sizes_that_are_known_together_only_show_a_law():
    gear = law_of(unknown("drive_efficiency", 0.01), unknown("backdrive_efficiency", 0.01))
    apart = [100.0 - 1.5, 100.0 - 1.5]
    assert not in_spread(gear, apart, [[1.0, 0.0], [0.0, 1.0]])  # 4.5, the limit is 6.2
    assert in_spread(gear, apart, [[1.0, -0.9], [-0.9, 1.0]])
    assert not in_spread(gear, apart, [[1.0, 0.9], [0.9, 1.0]])


@pytest.mark.parametrize(("log", "none"), [(True, 0.0), (False, 100.0)])
def test_none_of_a_ratio_is_one(log, none):
    ratio = law_of(unknown("scale", 0.01, log=log))
    assert in_spread(ratio, [none + 2.1], [[1.0]])
    assert not in_spread(ratio, [none + 1.9], [[1.0]])


def test_a_law_without_sizes_is_shown_by_its_figures_alone():
    assert not in_spread(law_of(unknown("coulomb_Nm", 0.1, log=True)), [9.0], [[1.0]])


def test_sizes_of_an_unbalance_do_not_say_how_far_the_mass_of_the_rig_file_is_off():
    unbalance = replace(law_of(unknown("sin_Nm", 0.01)), effect="load-unbalance")
    assert not in_spread(unbalance, [9.0], [[1.0]])
