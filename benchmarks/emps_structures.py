"""Which friction laws of the EMPS axis hold in its first record, by what is left out of the fits.

    python -m benchmarks.emps_structures FOLDER/emps/bang_bang.csv

One mass, a force by voltage, friction that is linear in its values: level and viscous part by
direction, Stribeck, quadratic, by position (with its sign: preload; without: a force of the
place), a constant force that changes evenly with time. Three figures of each structure, all inside
the record that is given: windows of 2.5 s predicted by fits to the others, free runs over each
cycle by fits to the other cycles, free runs over each half by fits to the other half. It is a
study beside the diagnosis: laws that prove themselves here would be worth an effect of the engine.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import butter, filtfilt

FORCE_N_per_V, MASS_kg, MASS_std_kg = 35.15065188248547, 95.1089, 5.0  # rig file; its tolerance
ROW_s, SMOOTH_Hz = 1e-3, 40.0
WINDOW, OFTEN, THIN = 2500, 500, 10  # rows of a window, between fitted windows, of a fit
TRAVEL_m = 0.2464
KNEE_m_per_s = 0.02  # of the Stribeck part
ORDERS = 4  # Legendre polynomials of the position
SMOOTHNESS = 5e-3  # prior of terms by position and time [mm of error for 1 N]

MASS, FORWARD, BACKWARD, VISCOUS_F, VISCOUS_B, STRIBECK, QUADRATIC_F, QUADRATIC_B, LATER = range(9)
PRELOAD, PLACE = 9, 9 + ORDERS
VALUES = PLACE + ORDERS
UNITS = np.array([5.0, 1.0, 1.0, 20.0, 20.0, 1.0, 300.0, 300.0, 1.0, *(1.0,) * 2 * ORDERS])
BASE = (MASS, FORWARD, BACKWARD, VISCOUS_F, VISCOUS_B)
PRIOR = (LATER, *range(PRELOAD, VALUES))
STRUCTURES = {
    "direction-dependent": BASE,
    "and Stribeck": (*BASE, STRIBECK),
    "and quadratic by direction": (*BASE, QUADRATIC_F, QUADRATIC_B),
    "and preload over the travel, 2 terms": (*BASE, PRELOAD, PRELOAD + 1),
    "and preload over the travel, 4 terms": (*BASE, *range(PRELOAD, PRELOAD + 4)),
    "and force of the place, 2 terms": (*BASE, PLACE, PLACE + 1),
    "and force of the place, 4 terms": (*BASE, *range(PLACE, PLACE + 4)),
    "and constant force changing with time": (*BASE, LATER),
    "and both: preload 4 terms, time": (*BASE, *range(PRELOAD, PRELOAD + 4), LATER),
}


@dataclass(frozen=True, kw_only=True)
class Record:
    """Force [N], position [m] and the smoothed motion that windows start from, by row."""

    force: NDArray
    position: NDArray
    smooth: NDArray
    speed: NDArray

    @property
    def last(self) -> int:
        """The last row."""
        return self.force.size - 1


def read(path: Path) -> Record:
    """A record of time, voltage and position."""
    _, volts, position = np.loadtxt(path, delimiter=",", skiprows=1).T
    smooth = filtfilt(*butter(4, 2.0 * SMOOTH_Hz * ROW_s), position)
    return Record(
        force=FORCE_N_per_V * volts, position=position, smooth=smooth,
        speed=np.gradient(smooth, ROW_s),
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def polynomials(p, first, place):
    """Legendre sum over the travel."""
    z = min(max(2.0 * place / TRAVEL_m - 1.0, -1.2), 1.2)
    zz = z * z
    even = p[first + 1] * (1.5 * zz - 0.5) + p[first + 3] * (4.375 * zz * zz - 3.75 * zz + 0.375)
    return p[first] * z + p[first + 2] * (2.5 * zz - 1.5) * z + even


@njit(cache=True, error_model="numpy")
def friction(p, place, speed, share, direction):
    """Friction and constant force [N] of motion this way; `share` of the record has passed."""
    size = abs(speed)
    if direction > 0.0:
        level = p[FORWARD] + p[VISCOUS_F] * size + p[QUADRATIC_F] * size * size
    else:
        level = p[BACKWARD] + p[VISCOUS_B] * size + p[QUADRATIC_B] * size * size
    level += p[STRIBECK] * np.exp(-((size / KNEE_m_per_s) ** 2)) + polynomials(p, PRELOAD, place)
    return direction * level + p[LATER] * (share - 0.5) + polynomials(p, PLACE, place)


@njit(cache=True, error_model="numpy")
def run(p, force, place, speed, first, last):
    """Positions (last - first + 1,) by Heun's rule, stops located inside the step."""
    out = np.empty(last - first + 1)
    out[0] = place
    for row in range(first, last):
        f, share = force[row], row / (force.size - 1.0)
        direction = np.sign(speed)
        if direction == 0.0:
            direction = _breaks_away(p, f, place, share)
        if direction != 0.0:
            a = (f - friction(p, place, speed, share, direction)) / p[MASS]
            guess = speed + ROW_s * a
            if guess * direction < 0.0:
                stop = min(-speed / a, ROW_s)
                place += 0.5 * speed * stop
                back = _breaks_away(p, f, place, share)
                speed = 0.0
                if back != 0.0:
                    a = (f - friction(p, place, 0.0, share, back)) / p[MASS]
                    speed = a * (ROW_s - stop)
                    place += 0.5 * speed * (ROW_s - stop)
            else:
                b = (f - friction(p, place + ROW_s * speed, guess, share, direction)) / p[MASS]
                after = speed + 0.5 * ROW_s * (a + b)
                place += 0.5 * ROW_s * (speed + after)
                speed = after
        out[row - first + 1] = place
    return out


