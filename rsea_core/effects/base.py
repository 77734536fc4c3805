"""What a physics term is: named parameters with unit, bounds and source, acting at a port.

A term is a frozen dataclass whose fields are its parameters. It knows the port it acts at and
nothing of the model it is put into, so that any combination of terms is a model. Absorbed from
PyBaMM (small submodels that read like their equations, a source per value) and mujoco.sysid
(a parameter carries its bounds).
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields
from enum import Enum
from typing import ClassVar, Protocol

from rsea_core.errors import TermError

SHORTEST_PRESLIDING_rad = 1e-6  # at the output; a shorter stretch is taken as rigid


class Port(Enum):
    """Where in the equations a term acts; name and unit of what it contributes."""

    SPRING = "spring", "Nm"  # torque between wheel and load, positive when it drives the load
    DRIVE = "drive", "duty or V"
    GEAR = "gear", "Nm"  # at the gear output
    LOAD = "load", "Nm"
    ENVIRONMENT = "environment", "Nm"
    SENSOR = "sensor", "of its column"  # the reading, not the machine

    @property
    def unit(self) -> str:
        """Unit of what a term contributes there."""
        return self.value[1]


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One value of a model with what is known about it.

    Attributes
    ----------
    value : float
    unit : str
    bounds : (float, float)
        Closed interval outside which the value makes no sense.
    source : str
        Where the value comes from.
    free : bool
        Whether a fit may move it.
    meaning : str
        What it is, in a sentence.
    """

    value: float
    unit: str
    bounds: tuple[float, float]
    source: str
    free: bool
    meaning: str


@dataclass(frozen=True, kw_only=True)
class Free:
    """How a fit moves a parameter, in shares of a typical magnitude of the machine.

    Attributes
    ----------
    of : str or None
        A magnitude of `typical.TypicalMagnitudes` ("load_torque_Nm"); None: absolute.
    starts : tuple of float
        Values from which a fit starts, the smallest first.
    step : float
        A change that is worth taking; for `log` of the logarithm, absolute.
    low, high : float
        Bounds of a fit.
    prior : float or None
        Standard deviation about zero (about the start for `log`), in the same shares.
    """

    starts: tuple[float, ...]
    step: float
    high: float
    low: float = 0.0
    of: str | None = None
    log: bool = False
    prior: float | None = None


def parameter(
    default=MISSING,
    *,
    unit: str,
    bounds: tuple[float, float],
    source: str,
    meaning: str,
    free: bool = True,
    fit: Free | None = None,
):
    """A dataclass field that is a term's parameter."""
    info = {"unit": unit, "bounds": bounds, "source": source, "free": free, "meaning": meaning}
    return field(default=default, metadata=info | ({} if fit is None else {"fit": fit}))


@dataclass(frozen=True, kw_only=True)
class Context:
    """What a term's comparable figures can depend on beyond its own parameters.

    Attributes
    ----------
    spring_stiffness_Nm_per_rad : float or None
        Tangent of the spring that the term is added to, at zero deflection.
    load_inertia_kgm2 : float or None
    peak_winding_rise_K : float or None
        The hottest that the winding was, over the ambient.
    ambient_C : float or None
        Of the room; None: the effect's own.
    recording : str or None
        The file that a disturbance was found in.
    full_command : float
        The largest command of the drive in the command's own unit: 1 of a duty, the supply of a
        voltage, the current limit of a current; 1 where the rig does not state it.
    """

    spring_stiffness_Nm_per_rad: float | None = None
    load_inertia_kgm2: float | None = None
    peak_winding_rise_K: float | None = None
    ambient_C: float | None = None
    recording: str | None = None
    full_command: float = 1.0

    def need(self, effect: str, name: str):
        """One of the values.

        Raises
        ------
        TermError
            If it is not given.
        """
        value = getattr(self, name)
        if value is None:
            raise TermError(f"{effect}: its comparable figures need {name}")
        return value


NO_CONTEXT = Context()


class Gear(Protocol):
    """What reflects a term's motor-side values to the gear output."""

    ratio: float

    def torque_to_output(self, motor_side: float) -> float:
        """Torque at the output of a lossless gear."""

    def motion_to_output(self, motor_side: float) -> float:
        """Angle or speed at the output."""


