"""The size at which an effect would matter on a machine, whatever recordings of it show.

Sizes follow from what the rig is, not from how far recordings went: small motions must not make
small effects matter.
"""

from collections.abc import Callable
from dataclasses import dataclass

from rsea_core.machine.rig import Rig


@dataclass(frozen=True, kw_only=True)
class MachineSize:
    """What such sizes are measured by.

    Attributes
    ----------
    rig : Rig
    torque_Nm : float
        Of the spring at the deflection at which springs are compared; without a spring the rated
        torque at the gear output.
    load_torque_Nm : float
        Of gravity on the load; without it a tenth of `torque_Nm`.
    commands, loads : frozenset of str
        What drives the recordings, and the kinds of their loads.
    """

    rig: Rig
    torque_Nm: float
    load_torque_Nm: float
    commands: frozenset[str | None]
    loads: frozenset[str]

    @property
    def motor_torque_Nm(self) -> float:
        """`torque_Nm` at the motor."""
        return self.torque_Nm / (self.rig.gear_ratio or 1.0)


def sized(value: float, text: str) -> tuple[tuple[float, ...], str]:
    """A size of one value and it as text, `text` with the value's place."""
    return (value,), text.format(value)


@dataclass(frozen=True, kw_only=True)
class RelevantSize:
    """The size of one variant of an effect that would matter.

    Attributes
    ----------
    variant : str
        Its law; "*" the first of those that differ in a number only.
    part : str
        Of the rig, without which the effect cannot be; "contact": a load of that kind.
    size : function of a MachineSize
        The first values of the variant, and they as text.
    commands : frozenset of str
        One of which must drive a recording; empty: anything may.
    """

    variant: str
    part: str
    size: Callable[[MachineSize], tuple[tuple[float, ...], str]]
    commands: frozenset[str] = frozenset()

    def acts_on(self, machine: MachineSize) -> bool:
        """Whether the machine has what the effect needs."""
        rig = machine.rig
        has = "contact" in machine.loads if self.part == "contact" else rig.has(self.part)
        if self.part == "spring":
            has = has and bool(rig.spring_stiffness_Nm_per_rad)
        return has and (not self.commands or bool(self.commands & machine.commands))
