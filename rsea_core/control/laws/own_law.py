"""A law of one's own: a plain Python class or function as a controller like any other.

    @rsea_core.controller(sample_time_s=1e-3)
    class MyLaw:
        kp: float = 60.0                    # numbers: TOML sets them, `tune` searches them
        ki: float = 10.0
        state = {"integral": 0.0}           # what it remembers from sample to sample

        def design(self, machine):          # optional: numbers from what is known of the machine
            return {"scale": machine.command_per_Nm}

        def step(self, y):                  # once a sample; `y` has SIGNALS
            error = y.reference - y.torque_Nm
            self.integral += self.ki * 1e-3 * error
            return self.scale * (self.kp * error + self.integral)

The command is limited outside. The law is compiled by numba where it can be, else it is called
in Python, to the same digits; `simulate`, `compare`, `tune` and `loop_margins` take either. A
function `law(y, kp=60.0)` is a law without state. TOML: `kind = "my_module:MyLaw"`.
"""

import ctypes
import dataclasses
import importlib
import importlib.util
import inspect
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
from numba import cfunc, njit
from numba.core.errors import NumbaError

import rsea_core.control.laws.own_law_source as source
import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
from rsea_core.control.laws.base import CompiledController, Controller, require_sampling
from rsea_core.control.laws.torque_loop import command_scale
from rsea_core.errors import ControllerError
from rsea_core.machine.inputs import COMMANDS, Load
from rsea_core.machine.spring_table import spring_tangent_Nm_per_rad, table_torque
from rsea_core.model.actuator_model import ActuatorModel

FOLLOWS = {"torque": "reference_torque_Nm", "angle": "reference_angle_rad"}
RESERVED = ("sample_time_s", "delay_samples", "command_name")
BASE = ("kind", "reference_name", "law", "states", "compile", "state", "interpreted", "problems")


@dataclass(frozen=True, kw_only=True)
class KnownMachine:
    """What `design` is given: the machine that the controller is made for, at the gear's output.

    Attributes
    ----------
    model, load : ActuatorModel, Load
    gear_ratio, inertia_kgm2, damping_Nms_per_rad, stiffness_Nm_per_rad : float
        The stiffness is the spring's tangent at rest.
    command_per_Nm, command_per_rad_per_s, command_limit : float
        What a torque at the output takes of the command, and what a speed (back-EMF).
    sample_time_s : float
    """

    model: ActuatorModel
    load: Load
    gear_ratio: float
    inertia_kgm2: float
    damping_Nms_per_rad: float
    stiffness_Nm_per_rad: float
    command_per_Nm: float
    command_per_rad_per_s: float
    command_limit: float
    sample_time_s: float


class OwnLaw(Controller):
    """Base of what `controller` makes.

    Attributes
    ----------
    law : class or function
        As it was written.
    interpreted : dict
        Why a law is called in Python, by its `kind`; empty where all are compiled.
    """

    law: ClassVar
    states: ClassVar[dict[str, float]]
    interpreted: ClassVar[dict[str, str]] = {}
    problems: ClassVar[list[Exception]] = []

    def __post_init__(self):
        require_sampling(self)
        if self.command_name not in COMMANDS:
            raise ControllerError(
                f"{self.kind}: command_name = {self.command_name!r} must be one of"
                f" {', '.join(COMMANDS)}"
            )
        for name in self.parameter_names():
            if not np.isfinite(getattr(self, name)):
                raise ControllerError(f"{self.kind}: {name} = {getattr(self, name)} is not finite")

    @classmethod
    def parameter_names(cls) -> tuple[str, ...]:
        """Fields of the law itself."""
        return tuple(f.name for f in dataclasses.fields(cls) if f.name not in RESERVED)

    def constants(self, machine: KnownMachine) -> dict[str, float]:
        """What the law's `design` gives.

        Raises
        ------
        ControllerError
            If it fails, or gives anything but finite numbers.
        """
        design = getattr(self.law, "design", None)
        if design is None:
            return {}
        values = SimpleNamespace(**{n: getattr(self, n) for n in self.parameter_names()})
        try:
            found = {str(n): float(v) for n, v in dict(design(values, machine)).items()}
        except Exception as problem:
            text = f"{self.kind}: design: {type(problem).__name__}: {problem}"
            raise ControllerError(text) from problem
        for name, value in found.items():
            if not np.isfinite(value):
                raise ControllerError(f"{self.kind}: design gives {name} = {value}")
        return found

    def machine(self, model: ActuatorModel, load: Load) -> KnownMachine:
        """What is known of a machine.

        Raises
        ------
        ControllerError
            If a torque is to be followed and no spring measures it.
        """
        plant = model.plant(self.command_name, load)
        elastic = plant.structure in (mp.ELASTIC_FREE, mp.ELASTIC_HELD)
        if not elastic and self.reference_name == FOLLOWS["torque"]:
            raise ControllerError(
                f"{self.kind}: rig {model.rig.name!r} with the load {load.kind!r} has no spring"
                " between wheel and load whose deflection would measure the torque"
            )
        per_torque, per_speed, limit = command_scale(plant, self.command_name, model)
        stiffness = float(spring_tangent_Nm_per_rad(model.spring_table(load), 0.0))
        return KnownMachine(
            model=model,
            load=load,
            gear_ratio=plant.gear_ratio,
            inertia_kgm2=plant.inertia,
            damping_Nms_per_rad=plant.damping,
            stiffness_Nm_per_rad=stiffness,
            command_per_Nm=per_torque,
            command_per_rad_per_s=per_speed,
            command_limit=limit,
            sample_time_s=self.sample_time_s,
        )

    def compile(self, model: ActuatorModel, load: Load) -> CompiledController:
        """The law with its numbers: parameters, constants, limit, gear ratio, spring.

        Raises
        ------
        ControllerError
            If the law reads or writes what it may not, or its `design` fails.
        """
        machine = self.machine(model, load)
        constants = self.constants(machine)
        own = [float(getattr(self, name)) for name in self.parameter_names()]
        numbers = [*own, *constants.values(), machine.command_limit, machine.gear_ratio]
        regions = model.spring_table(load).regions
        return CompiledController(
            function=_function(type(self), tuple(constants)),
            parameters=np.concatenate((numbers, regions.ravel())),
            state=np.array([*self.states.values(), 0.0][: max(len(self.states), 1)]),
            command_name=self.command_name,
            command_limit=machine.command_limit,
        )


