"""The controller of an open loop: it plays back a recorded command."""

import functools

from numba import cfunc

import rsea_core.engines.event_driven.states as k


@functools.cache
def playback():
    """The controller of an open loop: the reference is the command. Compiled when first used."""

    @cfunc(k.CONTROLLER, cache=True)
    def recorded_command(parameters, state, signals, command):
        command[k.COMMAND] = signals[k.REFERENCE]
        command[k.UNSATURATED] = signals[k.REFERENCE]

    return recorded_command
