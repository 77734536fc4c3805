"""Margins of 200 random loops, stable and not, have the value and the sign of python-control."""

import math

import numpy as np
import pytest

from rsea_core import ActuatorModel, Load, Rig
from rsea_core.control import PidTorque, loop_margins
from rsea_core.control.stability.crossings import crossings
from rsea_core.control.stability.margins import open_loop_response

T = 1e-3
MODEL = ActuatorModel(Rig.preset("rsea-bench"))
LOCKED = Load(kind="locked")


def random_loop(rng):
    """Poles, zeros and gain in z of a loop with two to five states.

    None lies so near to z = 1 that the polynomials of python-control lose the digits compared.
    """
    order = int(rng.integers(2, 6))
    poles, zeros = [], []
    while len(poles) < order:
        if order - len(poles) >= 2 and rng.random() < 0.5:
            pole = rng.uniform(0.5, 1.02) * np.exp(1j * rng.uniform(0.2, 2.5))
            poles += [pole, pole.conjugate()]
        else:
            poles.append(rng.uniform(0.2, 0.95))
    for _ in range(int(rng.integers(0, order))):
        zeros.append(rng.uniform(-0.9, 0.9))
    size = abs(np.prod(1.0 - np.array(zeros)) / np.prod(1.0 - np.array(poles)))
    return np.array(poles), np.array(zeros), 10.0 ** rng.uniform(-1.0, 1.0) / size


def response_of(top, bottom):
    def response(f):
        z = np.exp(2j * np.pi * f * T)
        return np.polyval(top, z) / np.polyval(bottom, z)

    return response


def test_margins_of_200_random_loops_agree_with_python_control_to_1e_6_signed():
    control = pytest.importorskip("control", reason="python-control is the oracle here")
    rng, negative, unstable, compared = np.random.default_rng(7), 0, 0, 0
    for _ in range(200):
        poles, zeros, gain = random_loop(rng)
        top = np.atleast_1d(gain * np.poly(zeros).real)
        bottom = np.poly(poles).real
        found = crossings(response_of(top, bottom), T, poles)
        loop = control.TransferFunction(top, bottom, T)
        gms, pms, *_ = control.stability_margins(loop, returnall=True, method="poly")
        lag = np.array(pms)
        if lag.size:
            expected = lag[np.abs(lag).argmin()]
            assert found.phase_margin[0] == pytest.approx(expected, abs=1e-6 * 180.0)
            negative += expected < 0.0
            compared += 1
        else:
            assert math.isinf(found.phase_margin[0])
        at_end = response_of(top, bottom)(np.array([0.5 / T]))[0].real
        if at_end < 0.0:  # a real crossing that its roots miss by rounding, on one side of z = -1
            gms = np.append(gms, -1.0 / at_end)
        dB = 20.0 * np.log10(np.array(gms)[np.array(gms) > 0.0])
        if dB.size:
            assert found.gain_margin[0] == pytest.approx(dB[np.abs(dB).argmin()], abs=1e-6 * 20.0)
            compared += 1
        unstable += np.abs(np.roots(np.polyadd(top, bottom))).max() > 1.0
    assert compared > 200
    assert negative > 20
    assert unstable > 40


def test_the_phase_margin_of_a_loop_beyond_minus_180_degrees_is_negative():
    """kp 900, ki 500, kd 20: -55.3 degrees by python-control on the loop's own response."""
    law = PidTorque(kp=900.0, ki=500.0, kd=20.0)
    found = loop_margins(MODEL, law, LOCKED)
    assert not found.is_stable
    control = pytest.importorskip("control", reason="python-control is the oracle here")
    f = np.unique(np.concatenate((np.geomspace(1.0, 499.9, 3000), [found.crossover_Hz])))
    loop = open_loop_response(MODEL, law, LOCKED, f)
    phase = np.degrees(np.unwrap(np.angle(loop)))
    pm = control.stability_margins((np.abs(loop), phase, 2.0 * np.pi * f))[1]
    assert found.phase_margin_deg == pytest.approx(pm, abs=1e-3)
    assert found.phase_margin_deg == pytest.approx(-55.3, abs=0.1)
