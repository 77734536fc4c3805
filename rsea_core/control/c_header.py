"""A tuned controller as one C header without dependencies, for the machine's own computer.

The header holds the numbers that the controller was compiled with and its law in C99; it needs
<math.h> and nothing else, allocates nothing and keeps its state in a struct of the caller's:

    #include "controller.h"
    rsea_state state;
    rsea_start(&state);
    every sample: duty = rsea_step(&state, &input);

The laws are written a second time, in C, in `data/c`; a test compiles the header, replays what a
simulated controller read and asks for the same commands to 1e-9. Absorbed from acados and
MATLAB's embedded coder: constants inside, one step function, no global state.
"""

import re
from importlib import resources
from types import ModuleType

import numpy as np

import rsea_core.control.laws.fuzzy_torque as fuzzy_torque
import rsea_core.control.laws.impedance as impedance
import rsea_core.control.laws.observer as observer
import rsea_core.control.laws.pid as pid
import rsea_core.control.laws.state_feedback as state_feedback
import rsea_core.control.laws.torque_loop as torque_loop
from rsea_core.control.laws.base import Controller
from rsea_core.errors import ControllerError
from rsea_core.machine.inputs import Load
from rsea_core.model.actuator_model import ActuatorModel

LAWS: dict[str, ModuleType] = {
    "pid-torque": pid,
    "fuzzy-torque": fuzzy_torque,
    "disturbance-observer": observer,
    "lqg-torque": state_feedback,
    "impedance": impedance,
}
PER_LINE = 4


def c_header(controller: Controller, model: ActuatorModel, load: Load) -> str:
    """The text of the header for a controller on a machine.

    Raises
    ------
    ControllerError
        If the law has no C form, or reads what no encoder gives.
    RigError
        As the controller's `compile`.
    """
    if controller.kind not in LAWS:
        raise ControllerError(f"{controller.kind} has no C form; these have: {', '.join(LAWS)}")
    if getattr(controller, "ideal_sensors", False):
        raise ControllerError(f"{controller.kind}: a machine has no ideal_sensors")
    if getattr(controller, "aggregation", "sum") != "sum":
        raise ControllerError(f'{controller.kind}: only aggregation = "sum" has a C form')
    law = LAWS[controller.kind]
    compiled = controller.compile(model, load)
    spring = model.spring_table(load).regions.size
    names = _names(law, torque_loop) if law is not impedance else _names(law)
    names["SPRING"] = compiled.parameters.size - spring
    names["REGIONS"] = spring // 6
    parts = ["spring.h", f"{controller.kind}.h"]
    if law is not impedance:
        parts.insert(1, "torque_loop.h")
    text = "\n".join(_read(part) for part in parts)
    used = {name: value for name, value in names.items() if _word_in(name, text)}
    return "\n".join(
        (
            _opening(controller, model, load, compiled.command_name),
            *(f"#define {name} {value}" for name, value in used.items()),
            f"#define N_PARAMETERS {compiled.parameters.size}",
            _array("rsea_parameters", compiled.parameters),
            text,
            _interface(compiled.state.size, compiled.command_name),
            *(f"#undef {name}" for name in (*used, "N_PARAMETERS")),
            "#endif",
            "",
        )
    )


def _names(*modules: ModuleType) -> dict[str, int]:
    """Every index that the modules name, the first one's last word."""
    found: dict[str, int] = {}
    for module in reversed(modules):
        for name, value in vars(module).items():
            if name.isupper() and isinstance(value, int):
                found[name] = value
    return found


def _word_in(name: str, text: str) -> bool:
    return re.search(rf"\b{name}\b", text) is not None


def _read(name: str) -> str:
    return (resources.files("rsea_core") / "data" / "c" / name).read_text(encoding="utf-8")


def _array(name: str, values) -> str:
    lines = [
        "    " + ", ".join(_number(v) for v in values[i : i + PER_LINE]) + ","
        for i in range(0, len(values), PER_LINE)
    ]
    return "\n".join((f"static const double {name}[N_PARAMETERS] = {{", *lines, "};"))


def _number(value: float) -> str:
    if np.isinf(value):
        return "HUGE_VAL" if value > 0 else "-HUGE_VAL"
    return repr(float(value))


def _opening(controller: Controller, model: ActuatorModel, load: Load, command: str) -> str:
    follows = controller.reference_name.replace("reference_", "")
    return f"""/* {controller.kind} for rig {model.rig.name}, load {load.kind}; by rsea_core.
 *
 * Call rsea_step every {controller.sample_time_s:g} s; it answers {command}.
 * The reference is {follows}, with its first two time derivatives. Angles are those of the
 * encoders, on the motor's and on the load's side.
 */
#ifndef RSEA_CONTROLLER_H
#define RSEA_CONTROLLER_H
#include <math.h>

typedef struct {{
    double reference, reference_rate, reference_acceleration;
    double motor_angle_rad, load_angle_rad;
}} rsea_input;
"""


def _interface(states: int, command: str) -> str:
    return f"""
typedef struct {{
    double s[{states}];
}} rsea_state;
static inline void rsea_start(rsea_state *state) {{
    int i;
    for (i = 0; i < {states}; ++i) state->s[i] = 0.0;
}}
/* the command ({command}) for this sample */
static inline double rsea_step(rsea_state *state, const rsea_input *input) {{
    return rsea_law(rsea_parameters, state->s, input);
}}"""
