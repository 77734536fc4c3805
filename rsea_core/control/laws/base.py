"""What a controller is: numbers, a sample time, and one compiled function.

A controller acts at its own sample time, reads encoders, and its command is held until it acts
again. `compile` packs it for one machine into the form that the compiled loop calls, so that a
new controller costs one small compilation and no change of the loop. Names follow
python-control: a sampled system with state, input and output.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Any, ClassVar

from numpy.typing import NDArray

import rsea_core.machine.plant as mp
from rsea_core.errors import ControllerError
from rsea_core.machine.inputs import Load
from rsea_core.model.actuator_model import ActuatorModel


@dataclass(frozen=True, kw_only=True)
class CompiledController:
    """A controller made ready for one machine and load.

    Attributes
    ----------
    function : compiled function with the signature `kernel.CONTROLLER`
    parameters : (p,) array
    state : (s,) array
        Before the first sample; all zero means "has not acted yet".
    command_name : str
        The column that it writes: "duty", "voltage_V", "current_command_A", "motor_torque_Nm".
    command_limit : float
        Largest magnitude of the command.
    """

    function: Any
    parameters: NDArray
    state: NDArray
    command_name: str
    command_limit: float


class Controller(ABC):
    """Base of all controllers; subclasses are frozen keyword-only dataclasses.

    Attributes
    ----------
    sample_time_s : float
        Time between two actions.
    delay_samples : int
        0, or 1 where the computation takes until the next sample.
    kind : str
        Its name, unique in the registry `CONTROLLERS`.
    reference_name : str
        Column of what it follows, with the unit.
    gain_varies : bool
        True for a law whose gain depends on the amplitude (a fuzzy table): its linear loop at
        rest says nothing of larger swings, so that describing function and simulation judge it.
    """

    kind: ClassVar[str]
    reference_name: ClassVar[str]
    gain_varies: ClassVar[bool] = False
    sample_time_s: float
    delay_samples: int

    @property
    def has_gain_at_rest(self) -> bool:
        """False for a law whose slope at zero error is infinite (a power below 1, a relay).

        Its loop has no linear analysis there, only one at a stated amplitude.
        """
        return True

    @abstractmethod
    def compile(self, model: ActuatorModel, load: Load) -> CompiledController:
        """The controller in the form that the compiled loop calls.

        Raises
        ------
        RseaError
            If the machine lacks a value that the law needs.
        """


RANGES = {
    "finite and not negative": lambda value: 0.0 <= value < math.inf,
    "finite and above 0": lambda value: 0.0 < value < math.inf,
    "in 0..1": lambda value: 0.0 <= value <= 1.0,
}


def require_values(controller: Controller, names: Iterable[str], what: str) -> None:
    """Check that fields of a controller are within one of `RANGES`.

    Raises
    ------
    ControllerError
        Naming the first one that is not.
    """
    for name in names:
        value = getattr(controller, name)
        if not RANGES[what](value):
            raise ControllerError(f"{controller.kind}: {name} = {value} must be {what}")


def require_choices(controller: Controller, **known: Collection[str]) -> None:
    """Check that fields of a controller are among the known names.

    Raises
    ------
    ControllerError
        Naming the first one that is not.
    """
    for name, choices in known.items():
        value = getattr(controller, name)
        if value not in choices:
            raise ControllerError(
                f"{controller.kind}: {name} = {value!r} must be one of {', '.join(choices)}"
            )


def plant_with_spring(
    controller: Controller, model: ActuatorModel, command_name: str, load: Load
) -> mp.Plant:
    """The machine, whose spring measures the torque.

    Raises
    ------
    ControllerError
        If wheel and load are rigidly joined, so that there is no torque to measure.
    RigError
        If the rig lacks a value that the law needs.
    """
    plant = model.plant(command_name, load)
    if plant.structure not in (mp.ELASTIC_FREE, mp.ELASTIC_HELD):
        raise ControllerError(
            f"{controller.kind}: rig {model.rig.name!r} with the load {load.kind!r} has no spring"
            " between wheel and load whose deflection would measure the torque"
        )
    return plant


def require_sampling(controller: Controller) -> None:
    """Check a controller's sample time and delay.

    Raises
    ------
    ControllerError
        If the sample time is not positive or the delay is not 0 or 1 samples.
    """
    if not controller.sample_time_s > 0.0:
        raise ControllerError(f"sample_time_s = {controller.sample_time_s} must be above 0")
    if controller.delay_samples not in (0, 1):
        raise ControllerError(f"delay_samples = {controller.delay_samples} must be 0 or 1")
