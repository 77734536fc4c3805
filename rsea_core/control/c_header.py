"""A tuned controller as one C header without dependencies, for the machine's own computer.

The header holds the numbers that the controller was compiled with and its law in C99; it needs
<math.h> and nothing else, allocates nothing and keeps its state in a struct of the caller's:

    #include "controller.h"
    rsea_state state;
    rsea_start(&state);
    every sample: duty = rsea_step(&state, &input);

Every name begins with the prefix, so that any number of controllers share one file. A sample in
which an input is not finite leaves the state as it was and repeats the last command; after
HELD_SAMPLES of them in a row the command is zero, and the law starts anew with the next sample.

The laws are written a second time, in C, in `data/c`; a test compiles the header, replays what a
simulated controller read and asks for the same commands to 1e-12. Absorbed from acados and
MATLAB's embedded coder: constants inside, one step function, no global state.
"""

import re
from collections.abc import Collection
from importlib import resources
from types import ModuleType

from numpy.typing import NDArray

import rsea_core.control.laws.adaptive_impedance as adaptive_impedance
import rsea_core.control.laws.fractional as fractional
import rsea_core.control.laws.fuzzy_torque as fuzzy_torque
import rsea_core.control.laws.impedance as impedance
import rsea_core.control.laws.observer as observer
import rsea_core.control.laws.pid as pid
import rsea_core.control.laws.state_feedback as state_feedback
import rsea_core.control.laws.torque_loop as torque_loop
from rsea_core.control.laws.base import Controller
from rsea_core.control.laws.own_law import OwnLaw
from rsea_core.control.own_law_c import literal, own_law_c
from rsea_core.errors import ControllerError
from rsea_core.machine.inputs import Load
from rsea_core.model.actuator_model import ActuatorModel

LAWS: dict[str, ModuleType] = {
    "pid-torque": pid,
    "fuzzy-torque": fuzzy_torque,
    "disturbance-observer": observer,
    "lqg-torque": state_feedback,
    "impedance": impedance,
    "adaptive-impedance": adaptive_impedance,
    "fo-pid": fractional,
}
PER_LINE = 4
HELD_SAMPLES = 10
REALS = ("double", "float")
FUNCTIONS = (
    "fabs", "exp", "tanh", "atan", "pow", "sqrt", "log", "sin", "cos", "tan", "sinh", "cosh",
    "floor", "fmin", "fmax", "ceil", "copysign", "hypot", "asin", "acos", "atan2", "fmod",
)  # fmt: skip


def c_name(name: str) -> str:
    """A name in C that stands for any name."""
    plain = re.sub(r"[^0-9a-zA-Z]+", "_", name).strip("_").lower() or "controller"
    return f"c{plain}" if plain[0].isdigit() else plain


def c_header(
    controller: Controller,
    model: ActuatorModel,
    load: Load,
    *,
    prefix: str = "rsea",
    real: str = "double",
) -> str:
    """The text of the header for a controller on a machine.

    Parameters
    ----------
    prefix : str
        What every name of the header begins with.
    real : "double" or "float"

    Raises
    ------
    ControllerError
        If the law has no C form, or reads what no encoder gives; if prefix or real cannot be used.
    RigError
        As the controller's `compile`.
    """
    if not re.fullmatch(r"[a-z][a-z0-9_]*", prefix):
        raise ControllerError(f"prefix {prefix!r} must be lower-case letters, digits and _")
    if real not in REALS:
        raise ControllerError(f"real = {real!r} must be one of {', '.join(REALS)}")
    _require_c_form(controller)
    compiled = controller.compile(model, load)
    if isinstance(controller, OwnLaw):
        names, text = _own(controller, model, load)
    else:
        names, text = _built_in(controller.kind)
    spring = model.spring_table(load).regions.size
    names["SPRING"] = compiled.parameters.size - spring
    names["REGIONS"] = spring // 6
    text = f"{template('spring.h')}\n{text}"
    used = {name: value for name, value in names.items() if _word_in(name, text)}
    used["PARAMETERS"] = compiled.parameters.size
    whole = "\n".join(
        (
            _opening(controller, model, load, compiled.command_name),
            "enum {",
            *(f"    {name} = {value}," for name, value in used.items()),
            "};",
            _array("rsea_parameters", compiled.parameters),
            text,
            _interface(compiled.state, compiled.command_name),
            "#endif",
            "",
        )
    )
    return named(whole, used, prefix, real)


