"""Models as the fixed-step engine reads them: numbers, packed for many models, and their steps."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import rsea_core.machine.plant as mp
from rsea_core.engines.fixed_step.layout import BENCH, Models
from rsea_core.engines.fixed_step.step_length import DEFAULT_STEP_s, longest_step_s
from rsea_core.errors import InputError
from rsea_core.machine.inputs import Load
from rsea_core.model.actuator_model import ActuatorModel

MAX_STEPS = 2_000_000_000


class Numbers(NamedTuple):
    """A model as the fixed-step engine reads it for one command and load.

    plant : (24,) array, the fields of `Plant` in their order
    spring : (r, 6) array, `SpringTable.regions`
    fx : (N_EFFECTS,) array, `effects.layout.EFFECTS`
    """

    plant: NDArray
    spring: NDArray
    fx: NDArray

    def with_plant(self, **values: float) -> "Numbers":
        """These numbers with other values of the named `Plant` fields."""
        plant = self.plant.copy()
        for name, value in values.items():
            plant[mp.Plant._fields.index(name)] = value
        return self._replace(plant=plant)


def model_numbers(model: ActuatorModel, command_name: str | None, load: Load) -> Numbers:
    """A model's numbers under a command and a load.

    Raises
    ------
    RigError, TermError, InputError
        As `ActuatorModel.plant` and `ActuatorModel.effects`.
    """
    return Numbers(
        np.array(model.plant(command_name, load), dtype=float),
        model.spring_table(load).regions,
        model.effects(command_name, load),
    )


def bench_numbers(model: ActuatorModel, load: Load) -> Numbers:
    """The numbers of a spring alone whose deflection is given.

    Raises
    ------
    RigError, TermError
        As `ActuatorModel.spring_table` and `ActuatorModel.effects`.
    """
    idle = dict.fromkeys(mp.Plant._fields, 0.0) | {"contact_angle": np.inf, "current_limit": np.inf}
    plant = mp.Plant(**idle)._replace(drive=mp.NO_DRIVE, structure=BENCH, gear_ratio=1.0)
    table = model.spring_table(load).regions
    return Numbers(np.array(plant, dtype=float), table, model.effects(None, load))


def packed_models(numbers: Sequence[Numbers]) -> Models:
    """Numbers of several models as the arrays that the compiled code reads.

    Raises
    ------
    InputError
        If there are none.
    """
    if not numbers:
        raise InputError("give at least one model")
    return Models(
        plants=np.array([each.plant for each in numbers]),
        springs=np.concatenate([each.spring for each in numbers]),
        ends=np.cumsum([len(each.spring) for each in numbers]),
        fx=np.array([each.fx for each in numbers]),
    )


class Grid:
    """The steps within each row of a run.

    Raises
    ------
    InputError
        If step_s is not above zero.
    """

    def __init__(self, time_s: NDArray, step_s: float | None):
        if step_s is not None and not step_s > 0.0:
            raise InputError(f"step_s = {step_s} must be above 0")
        self._rows_s = np.diff(time_s, append=2.0 * time_s[-1] - time_s[-2])
        self._step_s = step_s
        self._known: dict[float, NDArray] = {}

    def steps(self, models: Models) -> NDArray:
        """Steps within each row, (n,) of int; without a given step those that models need.

        Raises
        ------
        InputError
            If there are more than can be run.
        """
        longest = self._step_s
        if longest is None:
            springs = np.split(models.springs, models.ends[:-1])
            longest = min(map(longest_step_s, models.plants, springs, models.fx))
            longest = DEFAULT_STEP_s * 2.0 ** np.floor(np.log2(longest / DEFAULT_STEP_s))
        if longest not in self._known:
            steps = np.maximum(np.ceil(self._rows_s / longest - 1e-9), 1.0)
            if not steps.sum() <= MAX_STEPS:
                raise InputError(
                    f"{steps.sum():.3g} steps of {longest:.3g} s are more than {MAX_STEPS:.0e}:"
                    " shorten the run or leave the fastest mode out of the model"
                )
            self._known[longest] = steps.astype(np.int64)
        return self._known[longest]
