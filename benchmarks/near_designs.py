"""Random designs around the thesis' own, for benchmarks that must hold on more than one."""

from dataclasses import replace

import numpy as np

from dftfs.design import SpringDesign, load_design
from dftfs.errors import DftfsError
from dftfs.spring.outline import coil_gap


def random_design(rng: np.random.Generator, number: int) -> SpringDesign:
    """A design near the thesis', its coils at least 1.5 mm apart."""
    base = load_design("al1")
    while True:
        thickness = rng.uniform(4, 9)
        outer = rng.uniform(60, 85)
        spiral = replace(
            base.spiral,
            thickness_m=1e-3 * thickness,
            outer_radius_m=1e-3 * outer,
            rim_inner_radius_m=1e-3 * (outer + thickness / 2),
            rim_outer_radius_m=1e-3 * (outer + 1.5 * thickness),
            turns=rng.uniform(1.0, 2.2),
            n_arms=int(rng.integers(2, 5)),
            fillet_radius_m=1e-3 * rng.uniform(0.4, 2.0),
        )
        line = spiral.centreline
        theta = np.arange(line.start + spiral.pitch_rad, line.end, 0.05)
        try:
            if theta.size and float(np.min(coil_gap(spiral, theta))) > 1.5e-3:
                return replace(base, name=f"random-{number}", spiral=spiral)
        except DftfsError:
            continue
