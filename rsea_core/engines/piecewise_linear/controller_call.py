"""A controller called by its address.

numba finds the type of a compiled function that is an argument in Python, in each run: a part of a
short run's time. The type of an address is found at once, and the call is the same.
"""

from llvmlite import ir
from numba import types
from numba.core.errors import TypingError
from numba.extending import intrinsic

from rsea_core.engines.event_driven.states import CONTROLLER


@intrinsic
def call_controller(typing_context, address, parameters, state, signals, answer):
    """Call the function of the signature `CONTROLLER` at an address."""
    arrays = (parameters, state, signals, answer)
    if arrays != CONTROLLER.args:
        raise TypingError(f"a controller takes {CONTROLLER.args}, not {arrays}")

    def build(context, builder, signature, arguments):
        result = context.get_value_type(CONTROLLER.return_type)
        kind = ir.FunctionType(result, [context.get_value_type(each) for each in CONTROLLER.args])
        function = builder.inttoptr(arguments[0], kind.as_pointer())
        builder.call(function, arguments[1:])
        return context.get_dummy_value()

    return types.void(types.int64, *CONTROLLER.args), build
