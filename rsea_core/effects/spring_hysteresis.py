"""The spring that remembers: hysteresis by Maxwell slip or Bouc-Wen, and relaxation.

All act in parallel to the elastic law, on the deflection between wheel and load. Before a
simulation the spring has gone once from zero to its first deflection, and has rested there.
"""

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.relevant_size import RelevantSize
from rsea_core.effects.slots import block, slots
from rsea_core.effects.spring_base import NEEDS_SPRING
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, RunConditions, TrialMachine, Unknown, Values
from rsea_core.machine.rig import Rig

N_SLIPS = 6  # elements of a Maxwell-slip hysteresis
BOUC_WEN = slots("bouc_wen_stiffness", internal=True)
BOUC_WEN_YIELD, BOUC_WEN_EXPONENT, BOUC_WEN_SHAPE = slots(
    "bouc_wen_yield", "bouc_wen_exponent", "bouc_wen_shape"
)
SLIP_STIFFNESS = block("slip_stiffness", N_SLIPS, internal=True)
SLIP_YIELD = block("slip_yield", N_SLIPS)


LOOP_AT_rad = 0.15  # where the contract compares loops
CLOSING = 50  # iterations of the secant method for the steady loop, at most
LARGEST_STIFFENING = 20.0  # yields: amplitude up to which the loop of a stiffening law is reported


def slips_of(v: Values) -> list[tuple[float, float]]:
    """Stiffness and yield stretch of each element; `ratio` spaces the yields of all by the first.

    One more after another yields at `ratio` times the stretch of the one before.
    """
    found = []
    for j in range(N_SLIPS):
        if f"stiffness_{j + 1}_Nm_per_rad" in v:
            yield_rad = v.get(f"yield_{j + 1}_rad", v["yield_1_rad"] * v.get("ratio", 1.0) ** j)
            found.append((v[f"stiffness_{j + 1}_Nm_per_rad"], yield_rad))
    return found


def _write_slips(v: Values, d: TrialMachine, w: RunConditions) -> None:
    """Maxwell slip: elements that yield one after another."""
    d.start_remembered = 1.0 - v.get("start_relaxed", 0.0)
    for j, (stiffness, yield_rad) in enumerate(slips_of(v)):
        d.put(SLIP_STIFFNESS + j, stiffness)
        d.put(SLIP_YIELD + j, yield_rad)


def _slip_parameters(v: Values, rig: Rig) -> Values:
    """Elements one by one, however the variant spaces them.

    How a spring came to where a recording begins is the recording's.
    """
    given = {}
    for j, (stiffness, yield_rad) in enumerate(slips_of(v), start=1):
        given[f"stiffness_{j}_Nm_per_rad"], given[f"yield_{j}_rad"] = stiffness, yield_rad
    return given


def _write_bouc_wen(v: Values, d: TrialMachine, w: RunConditions) -> None:
    d.start_remembered = 1.0 - v.get("start_relaxed", 0.0)
    d.put(BOUC_WEN, v["stiffness_Nm_per_rad"])
    d.put(BOUC_WEN_YIELD, v["yield_rad"])
    d.put(BOUC_WEN_EXPONENT, v["exponent"])
    d.put(BOUC_WEN_SHAPE, v.get("shape", 0.5))


def _begun(typical: TypicalMagnitudes) -> tuple[tuple[Unknown, ...], tuple[float, ...]]:
    """What a hysteresis remembers where recordings begin with a bent spring, and its start.

    Nobody knows how it was brought there. A little beyond both ends, so that an end is no bound.
    """
    relaxed = Unknown(name="start_relaxed", unit="-", low=-0.2, high=1.2, scale=0.1, prior=1.0)
    return ((relaxed,), (0.0,)) if typical.begins_deflected else ((), ())


class Hysteresis(Term):
    """What every law of rate-independent hysteresis has in common."""

    effect: ClassVar[str] = "spring-hysteresis"
    port: ClassVar[Port] = Port.SPRING
    adds_stiffness: ClassVar[bool] = True
    headline: ClassVar[str] = "Hysteresis: the spring's torque depends on its past deflection."
    figure_units: ClassVar[Mapping[str, str]] = {"loop_width_Nm": "Nm", "loop_energy_J": "J"}

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """It needs a deflection."""
        return NEEDS_SPRING if rigid else None

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Width at zero deflection and area of the steady loop of +-0.15 rad."""
        width, energy = self.loop(LOOP_AT_rad)
        return {"loop_width_Nm": width, "loop_energy_J": energy}

    @abstractmethod
    def loop(self, amplitude_rad: float) -> tuple[float, float]:
        """Width at zero deflection [Nm] and area [J] of the steady loop of an amplitude."""

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The loop."""
        return (
            f"a torque loop in the spring, {f('loop_width_Nm', 'Nm')} wide and"
            f" {f('loop_energy_J', 'J')} lost over ±{f.of(LOOP_AT_rad, 'rad')}"
        )