_MADE: dict[tuple[type, tuple[str, ...]], object] = {}


def _function(kind: type[OwnLaw], constants: tuple[str, ...]):
    """The compiled law of a class, made once; in Python where numba cannot."""
    if (kind, constants) not in _MADE:
        names = (*kind.parameter_names(), *constants)
        step = getattr(kind.law, "step", kind.law)
        try:
            method = inspect.isclass(kind.law)
            made = source.rewritten(step, names, tuple(kind.states), method=method)
            law = njit(error_model="numpy")(source.as_function(made, step))
            _MADE[kind, constants] = _compiled(law, len(names))
        except (source.NotCompiledError, NumbaError) as problem:
            kind.interpreted[kind.kind] = " ".join(str(problem).split())[:200]
            _MADE[kind, constants] = _called_in_python(kind, step, names)
    return _MADE[kind, constants]


def _compiled(law, count: int):
    def act(p, s, y, command):
        limit, gear = p[count], p[count + 1]
        motor, load = y[k.READ_MOTOR_ANGLE], y[k.READ_LOAD_ANGLE]
        deflection = motor / gear - load
        torque = table_torque(p[count + 2 :].reshape(-1, 6), deflection)
        asked = law(
            p, s, y[k.REFERENCE], y[k.REFERENCE_RATE], y[k.REFERENCE_ACCELERATION],
            motor, load, y[k.READ_CURRENT], torque, deflection,
        )  # fmt: skip
        command[k.COMMAND] = min(max(asked, -limit), limit)
        command[k.UNSATURATED] = asked

    return cfunc(k.CONTROLLER, error_model="numpy")(act)


_CALLED: list = []  # kept alive: compiled loops have their addresses


def _called_in_python(kind: type[OwnLaw], step: Callable, names: tuple[str, ...]):
    """The same signature around the law as it was written; an exception makes the command NaN."""
    pointer = ctypes.POINTER(ctypes.c_double)
    count, states, method = len(names), tuple(kind.states), inspect.isclass(kind.law)

    def ask(numbers, remembered, signals, answer):
        try:
            seen = SimpleNamespace(**dict(zip(source.SIGNALS, signals[: len(source.SIGNALS)])))
            own = SimpleNamespace(**dict(zip(names, numbers[:count])))
            vars(own).update(zip(states, remembered[: len(states)]))
            if method:
                for name, value in vars(kind.law).items():  # helpers beside `step`
                    if inspect.isfunction(value) and name not in ("step", "design"):
                        setattr(own, name, value.__get__(own))
                answer[0] = float(step(own, seen))
            else:
                answer[0] = float(step(seen, **dict(zip(names, numbers[:count]))))
            for j, name in enumerate(states):
                remembered[j] = float(getattr(own, name))
        except Exception as problem:
            kind.problems.append(problem)
            answer[0] = np.nan

    entry = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 4)(
        lambda p, s, y, u: ask(*(ctypes.cast(a, pointer) for a in (p, s, y, u)))
    )
    _CALLED.append(entry)

    def act(p, s, y, command):
        limit, gear = p[count], p[count + 1]
        seen, answer = np.empty(8), np.empty(1)
        seen[:6] = y[:6]
        seen[7] = y[k.READ_MOTOR_ANGLE] / gear - y[k.READ_LOAD_ANGLE]
        seen[6] = table_torque(p[count + 2 :].reshape(-1, 6), seen[7])
        entry(p.ctypes, s.ctypes, seen.ctypes, answer.ctypes)
        command[k.COMMAND] = min(max(answer[0], -limit), limit)
        command[k.UNSATURATED] = answer[0]

    return cfunc(k.CONTROLLER, error_model="numpy")(act)