@njit(cache=True, error_model="numpy")
def _breaks_away(p, force, place, share):
    if force > friction(p, place, 0.0, share, 1.0):
        return 1.0
    return -1.0 if force < friction(p, place, 0.0, share, -1.0) else 0.0


def nominal() -> NDArray:
    """Values of the rig file's machine with 20 N of Coulomb friction."""
    p = np.zeros(VALUES)
    p[[MASS, FORWARD, BACKWARD, VISCOUS_F, VISCOUS_B]] = MASS_kg, 20.0, 20.0, 203.5, 203.5
    return p


def errors(p: NDArray, record: Record, pieces: list[tuple[int, int]]) -> NDArray:
    """Errors [mm] of the pieces' runs, every `THIN`-th row; the record itself starts at rest."""
    found = []
    for first, last in pieces:
        start = (record.smooth[first], record.speed[first]) if first else (record.position[0], 0.0)
        y = run(p, record.force, *start, first, last)
        found.append((y - record.position[first : last + 1])[::THIN])
    return 1e3 * np.concatenate(found)


def fitted(record: Record, free: tuple[int, ...], pieces: list[tuple[int, int]]) -> NDArray:
    """Values that predict pieces of a record; mass by its prior, terms of place and time small."""
    p, free = nominal(), list(free)
    weak = [j for j in free if j in PRIOR]

    def residual(x):
        p[free] = x * UNITS[free]
        e = errors(p, record, pieces)
        prior = 1e-3 * (p[MASS] - MASS_kg) / MASS_std_kg
        return np.concatenate([e / np.sqrt(e.size), [prior], SMOOTHNESS * p[weak]])

    x = least_squares(residual, p[free] / UNITS[free], diff_step=1e-4, max_nfev=40).x
    p[free] = x * UNITS[free]
    return p


def windows(low: int, high: int, every: int) -> list[tuple[int, int]]:
    """Windows between two rows."""
    return [(a, a + WINDOW) for a in range(low, high - WINDOW + 1, every)]


def left_out(record: Record, free: tuple[int, ...], parts: list[tuple[int, int]]) -> list[float]:
    """Errors [mm] of each part's run by a fit to the windows outside of it."""
    found = []
    for first, last in parts:
        outside = [w for w in windows(0, record.last, OFTEN) if w[1] <= first or w[0] >= last]
        e = errors(fitted(record, free, outside), record, [(first, last)])
        found.append(float(np.sqrt(np.mean(e**2))))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("record", type=Path)
    record = read(parser.parse_args().record)
    bounds = np.linspace(0, record.last, 5).astype(int)
    cycles = list(zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True))
    middle = record.last // 2
    halves = [(middle, record.last), (0, middle)]
    print("| structure | windows left out, mm | cycles left out, mm | halves left out, mm |")
    print("| --- | --- | --- | --- |")
    for name, free in STRUCTURES.items():
        w = left_out(record, free, windows(0, record.last, WINDOW))
        c, h = (left_out(record, free, parts) for parts in (cycles, halves))
        each = ", ".join(f"{v:.2f}" for v in c)
        print(
            f"| {name} | {np.sqrt(np.mean(np.square(w))):.3f} |"
            f" {np.sqrt(np.mean(np.square(c))):.2f} ({each}) | {h[0]:.2f}, {h[1]:.2f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
