"""The machine as objects of python-control, for whoever designs controllers with it.

The only module that imports python-control; nothing else of the package imports this one. It
comes with the extra "interop": pip install "dftfs[interop]".
"""

import numpy as np

from rsea_core.engines.linear.linearise import STATE_NAMES, LinearModel
from rsea_core.numeric.transfer_function import TransferFunction
from rsea_core.performance.frequency import TORQUE, output_row

try:
    from control import StateSpace
    from control import TransferFunction as ControlTransferFunction
except ModuleNotFoundError as problem:
    raise ModuleNotFoundError(
        'python-control is not installed: pip install "dftfs[interop]"', name=problem.name
    ) from problem


def to_control(
    linear: LinearModel, *, outputs: tuple[str, ...] = (TORQUE,), command_name: str = "command"
) -> StateSpace:
    """A python-control state space with named input, states and outputs.

    States that the machine does not have (rows of zeros: the motion of a held load, the current
    of a winding without inductance) are left out; an output that reads one stays 0.

    Raises
    ------
    InputError
        If an output is neither "torque_Nm" nor a state.
    """
    C = np.array([output_row(linear, name) for name in outputs])
    kept = np.flatnonzero(np.any(linear.A != 0.0, axis=1) | (linear.b != 0.0))
    return StateSpace(
        linear.A[np.ix_(kept, kept)],
        linear.b[kept, None],
        C[:, kept],
        np.zeros((len(outputs), 1)),
        inputs=[command_name],
        states=[STATE_NAMES[i] for i in kept],
        outputs=list(outputs),
    )


def transfer_function_to_control(transfer: TransferFunction) -> ControlTransferFunction:
    """The same quotient of polynomials as a python-control transfer function."""
    return ControlTransferFunction(transfer.numerator, transfer.denominator)
