"""What a port's torque looks like, in numbers with significance and as text.

Every statistic is computed on the smoothed port torques, its standard error by resampling blocks
of time (events and loops where it counts those), and says in a sentence what it points to. None
of them decides alone. Source: docs/diagnosis.md 6.2.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.locate.signature_derivatives import (
    band_signature,
    lag_signature,
    quadrant_signature,
    trend_signature,
)
from rsea_core.identify.locate.signature_events import half_cycles, loop_rows, reversal_steps
from rsea_core.identify.locate.signature_rows import (
    MOTION,
    OWN_MOTION,
    WHAT,
    PortRows,
    Signature,
    port_rows,
    spread_of,
    unit_of,
)
from rsea_core.identify.smoothing.quasi_static_ports import PortTorques
from rsea_core.recordings.recording import Recording

SIGNIFICANT = 4.0  # standard errors: some thirty statistics are looked at
NEEDED_EVENTS = 4
ORDERS = np.arange(1.0, 101.0)


def signatures(
    recordings: Sequence[Recording],
    found: Sequence[PortTorques],
    *,
    ports: Sequence[str] | None = None,
    seed: int = 0,
) -> tuple[Signature, ...]:
    """Every signature that is significant, the clearest first.

    Parameters
    ----------
    recordings, found : sequences of one length
        Recordings and their port torques, best without what parameters explain
        (`Located.residual`).
    ports : sequence of str or None
        Those to look at; None: all.
    """
    ports = sorted({port for f in found for port in f.ports}) if ports is None else ports
    result = []
    for port in ports:
        rows = port_rows(port, recordings, found)
        if rows is None:
            continue
        for statistic in STATISTICS:
            result += statistic(rows, np.random.default_rng(seed))
    kept = [s for s in result if abs(s.z) > SIGNIFICANT]
    return tuple(sorted(kept, key=lambda s: -abs(s.z)))


def reversal_signature(rows: PortRows, rng: np.random.Generator) -> list[Signature]:
    """Step of the torque where a motion turns back: whose reversal it follows, whose friction."""
    best = None
    for mover, name in MOTION.items():
        if name not in rows.signals:
            continue
        steps = reversal_steps(rows.torque, rows.signals[name], rows.row_s, rows.recording)
        if steps.size < NEEDED_EVENTS:
            continue
        se = spread_of(lambda pick, steps=steps: steps[pick].mean(), steps.size, rng)
        z = abs(steps.mean()) / max(se, 1e-300)
        if best is None or z > best[0]:
            best = (z, mover, float(steps.mean()), se, steps.size)
    if best is None:
        return []
    _, mover, step, se, count = best
    resisting = step > 0.0 if rows.port == "S" else step < 0.0
    kind = "against the motion: dry friction or a loop" if resisting else "with the motion"
    return [
        Signature(
            name="reversal step", port=rows.port, value=step, se=se, unit=unit_of(rows.port),
            sentence=f"The {WHAT[rows.port]} steps by {abs(step):.3g} ± {se:.1g}"
            f" {unit_of(rows.port)} where the {mover} turns back ({count} times), {kind}.",
            details={"events": float(count)},
        )
    ]  # fmt: skip


def odd_even_signature(rows: PortRows, rng: np.random.Generator) -> list[Signature]:
    """What changes sign with the motion (friction) and what does not (a force, an asymmetry)."""
    name = MOTION[OWN_MOTION[rows.port]]
    if name not in rows.signals:
        return []
    speed = rows.signals[name]
    moving = np.abs(speed) > 0.1 * np.sqrt(np.mean(speed**2))
    sign, block = np.where(moving, np.sign(speed), 0.0), rows.blocks()
    sums = [
        np.bincount(block, weights)
        for weights in (
            rows.torque * (sign > 0), (sign > 0) * 1.0, rows.torque * (sign < 0), (sign < 0) * 1.0
        )
    ]  # fmt: skip

    def parts(pick: NDArray) -> NDArray:
        up, ups, down, downs = (s[pick].sum() for s in sums)
        if ups == 0.0 or downs == 0.0:
            return np.array([0.0, 0.0])
        return 0.5 * np.array([up / ups - down / downs, up / ups + down / downs])

    odd, even = parts(np.arange(sums[0].size))
    se_odd, se_even = spread_of(parts, sums[0].size, rng)
    mover, unit = OWN_MOTION[rows.port], unit_of(rows.port)
    return [
        Signature(
            name="odd in speed", port=rows.port, value=float(odd), se=float(se_odd), unit=unit,
            sentence=f"The {WHAT[rows.port]} is {odd:+.3g} ± {se_odd:.1g} {unit} times the"
            f" sign of the {mover}'s motion on average.",
            details={},
        ),
        Signature(
            name="even in speed", port=rows.port, value=float(even), se=float(se_even), unit=unit,
            sentence=f"The {WHAT[rows.port]} is {even:+.3g} ± {se_even:.1g} {unit} in both"
            " directions of motion: an offset, or friction that differs by direction.",
            details={},
        ),
    ]  # fmt: skip


def loop_signature(rows: PortRows, rng: np.random.Generator) -> list[Signature]:
    """Loss per loop against amplitude and rate: W ~ A^p f^q."""
    mover = OWN_MOTION[rows.port]
    angle = {"wheel": "wheel_angle_rad", "load": "load_angle_rad"}.get(
        mover, "spring_deflection_rad"
    )
    if MOTION[mover] not in rows.signals or angle not in rows.signals or rows.port == "V":
        return []
    resisting = -1.0 if rows.port == "S" else 1.0  # a spring's torque acts on the load
    cycles = half_cycles(
        resisting * rows.torque,
        rows.signals[angle],
        rows.signals[MOTION[mover]],
        rows.row_s,
        rows.recording,
    )
    loops = loop_rows(cycles)
    if len(loops) < 2 * NEEDED_EVENTS:
        return []
    amplitude, rate, loss = loops.T
    kept = loss > 0.0
    if kept.sum() < 2 * NEEDED_EVENTS or np.ptp(np.log(amplitude[kept])) < 0.5:
        return []
    x, y, w = np.log(amplitude[kept]), np.log(rate[kept]), np.log(loss[kept])
    columns = [np.ones_like(x), x] + ([y] if np.ptp(y) > 0.5 else [])
    X = np.column_stack(columns)

    def exponents(pick: NDArray) -> NDArray:
        return np.linalg.lstsq(X[pick], w[pick], rcond=None)[0][1:]

    value = exponents(np.arange(x.size))
    se = np.atleast_1d(spread_of(exponents, x.size, rng))
    p, q = float(value[0]), float(value[1]) if value.size > 1 else float("nan")
    q_se = float(se[1]) if value.size > 1 else float("nan")
    rate_phrase = f", with rate to the power {q:.2f} ± {q_se:.1g}" if value.size > 1 else ""
    return [
        Signature(
            name="loop energy", port=rows.port, value=p, se=float(se[0]), unit="-",
            sentence=f"The loss per loop by the {WHAT[rows.port]} grows with amplitude to"
            f" the power {p:.2f} ± {se[0]:.1g}{rate_phrase}: {_loop_phrase(p, q)}.",
            details={"amplitude_power": p, "rate_power": q, "rate_power_se": q_se},
        )
    ]  # fmt: skip


def _loop_phrase(p: float, q: float) -> str:
    if np.isnan(q):
        return "one rate only, so dry and viscous loss look alike"
    if p < 1.4 and abs(q) < 0.3:
        return "dry friction (1 and 0)"
    if abs(p - 2.0) < 0.4 and abs(q - 1.0) < 0.3:
        return "viscous (2 and 1)"
    if p > 2.5 and q > 1.5:
        return "drag (3 and 2)"
    if abs(q) < 0.3:
        return "a rate-independent loop (hysteresis)"
    return "between dry and viscous"


def order_signature(rows: PortRows, rng: np.random.Generator) -> list[Signature]:
    """The strongest harmonic of the torque in motor and wheel angle."""
    found = []
    for name, side_name in (("motor_angle_rad", "motor"), ("wheel_angle_rad", "wheel")):
        if name not in rows.signals:
            continue
        angle = rows.signals[name]
        span = min(np.ptp(angle[rows.recording == k]) for k in np.unique(rows.recording))
        orders = ORDERS[ORDERS * span > 4.0 * np.pi]
        if orders.size == 0:
            continue
        residual = _without_motion(rows)
        step = max(1, residual.size // 8000)
        wave = np.exp(-1j * np.outer(orders, angle[::step])) * residual[::step]
        power = np.abs(wave.mean(axis=1)) * 2.0
        best = int(np.argmax(power))
        block = rows.blocks()[::step]
        sums = np.bincount(block, wave[best].real) + 1j * np.bincount(block, wave[best].imag)
        count = np.bincount(block)

        def amplitude(pick: NDArray, sums=sums, count=count) -> float:
            return float(2.0 * abs(sums[pick].sum()) / count[pick].sum())

        se = float(spread_of(amplitude, count.size, rng))
        background = float(np.median(power))
        if power[best] < 4.0 * background:
            continue
        found.append(
            Signature(
                name=f"order of the {side_name}", port=rows.port, value=float(power[best]), se=se,
                unit=unit_of(rows.port),
                sentence=f"The {WHAT[rows.port]} repeats {orders[best]:.0f} times a turn"
                f" of the {side_name}, {power[best]:.3g} ± {se:.1g} {unit_of(rows.port)}.",
                details={"order": float(orders[best]), "background": background},
            )
        )  # fmt: skip
    return found


def _without_motion(rows: PortRows) -> NDArray:
    """The torque less its mean in each direction of motion."""
    sign = np.sign(rows.signals.get(MOTION[OWN_MOTION[rows.port]], np.zeros(rows.torque.size)))
    left = rows.torque.copy()
    for s in (-1.0, 0.0, 1.0):
        if np.any(sign == s):
            left[sign == s] -= left[sign == s].mean()
    return left


STATISTICS = (
    reversal_signature,
    odd_even_signature,
    loop_signature,
    order_signature,
    quadrant_signature,
    band_signature,
    trend_signature,
    lag_signature,
)
