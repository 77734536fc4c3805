"""Numbers as a person reads them: sensible digits, true minus signs, mm, degrees and MPa."""

import math

NOTHING = "–"
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_HUMAN = {"m": ("mm", 1e3), "Pa": ("MPa", 1e-6), "1": ("", 1.0)}


def plain(value: float | None, digits: int = 4) -> str:
    """A number with so many significant digits, never more than its size calls for."""
    if value is None or not math.isfinite(value):
        return NOTHING
    if value == 0:
        return "0"
    power = math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    if not -4 <= power < 7:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        return f"{minus(mantissa)} × 10{str(int(exponent)).translate(_RAISED)}"
    return minus(f"{value:.{max(0, digits - 1 - power)}f}")


def signed(value: float | None, digits: int = 4) -> str:
    """As `plain`, with a plus sign in front of what is positive."""
    text = plain(value, digits)
    return f"+{text}" if value is not None and value > 0 and text != NOTHING else text


def fixed(value: float, places: int) -> str:
    """A signed number to so many decimals; what rounds to zero has no sign."""
    text = f"{value:+.{places}f}"
    return text[1:] if float(text) == 0 else minus(text)


def with_uncertainty(value: float, uncertainty: float) -> str:
    """Value ± uncertainty: two digits of the uncertainty, the value to the same place."""
    if not (math.isfinite(uncertainty) and uncertainty > 0):
        return plain(value)
    places = 1 - math.floor(math.log10(uncertainty))
    power = math.floor(math.log10(max(abs(value), uncertainty)))
    if power >= -4:  # as `plain`
        places = max(0, places)
        return minus(f"{value:.{places}f} ± {uncertainty:.{places}f}")
    scale = 10.0**power
    inner = minus(f"{value / scale:.{places + power}f} ± {uncertainty / scale:.{places + power}f}")
    return f"({inner}) × 10{str(power).translate(_RAISED)}"


_UNITS = {
    "Nm": "Nm", "rad": "rad", "deg": "°", "A": "A", "s": "s", "Hz": "Hz", "dB": "dB", "N": "N",
    "V": "V", "W": "W", "J": "J", "percent": "%", "rad_per_s": "rad/s", "Nm_per_rad": "Nm/rad",
    "Nms_per_rad": "Nms/rad", "mm": "mm", "C": "°C", "K": "K",
    "ohm": "ohm", "H": "H", "kg_m2": "kg m²", "Vs_per_rad": "Vs/rad", "Nm_per_A": "Nm/A",
}  # fmt: skip
_PHRASES = {
    "rmse": "error, root mean square", "rms": "root mean square", "from": "judged from",
    "random mean": "error of perturbed machines, mean",
}  # fmt: skip


def readable(key: str) -> tuple[str, str]:
    """A field's name as words and its unit: "peak_error_Nm" is ("peak error", "Nm")."""
    unit = max((u for u in _UNITS if key.endswith(f"_{u}")), key=len, default="")
    text = (key[: -len(unit) - 1] if unit else key).replace("_", " ")
    return _PHRASES.get(text, text.replace(" rms", ", root mean square")), _UNITS.get(unit, "")


def percent(ratio: float, digits: int = 2) -> str:
    """A signed relative difference in percent."""
    return f"{signed(100 * ratio, digits)} %"


def seconds(value: float | None) -> str:
    """A duration: milliseconds, seconds or minutes."""
    if value is None or not math.isfinite(value):
        return NOTHING
    if value < 1:
        return f"{1e3 * value:.3g} ms"
    return f"{value:.3g} s" if value < 100 else f"{value / 60:.1f} min"


def human(value: float | None, unit: str) -> tuple[str, str]:
    """A number of SI and its unit at the human edge: mm for m, MPa for Pa, degrees beside rad."""
    new_unit, factor = _HUMAN.get(unit, (unit, 1.0))
    if value is None or not math.isfinite(value):
        return NOTHING, new_unit
    text = plain(value * factor)
    if unit == "rad":
        text += f" ({plain(math.degrees(value), 3)}°)"
    return text, new_unit


def kilobytes(size: int) -> str:
    """Size of a file."""
    text = f"{size / 1e6:.2f} MB" if size >= 1e6 else f"{max(size / 1e3, 0.1):.1f} kB"
    return text.replace(" ", "\u00a0")


def minus(text: str) -> str:
    """Hyphens that are signs as minus signs."""
    return text.replace("-", "−")