def _require_c_form(controller: Controller) -> None:
    """Refuse a law without C form, or that reads what no encoder gives."""
    kind = controller.kind
    if isinstance(controller, OwnLaw):  # its source decides
        return
    if kind not in LAWS:
        raise ControllerError(f"{kind} has no C form; these have: {', '.join(LAWS)}")
    if getattr(controller, "ideal_sensors", False):
        raise ControllerError(f"{kind}: a machine has no ideal_sensors")
    if getattr(controller, "aggregation", "sum") != "sum":
        raise ControllerError(f'{kind}: only aggregation = "sum" has a C form')


def _built_in(kind: str) -> tuple[dict[str, int], str]:
    """Indices and C text of a law of this package."""
    law = LAWS[kind]
    if law in (impedance, adaptive_impedance):
        return _names(law), template(f"{kind}.h")
    return _names(law, torque_loop), f"{template('torque_loop.h')}\n{template(f'{kind}.h')}"


def _own(controller: OwnLaw, model: ActuatorModel, load: Load) -> tuple[dict[str, int], str]:
    """Indices and C text of an own law: its numbers, those of its design, limit, gear, spring."""
    constants = tuple(controller.constants(controller.machine(model, load)))
    limit = len(controller.parameter_names()) + len(constants)
    return {"LIMIT": limit, "GEAR": limit + 1}, own_law_c(controller, constants)


def named(text: str, constants: Collection[str], prefix: str, real: str) -> str:
    """The text with the prefix before every name, in the asked precision."""
    alternatives = "|".join(sorted(constants, key=len, reverse=True))
    text = re.sub(rf"\b({alternatives})\b", rf"{prefix.upper()}_\1", text)
    text = re.sub(r"\brsea_(?!core)", f"{prefix}_", text).replace("RSEA_CONTROLLER", prefix.upper())
    if real == "float":
        code = re.split(r"(/\*.*?\*/)", text, flags=re.DOTALL)
        text = "".join(part if part.startswith("/*") else _single(part) for part in code)
    return text


def _single(code: str) -> str:
    code = re.sub(r"\bdouble\b", "float", code).replace("HUGE_VAL", "HUGE_VALF")
    code = re.sub(rf"\b({'|'.join(FUNCTIONS)})\(", r"\1f(", code)
    return re.sub(r"(?<![\w.])(\d+\.\d*(?:e[-+]?\d+)?|\d+e[-+]?\d+)", r"\1f", code)


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


def template(name: str, folder: str = "c") -> str:
    """A text of a folder of `data`."""
    return (resources.files("rsea_core") / "data" / folder / name).read_text(encoding="utf-8")


def _array(name: str, values) -> str:
    lines = [
        "    " + ", ".join(literal(float(v)) for v in values[i : i + PER_LINE]) + ","
        for i in range(0, len(values), PER_LINE)
    ]
    return "\n".join((f"static const double {name}[PARAMETERS] = {{", *lines, "};"))


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


def _interface(state: NDArray, command: str) -> str:
    first = "".join(f"\n    state->s[{j}] = {literal(float(x))};" for j, x in enumerate(state) if x)
    return f"""
typedef struct {{
    double s[{state.size}];
    double given;
    int missed;
}} rsea_state;
static inline void rsea_start(rsea_state *state) {{
    int i;
    for (i = 0; i < {state.size}; ++i) state->s[i] = 0.0;{first}
    state->given = 0.0;
    state->missed = 0;
}}
/* the command ({command}) for this sample */
static inline double rsea_step(rsea_state *state, const rsea_input *input) {{
    if (!isfinite(input->reference) || !isfinite(input->reference_rate)
        || !isfinite(input->reference_acceleration) || !isfinite(input->motor_angle_rad)
        || !isfinite(input->load_angle_rad)) {{
        int missed = state->missed + 1;
        if (missed >= {HELD_SAMPLES}) {{
            rsea_start(state);
            missed = {HELD_SAMPLES};
        }}
        state->missed = missed;
        return state->given;
    }}
    state->missed = 0;
    state->given = rsea_law(rsea_parameters, state->s, input);
    if (!isfinite(state->given)) rsea_start(state);
    return state->given;
}}"""
