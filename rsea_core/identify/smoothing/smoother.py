"""States and unknown port torques of a recording, with their error bars.

A fixed-interval smoother on the nominal linear machine, with a random-walk torque at every port
that the sensors can tell apart (`structure`). Nothing is differentiated and nothing filtered
causally; the current, the speeds and the torques at the ports are what the readings and the
equations of motion say together. How fast a port's torque may change is not tuned: the rate
densities maximise the likelihood of the readings.

Source: docs/diagnosis.md 3; Rogers & Friis, Mech. Syst. Signal Process. 168 (2022), restoring
forces as latent states; Schmidt, Adv. Control Systems 3 (1966), considered biases.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

import rsea_core.identify.smoothing.kalman as kalman
from rsea_core.errors import RigError
from rsea_core.identify.smoothing.linear_system import IN, PINNED
from rsea_core.identify.smoothing.quasi_static_ports import PortTorques, steady_ports
from rsea_core.identify.smoothing.separability import Separability
from rsea_core.identify.smoothing.smoother_input import Recorded
from rsea_core.identify.smoothing.smoother_setup import Setup, setup_of
from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig
from rsea_core.numeric.arrays import read_only
from rsea_core.recordings.recording import Recording

LIKELIHOOD_ROWS = 4000  # the liveliest stretch of this length decides the rate densities
RATE_BOUNDS = (1e-4, 1e3)  # of a port's scale per root second
DECADE = float(np.log(10.0))


@dataclass(frozen=True, kw_only=True)
class Smoothed(PortTorques):
    """What a recording of a moving machine says of its states and ports.

    Attributes
    ----------
    rate_density : mapping of str to float
        Of the random walks, unit of the port per root second.
    separability : Separability
    log_likelihood : float
    innovations : mapping of str to array
        Predicted readings' errors over their spread; nan where nothing was read.
    in_contact, pinned : array of bool
        Rows in contact, and rows in which the bridge is open or the current at its limit.
    """

    rate_density: Mapping[str, float]
    separability: Separability
    log_likelihood: float
    innovations: Mapping[str, NDArray]
    in_contact: NDArray
    pinned: NDArray


def smooth(
    rig: Rig,
    load: Load,
    columns: Mapping[str, NDArray],
    *,
    at_rest: bool = False,
    ignore: tuple[str, ...] = (),
    rate_density: Mapping[str, float] | None = None,
) -> Smoothed:
    """Smooth one recording of a machine that moves.

    Parameters
    ----------
    columns : mapping of str to (n,) array
        The recording's columns by the contract's names, evenly sampled.
    at_rest : bool
        Whether the machine is known to rest, without current, in the first row.
    ignore : tuple of str
        Columns not to be used as readings (a torque computed from the deflection, say).
    rate_density : mapping of str to float or None
        Of the ports; None finds them by maximum likelihood.

    Raises
    ------
    InputError
        If the columns do not fit the machine, rows are not even, or nothing is read.
    RigError
        If the rig lacks a value that the equations of motion need.
    """
    recorded = Recorded.of(rig, load, columns, ignore)
    setup = setup_of(recorded, at_rest)
    rates = dict(most_likely_rates(setup) if rate_density is None else rate_density)
    if recorded.needs_second_pass():
        signals = _run(setup, rates).signals
        recorded = recorded.refined(
            signals.get("load_angle_rad"), signals.get("wheel_velocity_rad_per_s")
        )
        setup = setup_of(recorded, at_rest)
    result = _run(setup, rates)
    return replace(result, time_s=read_only(np.array(columns["time_s"], dtype=float)))


def most_likely_rates(setup: Setup) -> dict[str, float]:
    """Rate densities of the ports that make the readings of the liveliest stretch most likely.

    One port after the other over a grid of powers of ten, twice, then downhill simplex.
    """
    block = setup.block(_liveliest(setup))
    scale = np.array([setup.magnitudes[port] for port in setup.latents])
    low, high = np.log(RATE_BOUNDS[0] * scale), np.log(RATE_BOUNDS[1] * scale)

    def cost(log_rate: NDArray) -> float:
        inside = np.clip(log_rate, low, high)
        beyond = float(np.sum((log_rate - inside) ** 2))
        rates = dict(zip(setup.latents, np.exp(inside), strict=True))
        return -_filtered(block, rates, keep=False)[0] + beyond

    best = np.log(scale)
    for width in (DECADE, 0.4 * DECADE):
        for j in range(best.size):
            tries = [best.copy() for _ in range(5)]
            for step, point in zip((-2, -1, 0, 1, 2), tries, strict=True):
                point[j] += step * width
            best = min(tries, key=cost)
    simplex = np.vstack([best, best + 0.3 * DECADE * np.eye(best.size)])
    found = minimize(
        cost,
        best,
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "maxfev": 15 * best.size, "xatol": 0.05, "fatol": 0.1},
    )
    return dict(zip(setup.latents, np.exp(np.clip(found.x, low, high)), strict=True))


def _liveliest(setup: Setup) -> slice:
    """The stretch of rows over which the readings move most."""
    n = setup.mode.size
    if n <= LIKELIHOOD_ROWS:
        return slice(0, n)
    moved = np.abs(np.diff(setup.readings, axis=0))
    moved = (moved / np.maximum(moved.mean(axis=0), 1e-300)).sum(axis=1)
    total = np.concatenate(([0.0], np.cumsum(moved)))
    start = int(np.argmax(total[LIKELIHOOD_ROWS:] - total[:-LIKELIHOOD_ROWS]))
    return slice(start, start + LIKELIHOOD_ROWS)


def _filtered(setup: Setup, rates: Mapping[str, float], *, keep: bool):
    return kalman.filter_rows(
        kalman.Dynamics(setup.A, setup.mode, setup.drift), setup.noise(rates), setup.H,
        setup.readings, setup.variance, setup.x0, setup.P0, keep,
    )  # fmt: skip


def _run(setup: Setup, rates: Mapping[str, float]) -> Smoothed:
    likelihood, _, filtered = _filtered(setup, rates, keep=True)
    mean, variance = kalman.smooth_rows(setup.A, setup.mode, setup.H, setup.outputs, filtered)
    for size, drift, readings, start in setup.biases:
        dynamics = kalman.Dynamics(setup.A, setup.mode, drift)
        response = kalman.respond_rows(dynamics, setup.H, setup.outputs, readings, start, filtered)
        variance = variance + (size * response) ** 2
    mean, std = mean + setup.offsets, np.sqrt(variance)
    spread = filtered.spread
    known = np.isfinite(spread) & (spread > 0.0)
    scaled = filtered.innovation / np.sqrt(np.where(known, spread, np.nan))

    def by_name(values: NDArray, names: tuple[str, ...]) -> dict[str, NDArray]:
        found = enumerate(setup.output_names)
        return {x: read_only(np.ascontiguousarray(values[:, j])) for j, x in found if x in names}

    signals = setup.output_names[: -len(setup.latents)]
    return Smoothed(
        time_s=read_only(np.arange(setup.mode.size) * setup.row_s),
        signals=by_name(mean, signals),
        signals_std=by_name(std, signals),
        ports=by_name(mean, setup.latents),
        ports_std=by_name(std, setup.latents),
        rate_density=dict(rates),
        separability=setup.separability,
        log_likelihood=float(likelihood),
        innovations={x: read_only(scaled[:, j].copy()) for j, x in enumerate(setup.channels)},
        in_contact=read_only(setup.mode >= IN),
        pinned=read_only(setup.mode % IN == PINNED),
    )


def port_torques(rig: Rig, recording: Recording) -> PortTorques:
    """Signals and port torques of a recording: smoothed, or row by row where it is steady.

    A machine whose inertia the rig does not know, a spring on a bench and a quasi-static
    recording are taken as rows at rest; everything else is smoothed. Columns that the logger
    computed from others are no readings.

    Raises
    ------
    InputError, RigError
        As `smooth` and `steady_ports`: nothing is read from which a port could be had.
    """
    arguments = (rig, recording.load, recording.columns)
    if recording.quasi_static or not (rig.has("gear") or rig.has("load")):
        return steady_ports(*arguments, ignore=recording.derived)
    try:
        return smooth(*arguments, ignore=recording.derived)
    except RigError:
        return steady_ports(*arguments, ignore=recording.derived)