def _stiffness(j: int):
    """Parameter: the stiffness of element j; only the first must be there."""
    default = () if j == 1 else (0.0,)
    return parameter(
        *default,
        unit="Nm/rad",
        bounds=(0.0, 1e5),
        source="a fit" if j == 1 else "0: element absent; a fit",
        meaning=f"Stiffness of element {j} while it sticks.",
    )


def _yield(j: int):
    """Parameter: the deflection of element j at which it slips."""
    default = () if j == 1 else (0.05,)
    return parameter(
        *default,
        unit="rad",
        bounds=(1e-4, 1.0),
        source="a fit",
        meaning=f"Deflection at which element {j} slips.",
    )


@dataclass(frozen=True, kw_only=True)
class SpringHysteresis(Hysteresis):
    """Rate-independent loop by up to six springs in series with a dry slider each.

    Element i carries k_i z_i, z_i following the deflection within +-yield_i. Its elastic
    stiffness adds to the spring's.

    Source
    ------
    Iwan, A distributed-element model for hysteresis, J. Appl. Mech. 33 (1966) 893; Maxwell slip:
    Lampaert, Swevers & Al-Bender, IEEE Trans. Autom. Control 47 (2002) 683.
    """

    law: ClassVar[str] = "maxwell-slip"
    relevant: ClassVar = RelevantSize(
        variant="one slip", part="spring",
        size=lambda m: (
            (0.1 * m.rig.spring_stiffness_Nm_per_rad, 0.03),
            "hysteresis of 10 % of the stiffness",
        ),
    )  # fmt: skip

    stiffness_1_Nm_per_rad: float = _stiffness(1)
    yield_1_rad: float = _yield(1)
    stiffness_2_Nm_per_rad: float = _stiffness(2)
    yield_2_rad: float = _yield(2)
    stiffness_3_Nm_per_rad: float = _stiffness(3)
    yield_3_rad: float = _yield(3)
    stiffness_4_Nm_per_rad: float = _stiffness(4)
    yield_4_rad: float = _yield(4)
    stiffness_5_Nm_per_rad: float = _stiffness(5)
    yield_5_rad: float = _yield(5)
    stiffness_6_Nm_per_rad: float = _stiffness(6)
    yield_6_rad: float = _yield(6)

    @property
    def elements(self) -> tuple[tuple[float, float], ...]:
        """Stiffness [Nm/rad] and yield stretch [rad] of the elements that are there."""
        pairs = [
            (getattr(self, f"stiffness_{i}_Nm_per_rad"), getattr(self, f"yield_{i}_rad"))
            for i in range(1, N_SLIPS + 1)
        ]
        return tuple(pair for pair in pairs if pair[0] > 0.0)

    def loop(self, amplitude_rad: float) -> tuple[float, float]:
        """Exact: an element that slips on the way has the loop of a parallelogram."""
        width = energy = 0.0
        for stiffness, limit in self.elements:
            slip = max(amplitude_rad - limit, 0.0)
            width += 2.0 * stiffness * min(limit, slip)
            energy += 4.0 * stiffness * limit * slip
        return width, energy

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Stiffness and yield stretch of every element."""
        found = {}
        for i, (stiffness, limit) in enumerate(self.elements, start=1):
            found |= {
                f"slip_stiffness_{i}": stiffness,
                f"slip_yield_{i}": limit,
                "internal_states": 1.0,
            }
        return found

    def equation(self) -> str:
        elements = ", ".join(f"{k:g} Nm/rad to {y:g} rad" for k, y in self.elements)
        return f"tau_s = f(d) + sum k_i z_i, z_i follows d within +-y_i: {elements or 'none'}"

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """One to six elements."""
        K, d = typical.stiffness, typical.deflection_rad
        low, high = (2e-3 * d, 10.0 * d) if typical.relative else (2e-4, 1.0)
        stiffest = (30.0 if typical.relative else 3.0) * K  # dry friction begins stiff
        elements = [
            (
                Unknown(name=f"stiffness_{j}_Nm_per_rad", unit="Nm/rad", low=0.0, high=stiffest,
                        scale=0.03 * K),
                Unknown(name=f"yield_{j}_rad", unit="rad", low=low, high=high, scale=0.15, log=True,
                        prior=1.0),
            )
            for j in range(1, N_SLIPS + 1)
        ]  # fmt: skip
        begun, at_begin = _begun(typical)
        flat = [unknown for pair in elements for unknown in pair]
        spaced = (
            *(pair[0] for pair in elements),
            elements[0][1],
            Unknown(name="ratio", unit="-", low=1.2, high=8.0, scale=0.1, log=True, prior=0.5),
            *begun,
        )

        def start(shares: Sequence[float], stiffness: float) -> tuple[float, ...]:
            found = tuple(v for share in shares for v in (stiffness / len(shares), share * d))
            return (*found, *at_begin)

        def dry_friction(shares: Sequence[float], torque: float) -> tuple[float, ...]:
            found = (v for share in shares for v in (torque / (len(shares) * share * d), share * d))
            return (*found, *at_begin)

        common = {"effect": cls.effect, "subsystem": "spring", "write": _write_slips, "kind": cls,
                  "parameters": _slip_parameters,
                  "own_form_spread": typical.spread_of_loop(LOOP_AT_rad)}  # fmt: skip
        return (
            Law(law="one slip", unknowns=(*flat[:2], *begun),
                starts=(start((0.1,), 0.05 * K), start((0.5,), 0.1 * K), start((1.5,), 0.1 * K)),
                richer=("two slips", "four slips", "six slips", "bouc-wen"), **common),
            Law(law="two slips", unknowns=(*flat[:4], *begun),
                starts=(start((0.15, 0.8), 0.15 * K), dry_friction((0.06, 0.5), 0.3 * K * d)),
                richer=("four slips", "six slips", "bouc-wen"), **common),
            Law(law="four slips", unknowns=(*flat[:8], *begun),
                starts=(start((0.05, 0.2, 0.6, 1.6), 0.2 * K),
                        start((0.1, 0.35, 0.8, 3.0), 0.1 * K),
                        dry_friction((0.06, 0.2, 0.5, 1.0), 0.3 * K * d)), **common),
            Law(law="six slips", unknowns=spaced,
                starts=((*(0.05 * K,) * 6, 0.02 * d, 2.2, *at_begin),
                        (*(0.02 * K,) * 6, 0.05 * d, 2.0, *at_begin)), **common),
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class SpringBoucWen(Hysteresis):
    """Rate-independent loop by the differential equation of Bouc and Wen.

    z' = d' (1 - |z/y|^n (s + (1 - |s|) sgn(d' z))), torque k z; |z| never exceeds y where the shape
    s is positive, and the loop stiffens without end where it is below -0.5, as in the benchmark
    of Noel & Schoukens (2016): s = delta / (gamma + |delta|), y^-n = beta (gamma + |delta|). With
    a shape up to 0.5 it is passive: unloading gives back no more than was stored.

    Source
    ------
    Ismail, Ikhouane & Rodellar, The hysteresis Bouc-Wen model, a survey, Arch. Comput. Methods
    Eng. 16 (2009) 161; thermodynamic bounds: Erlicher & Point, Comptes Rendus Mecanique 332
    (2004) 51.
    """

    law: ClassVar[str] = "bouc-wen"

    stiffness_Nm_per_rad: float = parameter(
        unit="Nm/rad",
        bounds=(0.0, 1e9),
        source="a fit",
        meaning="Stiffness that hysteresis adds for small deflections.",
    )
    yield_rad: float = parameter(
        unit="rad",
        bounds=(1e-12, 1e9),
        source="a fit",
        meaning="Largest deflection of the hysteretic part; its torque is then largest.",
    )
    exponent: float = parameter(
        1.0,
        unit="-",
        bounds=(1.0, 10.0),
        source="1: the smoothest knee; a fit",
        meaning="How sharply the loop turns from elastic to yielding.",
    )
    shape: float = parameter(
        0.5,
        unit="-",
        bounds=(-0.95, 0.5),
        source="0.5: straight unloading; a fit",
        meaning="Share of the yielding that does not ask for the direction of motion; below 0 the"
        " loop stiffens.",
    )

    def loop(self, amplitude_rad: float) -> tuple[float, float]:
        """By quadrature of the law along the loop until it closes, to 1e-6 of the width."""
        n, s, y = self.exponent, self.shape, self.yield_rad
        if s < -0.5:  # its torque grows exponentially with the amplitude
            amplitude_rad = min(amplitude_rad, LARGEST_STIFFENING * y)
        steps = 200 + int(400.0 * amplitude_rad / y)
        h = amplitude_rad / steps

        def rate(z: float, direction: float) -> float:
            share = abs(z / y) ** n
            return direction * (
                1.0 - share * (s + (1.0 - abs(s)) * math.copysign(1.0, direction * z))
            )

        def walk(z: float, direction: float, count: int) -> np.ndarray:
            found = [z]
            for _ in range(count):
                a = rate(z, direction)
                b = rate(z + 0.5 * h * a, direction)
                c = rate(z + 0.5 * h * b, direction)
                z += h * (a + 2.0 * b + 2.0 * c + rate(z + h * c, direction)) / 6.0
                found.append(z)
            return np.array(found)

        # a small loop needs many cycles to become steady: its tip follows by the secant method
        before = walk(0.0, 1.0, steps)[-1]
        tip = -walk(before, -1.0, 2 * steps)[-1]
        moved = tip - before
        for _ in range(CLOSING):
            further = -walk(tip, -1.0, 2 * steps)[-1] - tip
            if abs(further) <= 1e-12 * abs(tip) or further == moved:
                break
            tip, before = tip - further * (tip - before) / (further - moved), tip
            moved = further
        back = walk(tip, -1.0, 2 * steps)
        forth = -back  # of the deflection with its sign changed
        there = forth[::-1]
        width = 2.0 * abs(back[steps]) * self.stiffness_Nm_per_rad
        area = np.trapezoid(back - there, dx=h) * self.stiffness_Nm_per_rad
        return float(width), float(abs(area))

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The law as compiled code reads it."""
        if self.stiffness_Nm_per_rad == 0.0:
            return {}
        return {
            "bouc_wen_stiffness": self.stiffness_Nm_per_rad,
            "bouc_wen_yield": self.yield_rad,
            "bouc_wen_exponent": self.exponent,
            "bouc_wen_shape": self.shape,
            "internal_states": 1.0,
        }

    def equation(self) -> str:
        return (
            f"tau_s = f(d) + {self.stiffness_Nm_per_rad:g} z, z' = d' (1 -"
            f" |z/{self.yield_rad:g}|^{self.exponent:g} ({self.shape:g} + {1.0 - abs(self.shape):g}"
            " sgn(d' z)))"
        )

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """A smooth loop, which dissipates energy at deflections far below its yield too."""
        K, d = typical.stiffness, typical.deflection_rad
        low, high = (2e-3 * d, 300.0 * d) if typical.relative else (1e-3, 1.0)
        begun, at_begin = _begun(typical)
        unknowns = (
            Unknown(
                name="stiffness_Nm_per_rad", unit="Nm/rad", low=0.0, high=3 * K, scale=0.03 * K
            ),
            Unknown(
                name="yield_rad", unit="rad", low=low, high=high, scale=0.15, log=True, prior=1.0
            ),
            Unknown(name="exponent", unit="-", low=1.0, high=5.0, scale=0.15, log=True, prior=0.5,
                    closed=True),
        )  # fmt: skip
        starts = ((0.1 * K, 0.3 * d, 1.5),)
        if typical.relative:
            shape = Unknown(name="shape", unit="-", low=-0.9, high=0.5, scale=0.2, closed=True)
            unknowns = (*unknowns, shape)
            starts = ((0.1 * K, 0.3 * d, 1.5, 0.5), (0.1 * K, 0.5 * d, 1.0, -0.6),
                      (0.1 * K, 10.0 * d, 1.0, 0.2))  # fmt: skip
        return (
            Law(effect=cls.effect, law="bouc-wen", subsystem="spring", write=_write_bouc_wen,
                richer=("four slips", "six slips"), unknowns=(*unknowns, *begun), kind=cls,
                own_form_spread=typical.spread_of_loop(LOOP_AT_rad),
                parameters=lambda v, rig: {k: x for k, x in v.items() if k != "start_relaxed"},
                starts=tuple((*start, *at_begin) for start in starts)),
        )  # fmt: skip