def controller(
    *,
    sample_time_s: float,
    follows: str = "torque",
    delay_samples: int = 1,
    command_name: str = "duty",
) -> Callable[[type | Callable], type[OwnLaw]]:
    """Decorator: a class with `step(self, y)`, or a function of y, as a controller.

    Raises
    ------
    ControllerError
        If it has no `step`, a field has no number, or a name is taken.
    """
    if follows not in FOLLOWS:
        raise ControllerError(f"follows = {follows!r} must be one of {', '.join(FOLLOWS)}")
    reserved = dict(zip(RESERVED, (sample_time_s, delay_samples, command_name), strict=True))

    def make(law: type | Callable) -> type[OwnLaw]:
        name = law.__name__
        numbers, states = _numbers_of(law), _states_of(law)
        for word in (*RESERVED, *BASE):
            if word in numbers or word in states:
                raise ControllerError(f"{name}: {word} is a name of every controller")
        if doubled := numbers.keys() & states.keys():
            raise ControllerError(f"{name}: {min(doubled)} is both a number and a state")
        values = {**numbers, **reserved}
        namespace = {
            "__annotations__": {key: type(value) for key, value in values.items()},
            "__doc__": law.__doc__,
            "__module__": law.__module__,
            "kind": f"{law.__module__}:{name}",
            "reference_name": FOLLOWS[follows],
            "law": law if inspect.isclass(law) else staticmethod(law),
            "states": states,
            **values,
        }
        made = dataclass(frozen=True, kw_only=True)(type(name, (OwnLaw,), namespace))
        made()  # defaults that cannot be used are refused here
        return made

    return make


def _numbers_of(law: type | Callable) -> dict[str, float]:
    name = law.__name__
    if inspect.isclass(law):
        if not callable(getattr(law, "step", None)):
            raise ControllerError(f"{name} has no step(self, y)")
        if len(inspect.signature(law.step).parameters) != 2:
            raise ControllerError(f"{name}: step must take (self, y) and nothing else")
        stated = inspect.get_annotations(law)
        lacking = next((n for n in stated if not hasattr(law, n)), None)
        if lacking is not None:
            raise ControllerError(f"{name}: {lacking} has no default")
        found = {n: getattr(law, n) for n in stated}
    else:
        arguments = list(inspect.signature(law).parameters.values())[1:]
        found = {a.name: a.default for a in arguments}
    for key, value in found.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ControllerError(f"{name}: {key} = {value!r} must be a number with a default")
    return {key: float(value) for key, value in found.items()}


def _states_of(law: type | Callable) -> dict[str, float]:
    given = getattr(law, "state", {}) if inspect.isclass(law) else {}
    try:
        return {str(key): float(value) for key, value in dict(given).items()}
    except (TypeError, ValueError) as problem:
        raise ControllerError(
            f'{law.__name__}: state = {given!r} must be numbers by name, as {{"integral": 0.0}}'
        ) from problem


def load_controller(kind: str, folder: Path) -> type[OwnLaw]:
    """The class that `kind = "my_module:MyLaw"` names; a file beside the scenario comes first.

    Raises
    ------
    ControllerError
        In one line, if module or class are not there, or cannot be used.
    """
    module_name, _, name = kind.partition(":")
    path = folder / f"{module_name.replace('.', '/')}.py"
    try:
        if path.is_file():
            spec = importlib.util.spec_from_file_location(module_name, path)
            module = importlib.util.module_from_spec(spec)
            known = sys.modules.get(module_name)
            if known is not None and getattr(known, "__file__", None) == str(path):
                module = known
            else:
                sys.modules[module_name] = module
                spec.loader.exec_module(module)
        else:
            module = importlib.import_module(module_name)
    except ControllerError:
        raise
    except Exception as problem:
        sys.modules.pop(module_name, None)
        text = " ".join(f"{type(problem).__name__}: {problem}".split())
        raise ControllerError(f"{kind}: {module_name} cannot be loaded: {text}") from problem
    found = getattr(module, name, None)
    if not (inspect.isclass(found) and issubclass(found, OwnLaw)):
        raise ControllerError(f"{kind}: {module_name} has no @rsea_core.controller {name!r}")
    return found
