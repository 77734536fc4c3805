"""The clearance between two edges is the distance between them, at a tip's corner too."""

import numpy as np
import pytest

from dftfs.spring.clearance import measure_clearance

RADIUS_mm, STRIP_mm, CORNER_mm = 20.0, 4.4, 0.3


def arc(radius, begin, end, count=400):
    angle = np.linspace(begin, end, count)
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def edges(gap):
    """A disc's edge and a strip above it that ends in a tip with rounded corners."""
    inner = RADIUS_mm + gap
    middle = inner + CORNER_mm
    turn = np.linspace(0.0, np.pi / 2, 40)
    centre = middle * np.array([np.cos(CORNER_mm / middle), -np.sin(CORNER_mm / middle)])
    corner = centre + CORNER_mm * np.stack([-np.cos(turn), np.sin(turn)], axis=1)
    face = np.stack([np.linspace(middle, inner + STRIP_mm, 40)[1:], np.zeros(39)], axis=1)
    below = arc(inner, -1.0, -CORNER_mm / middle)[:-1]
    floor = arc(RADIUS_mm, -1.2, 0.6)
    return floor, np.concatenate([face[::-1], corner[::-1], below[::-1]])


@pytest.mark.parametrize("gap", [0.05, 0.3, 1.0, -0.05])
def test_a_corner_near_a_curved_edge_is_no_overlap(gap):
    """Its normal is turned away from the nearest part of that edge, and faces a part behind it."""
    floor, ceiling = edges(gap)
    found = measure_clearance(floor, ceiling, deepest_m=STRIP_mm / 2)
    assert found.smallest_m == pytest.approx(gap, abs=2e-4)  # chords of an arc
