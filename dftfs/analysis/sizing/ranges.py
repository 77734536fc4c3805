"""Ranges of a sizing's dimensions that follow from its envelope and its process.

Lengths go with the envelope's radius R. A shape scaled as a whole, its width adjusted, keeps
stiffness, mass, stress and travel, so that the outside diameter matters through the process'
limits only: it is searched from 0.7 of the envelope up to all of it.
"""

import math

from dftfs.process import Process

Range = float | list[float]

_THICKNESS = (0.015, 0.20)  # of R
_INNER = (0.10, 0.55)
_AROUND_BORE = 0.15  # from an asked bore to the largest inner radius
_DIAMETER = (0.70, 1.0)  # of the envelope
_TURNS = [0.5, 4.0, 0.02]
_FILLET = (0.006, 0.07)
_WIDTH = (0.045, 0.60)  # a strip much wider in the plane than across it tips out of it
_STEPS_OF_RADIUS = 1000  # the increment of a length is a round number near R over this


def derived_ranges(envelope_mm: float, process: Process, bore_mm: float = 0.0) -> dict[str, Range]:
    """Minimum, maximum and increment (mm) of every dimension by its field, one value if fixed."""
    radius = envelope_mm / 2
    step = round_increment(radius / _STEPS_OF_RADIUS)
    wall, gap = 1e3 * process.wall_m, 1e3 * process.gap_m
    largest_inner = max(_INNER[1], bore_mm / envelope_mm + _AROUND_BORE)
    corner = max(1e3 * process.inside_radius_m, gap / 2)

    def lengths(share: tuple[float, float], least: float = 0.0) -> list[float]:
        low = math.ceil(max(share[0] * radius, least) / step) * step
        high = math.floor(share[1] * radius / step) * step
        return [low, max(low, high), step]

    return {
        "thickness_mm": lengths(_THICKNESS, wall),
        "inner_radius_mm": lengths((_INNER[0], min(largest_inner, 1.0))),
        "outer_diameter_mm": [_DIAMETER[0] * envelope_mm, _DIAMETER[1] * envelope_mm, 2 * step],
        "turns": _TURNS,
        "fillet_radius_mm": lengths(_FILLET, corner),
        "width_mm": lengths(_WIDTH, wall),
        "n_arms": 2.0,
        "taper": 1.0,
    }


def round_increment(length_mm: float) -> float:
    """The largest of 1, 2 or 5 times a power of ten that is not above a length."""
    power = 10.0 ** math.floor(math.log10(length_mm))
    return max(k * power for k in (1, 2, 5) if k * power <= length_mm * (1 + 1e-9))
