"""An effect and how large it is, in words that somebody who has not read the contract knows.

The figures are the comparable ones (`comparable`); the contract's name stays beside the words.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from rsea_core.identify.candidates.figures import LOOP_rad

Figure = float | str

READINGS = {
    "motor_angle_rad": "motor angle",
    "load_angle_rad": "load angle",
    "motor_velocity_rad_per_s": "motor speed",
    "load_velocity_rad_per_s": "load speed",
    "spring_deflection_rad": "spring deflection",
    "current_A": "current",
    "torque_Nm": "torque",
    "temperature_C": "temperature",
    "supply_V": "supply voltage",
}
SCALED = ((1e-9, 1e-4, 1e6, "µ"), (1e-4, 0.1, 1e3, "m"))
PREFIXED = ("Nm", "rad", "N", "m", "s", "A", "J")
LINEAR = {"Nm": "N", "rad": "m", "Nm/rad": "N/m"}


def amount(value: float, unit: str, *, linear: bool = False) -> str:
    """A value with its unit, small ones in thousandths or millionths.

    Parameters
    ----------
    linear : bool
        Whether the machine is written with 1 m as 1 rad and 1 N as 1 Nm.
    """
    unit = LINEAR.get(unit, unit) if linear else unit
    if unit in PREFIXED:
        for least, below, factor, prefix in SCALED:
            if least <= abs(value) < below * (1.0 - 1e-9):
                return f"{value * factor:.3g} {prefix}{unit}"
    return f"{value:.3g} {unit}"


@dataclass(frozen=True)
class _Said:
    """Figures of an effect, and how to say them."""

    figures: Mapping[str, Figure]
    column: str
    linear: bool

    def __call__(self, name: str, unit: str) -> str:
        return self.of(self.figures[name], unit)

    def of(self, value: float, unit: str) -> str:
        return amount(value, unit, linear=self.linear)

    def percent(self, value: float) -> str:
        return f"{100.0 * value:.3g} %"

    @property
    def reading(self) -> str:
        return READINGS.get(self.column, self.column)

    @property
    def unit(self) -> str:
        """Of the reading; a difference of temperatures is one in K."""
        unit = self.column.rpartition("_")[2]
        return {"s": "rad/s", "C": "K"}.get(unit, unit)


def effect_words(
    effect: str, subsystem: str, figures: Mapping[str, Figure], *, linear: bool = False
) -> str | None:
    """What an effect is and how large; None where the figures do not say it.

    Parameters
    ----------
    subsystem : str
        As in the contract: "gear", "sensor:torque_Nm".
    figures : mapping
        Comparable figures by their names, SI units and radians.
    linear : bool
        As in `amount`.
    """
    write = WORDS.get(effect)
    if write is None:
        return None
    try:
        return write(_Said(figures, subsystem.partition(":")[2], linear))
    except KeyError:
        return None


def _saturation(f: _Said) -> str:
    if "current_limit_A" in f.figures:
        return f"a current limit of {f('current_limit_A', 'A')}"
    return f"a supply that sags as if behind {f('source_resistance_ohm', 'ohm')}"


def _transmission(f: _Said) -> str:
    turns = {"wheel_amplitude_rad": "wheel", "worm_amplitude_rad": "worm"}
    parts = [f"{f(name, 'rad')} a turn of the {turn}" for name, turn in turns.items()
             if name in f.figures]  # fmt: skip
    if not parts:
        raise KeyError("amplitude")
    return "a position error of the gear of " + " and ".join(parts)


def _hardening(f: _Said) -> str:
    ratio = f.figures["stiffness_ratio_at_0p15rad"]
    way = "softer" if ratio < 1.0 else "stiffer"
    return f"a spring that is {way} at {f.of(LOOP_rad, 'rad')}, {ratio:.3g} times as stiff as at 0"


def _disturbance(f: _Said) -> str:
    start, end = (f"{f.figures[name]:.4g}" for name in ("start_s", "end_s"))
    return (
        f"an outside torque of {f('peak_Nm', 'Nm')} at its peak on the load, {start} to {end} s"
        f" in {f.figures['recording']}"
    )


def _efficiencies(f: _Said) -> str:
    back = f.figures["backdrive_efficiency"]
    driven = f"{f.percent(back)} driven back" if back > 0.0 else "driven back it locks"
    drive = f.percent(f.figures["drive_efficiency"])
    return f"friction in the gear that grows with its load: efficiency {drive} driving, {driven}"


def _side(value: float) -> str:
    return "small" if value < 0.0 else "large"


def _scale(f: _Said) -> str:
    off = f.figures["scale"] - 1.0
    return f"a {f.reading} that reads {f.percent(abs(off))} too {_side(off)}"


def _offset(f: _Said) -> str:
    off = f.figures["offset"]
    return f"a {f.reading} that reads {f.of(abs(off), f.unit)} too {_side(off)}"


WORDS: Mapping[str, Callable[[_Said], str]] = {
    "gear-friction": lambda f: f"dry friction in the gear, {f('coulomb_Nm', 'Nm')} at the motor",
    "gear-load-friction": _efficiencies,
    "gear-backlash": lambda f: f"play in the gear, {f('width_rad', 'rad')} at the wheel",
    "gear-transmission-error": _transmission,
    "motor-cogging": lambda f: (
        f"cogging of {f('amplitude_Nm', 'Nm')} at the motor,"
        f" {f.figures['cycles_per_rev']:.0f} times a turn"
    ),
    "drive-dead-zone": lambda f: (
        f"a drive that gives nothing below {f.percent(f.figures['width_duty'])} duty"
    ),
    "drive-saturation": _saturation,
    "drive-thermal": lambda f: (
        f"a winding that warms to {f.figures['peak_winding_C']:.3g} °C,"
        f" its resistance up by {f.percent(f.figures['resistance_rise_fraction'])}"
    ),
    "drive-delay": lambda f: f"a command that acts {f('delay_s', 's')} late",
    "spring-hysteresis": lambda f: (
        f"a torque loop in the spring, {f('loop_width_Nm', 'Nm')} wide and"
        f" {f('loop_energy_J', 'J')} lost over ±{f.of(LOOP_rad, 'rad')}"
    ),
    "spring-hardening": _hardening,
    "spring-contact": lambda f: (
        f"coils of the spring that touch from {f('onset_rad', 'rad')} on, {f('onset_Nm', 'Nm')}"
    ),
    "spring-viscoelastic": lambda f: (
        "a spring that relaxes, at once"
        f" {f.figures['stiffness_rise_fast_over_static']:.4g} times as stiff as held"
    ),
    "spring-parallel": lambda f: (
        f"a second spring at the load, {f('stiffness_Nm_per_rad', 'Nm/rad')}"
    ),
    "load-friction": lambda f: f"dry friction in the load's joint, {f('coulomb_Nm', 'Nm')}",
    "load-drag": lambda f: (
        "drag on the load that grows faster than its speed,"
        f" {f('torque_at_5_rad_per_s_Nm', 'Nm')} at {f.of(5.0, 'rad')}/s"
    ),
    "load-unbalance": lambda f: (
        f"a weight at the load that the rig file does not name, {f('torque_amplitude_Nm', 'Nm')}"
    ),
    "load-flexibility": lambda f: (
        f"a link that bends, {f.figures['free_link_frequency_Hz']:.3g} Hz where it is free"
    ),
    "load-disturbance": _disturbance,
    "contact-nonlinear": lambda f: (
        f"a contact whose force grows with its depth to the power {f.figures['exponent']:.3g}"
    ),
    "sensor-offset": _offset,
    "sensor-scale": _scale,
    "sensor-delay": lambda f: f"a {f.reading} that is read {f('delay_s', 's')} late",
    "sensor-drift": lambda f: (
        f"a {f.reading} whose zero drifts by {f.of(f.figures['rate_per_s'], f.unit)} a second"
    ),
}