class Term(ABC):
    """Base of all terms; subclasses are frozen keyword-only dataclasses.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.

    Class attributes
    ----------------
    effect : str
        Its name; several classes may be laws of one effect.
    law : str
        Name of the law, unique within the effect.
    port : Port
    replaces : str or None
        The rig value whose nominal law it stands in for; None when it adds to the nominal law.
    generalises : str or None
        The effect that this one reduces to if its further values are zero: it is no rival of it.
    in_spring_table : bool
        Whether it is nothing but a change of the spring's elastic law (`on_spring`).
    adds_stiffness : bool
        Whether it acts as a further stiffness parallel to the spring at small deflections.
    headline : str
        What it does to a machine, in one sentence.
    figure_units : mapping
        Units of the figures that are reported of it (`comparable`); "" is the reading's own.
    curve : EffectCurve or None
        How it is drawn; None where a number says it all.
    relevant : RelevantSize or None
        The size at which it would matter, of its first law.
    known_form : str or None
        The variant whose further values stay free where a rig file states the effect's level.
    form_spread : float
        Relative standard deviation of its figures from what recordings rarely show of the effect.
    """

    effect: ClassVar[str]
    port: ClassVar[Port]
    law: ClassVar[str]
    replaces: ClassVar[str | None] = None
    generalises: ClassVar[str | None] = None
    in_spring_table: ClassVar[bool] = False
    adds_stiffness: ClassVar[bool] = False
    headline: ClassVar[str] = ""
    figure_units: ClassVar[Mapping[str, str]] = {}
    curve: ClassVar = None
    relevant: ClassVar = None
    known_form: ClassVar[str | None] = None
    form_spread: ClassVar[float] = 0.0

    def __post_init__(self):
        require_bounds(self)

    @classmethod
    def unchecked(cls, **given):
        """An effect with parameters that may lie outside their bounds, as a fit meets them."""
        made = object.__new__(cls)
        for f in fields(cls):
            value = given.pop(f.name) if f.name in given else f.default
            if value is MISSING:
                raise TermError(f"{cls.effect}: {f.name} is missing")
            object.__setattr__(made, f.name, value)
        if given:
            raise TermError(f"{cls.effect}, {cls.law}: no parameter {', '.join(given)}")
        return made

    @classmethod
    def candidates(cls, typical) -> Sequence:
        """The variants (`variant.Law`) that a diagnosis tries, by `typical.TypicalMagnitudes`."""
        return ()

    @classmethod
    def sentence(cls, f) -> str:
        """What the effect is and how large, from its figures (a `figure_text.FigureText`)."""
        if not cls.headline:
            raise KeyError(cls.effect)
        units = {name: cls.unit_of(name) for name in f.figures}
        sizes = ", ".join(
            name.removesuffix("_" + unit.replace("/", "_per_")).replace("_", " ")
            + f" {f(name, unit)}"
            for name, unit in units.items()
        )
        return f"{cls.headline[:1].lower()}{cls.headline[1:].rstrip('.')}: {sizes}"

    @classmethod
    def unit_of(cls, figure: str) -> str:
        """Unit of a reported figure; "" is the reading's own, "/s" that per second."""
        if figure in cls.figure_units:
            return cls.figure_units[figure]
        return cls.__dataclass_fields__[figure].metadata["unit"]

    @property
    def subsystem(self) -> str:
        """Where it belongs in a diagnosis: the port's name, or sensor:<column>."""
        return self.port.value[0]

    @property
    def key(self) -> str:
        """Its name among the terms of a model: the effect, with the subsystem for a sensor."""
        return self.effect

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """The figures by which this effect is compared with another law of the same effect.

        Where an effect does not say otherwise: the parameters that a fit moves, else those
        that `figure_units` names.

        Raises
        ------
        TermError
            If the context lacks what they need.
        """
        fitted = [f.name for f in fields(self) if "fit" in f.metadata]
        return {name: getattr(self, name) for name in fitted or self.figure_units}

    def rig_numbers(self, rig, gravity: float) -> Mapping[str, float]:
        """More numbers, of the rig that the term acts on (a `Rig`).

        gravity : m/s^2, zero where the load does not feel it.

        Raises
        ------
        RigError, TermError
            If the rig lacks a value, or has one that the term cannot act on.
        """
        return {}

    def parameters(self) -> Mapping[str, Parameter]:
        """The term's parameters by field name."""
        return {
            f.name: Parameter(
                value=getattr(self, f.name), **{k: v for k, v in f.metadata.items() if k != "fit"}
            )
            for f in fields(self)
            if "bounds" in f.metadata
        }

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """What compiled code needs, by the names of `effects.EFFECTS`, at the gear output."""
        return {}

    def on_spring(self, table):
        """The elastic law (a `SpringTable`) with this term in it."""
        return table

    def on_plant(self, plant):
        """The machine's numbers (a `kernel.Plant`) with this term in them."""
        return plant

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """Why this term cannot act on a machine, None if it can.

        `rigid`: wheel and load are one body; `dry`: how many of the model's joints are dry.
        """
        return None

    @abstractmethod
    def equation(self) -> str:
        """The law in one line, as `ActuatorModel.describe` prints it."""


def require_bounds(term: Term) -> None:
    """Check every parameter of a term against its bounds.

    Raises
    ------
    TermError
        Naming effect, parameter, value, bounds and unit of the first one outside.
    """
    for name, info in term.parameters().items():
        low, high = info.bounds
        inside = isinstance(info.value, int | float) and low <= info.value <= high
        if not inside or not math.isfinite(info.value):
            unit = "" if info.unit == "-" else f" {info.unit}"
            raise TermError(
                f"{term.effect}: {name} = {info.value} is outside [{low}, {high}]{unit}"
            )
