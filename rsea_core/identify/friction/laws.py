"""Friction laws of the thesis' chapter 3 and what it leaves out, as columns that are fitted.

Speeds are the motor's; f_b of the thesis (Table 3.1, 0.0139) is read at the output. Its unit is
printed as Nm and can only be s/rad or s/deg: both readings are here, and the law with f_b free.

    ncfm       f_o + f_v w
    lfm        f_o + f_v w + f_c s               s = sgn w; with a known link also C_i |N| s (3.6)
    nlfm       f_o + f_c s + f_v w + f_a atan(f_b w)                                         (3.7)
    stribeck   f_o + f_v w + s (f_c + f_s exp(-|w/w_s|^delta))                               (3.1)
    worm       f_o + f_v w + s (f_c + mu_drive |tau|_drive + mu_back |tau|_back)
    worm-stribeck: both

tau is what passes through the gear: driven where it opposes the motion, back-driven where it
helps (actuator specification 1.3). The two worm laws trust the link's inertia and gravity, whose
corrections would be the same columns. f_o has no physical reason at rest and counts as an offset.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.friction.data import FrictionData

PRINTED_F_B = 1.3905e-2  # thesis Table 3.1


@dataclass(frozen=True, kw_only=True)
class FrictionLaw:
    """A law: linear coefficients on columns that may depend on a few nonlinear parameters.

    Attributes
    ----------
    name, note : str
    columns : function (data, nonlinear values) -> mapping of coefficient name -> column
    nonlinear : mapping of name -> (start, lowest, highest)
    units : mapping of parameter name -> unit
    """

    name: str
    note: str
    columns: Callable[[FrictionData, Mapping[str, float]], Mapping[str, NDArray]]
    nonlinear: Mapping[str, tuple[float, float, float]]


UNITS = {
    "f_o": "Nm",
    "f_c": "Nm",
    "f_v": "Nms/rad",
    "f_a": "Nm",
    "f_s": "Nm",
    "f_b": "s/rad",
    "C_i": "m",
    "mu_drive": "-",
    "mu_back": "-",
    "w_s": "rad/s",
    "delta": "-",
    "inertia_correction": "kg m^2",
    "gravity_correction": "Nm",
}


def laws(data: FrictionData) -> tuple[FrictionLaw, ...]:
    """Every law that these rows can be asked about."""
    fastest = float(np.abs(data.speed_rad_per_s).max())
    slowest = float(np.quantile(np.abs(data.speed_rad_per_s), 0.02))
    ratio = data.gear_ratio
    f_b = {"f_b": (3.0 / fastest, 0.3 / fastest, 30.0 / max(slowest, fastest * 1e-3))}
    stribeck = {"w_s": (0.1 * fastest, 0.5 * slowest, fastest), "delta": (1.0, 0.3, 2.0)}
    found = [
        FrictionLaw(name="ncfm", note="viscous alone", columns=_ncfm, nonlinear={}),
        FrictionLaw(name="lfm", note="viscous and Coulomb", columns=_lfm, nonlinear={}),
        FrictionLaw(
            name="nlfm-rad",
            note="f_b = 0.0139 s/rad as printed",
            columns=_nlfm(PRINTED_F_B / ratio),
            nonlinear={},
        ),
        FrictionLaw(
            name="nlfm-deg",
            note="f_b = 0.0139 s/deg",
            columns=_nlfm(np.rad2deg(PRINTED_F_B) / ratio),
            nonlinear={},
        ),
        FrictionLaw(name="nlfm-free", note="f_b fitted", columns=_nlfm(None), nonlinear=f_b),
        FrictionLaw(name="stribeck", note="generalised", columns=_stribeck, nonlinear=stribeck),
    ]
    if np.abs(data.load_Nm).max() > 0.0:
        found += [
            FrictionLaw(name="worm", note="grows with load", columns=_worm, nonlinear={}),
            FrictionLaw(
                name="worm-stribeck",
                note="grows with load, with a Stribeck peak",
                columns=_worm_stribeck,
                nonlinear=stribeck,
            ),
        ]
    return tuple(found)


def _base(data: FrictionData) -> dict[str, NDArray]:
    w = data.speed_rad_per_s
    return {"f_o": np.ones(w.size), "f_v": w, **data.corrections}


def _ncfm(data: FrictionData, free: Mapping[str, float]) -> Mapping[str, NDArray]:
    return _base(data)


def _lfm(data: FrictionData, free: Mapping[str, float]) -> Mapping[str, NDArray]:
    sign = np.sign(data.speed_rad_per_s)
    found = _base(data) | {"f_c": sign}
    if data.normal_N is not None:
        found["C_i"] = sign * data.normal_N
    return found


def _nlfm(f_b: float | None):
    def columns(data: FrictionData, free: Mapping[str, float]) -> Mapping[str, NDArray]:
        w, slope = data.speed_rad_per_s, free["f_b"] if f_b is None else f_b
        return _base(data) | {"f_c": np.sign(w), "f_a": np.arctan(slope * w)}

    return columns


def _stribeck(data: FrictionData, free: Mapping[str, float]) -> Mapping[str, NDArray]:
    w = data.speed_rad_per_s
    peak = np.sign(w) * np.exp(-(np.abs(w / free["w_s"]) ** free["delta"]))
    return _base(data) | {"f_c": np.sign(w), "f_s": peak}


def _worm(data: FrictionData, free: Mapping[str, float]) -> Mapping[str, NDArray]:
    sign = np.sign(data.speed_rad_per_s)
    driven = sign * data.load_Nm > 0.0
    passing = sign * np.abs(data.load_Nm)
    return {
        "f_o": np.ones(sign.size),
        "f_v": data.speed_rad_per_s,
        "f_c": sign,
        "mu_drive": np.where(driven, passing, 0.0),
        "mu_back": np.where(driven, 0.0, passing),
    }


def _worm_stribeck(data: FrictionData, free: Mapping[str, float]) -> Mapping[str, NDArray]:
    return {**_worm(data, free), "f_s": _stribeck(data, free)["f_s"]}
