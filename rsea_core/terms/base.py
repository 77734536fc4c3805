"""What a physics term is: named parameters with unit, bounds and source, acting at a port.

A term is a frozen dataclass whose fields are its parameters. It knows the port it acts at and
nothing of the model it is put into, so that any combination of terms is a model. Absorbed from
PyBaMM (small submodels that read like their equations, a source per value) and mujoco.sysid
(a parameter carries its bounds).
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from enum import Enum
from typing import ClassVar, Protocol

from rsea_core.errors import TermError


class Port(Enum):
    """Where in the equations a term acts; name and unit of what it contributes."""

    SPRING = "spring", "Nm"  # torque between wheel and load, positive when it drives the load
    DRIVE = "drive", "duty or V"
    GEAR = "gear", "Nm"  # at the gear output
    LOAD = "load", "Nm"
    ENVIRONMENT = "environment", "Nm"

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
    """

    value: float
    unit: str
    bounds: tuple[float, float]
    source: str
    free: bool


def parameter(
    default=MISSING, *, unit: str, bounds: tuple[float, float], source: str = "", free: bool = True
):
    """A dataclass field that is a term's parameter."""
    info = {"unit": unit, "bounds": bounds, "source": source, "free": free}
    return field(default=default, metadata=info)


class Gear(Protocol):
    """What reflects a term's motor-side values to the gear output."""

    ratio: float

    def torque_to_output(self, motor_side: float) -> float:
        """Torque at the output of a lossless gear."""

    def motion_to_output(self, motor_side: float) -> float:
        """Angle or speed at the output."""


class Term(ABC):
    """Base of all terms; subclasses are frozen keyword-only dataclasses.

    Class attributes
    ----------------
    effect : str
        Its name, unique in the registry `TERMS`.
    port : Port
    replaces : str or None
        The rig value whose nominal law it stands in for; None when it adds to the nominal law.
    """

    effect: ClassVar[str]
    port: ClassVar[Port]
    replaces: ClassVar[str | None] = None

    def parameters(self) -> Mapping[str, Parameter]:
        """The term's parameters by field name."""
        return {
            f.name: Parameter(value=getattr(self, f.name), **f.metadata)
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
            raise TermError(
                f"{term.effect}: {name} = {info.value} is outside [{low}, {high}] {info.unit}"
            )
