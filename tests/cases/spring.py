"""Planar parameters that several test files share."""

from dataclasses import replace

from dftfs.spring.parameters import SpiralParameters

FIT = SpiralParameters(
    inner_radius_m=18.38e-3,
    outer_radius_m=75.07e-3,
    turns=1.9,
    n_arms=2,
    thickness_m=7.7e-3,
    fillet_radius_m=0.5e-3,
    tip_radius_m=0.3e-3,
    bore_radius_m=10.68e-3,
    hub_radius_m=18.38e-3,
    rim_inner_radius_m=78.92e-3,
    rim_outer_radius_m=86.62e-3,
)
REF = replace(FIT, turns=2.0, fillet_radius_m=1e-3)
THREE_ARMS = replace(FIT, n_arms=3, turns=1.2, thickness_m=6e-3)
ONE_ARM = replace(FIT, n_arms=1)
