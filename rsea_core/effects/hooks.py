"""Laws of effects in compiled code: each effect hooks its own into a port, engines call the port.

A hook takes what the port has summed so far and returns it with its own part:

    hook(fx, angle, speed, sum) -> sum          fx: the numbers (`slots`), all at the gear output

    output_torque   torque [Nm] on the gear's output side, by the motor's angle over the ratio
    load_torque     torque [Nm] on the load, by its angle
    load_friction   level [Nm] of the dry friction of the load's joint, by its angle from where
                    it hangs

Hooks of this package are folded into one function a port and inlined. Hooks of users
(`user_effects`) are called by an address that the machine's numbers carry, so that
the engines need not be compiled anew: `OUTSIDE` is zero where there are none.
"""

import ctypes
from collections.abc import Callable
from functools import cache

import numpy as np
from llvmlite import ir
from numba import carray, cfunc, njit, types
from numba.core.errors import NumbaError
from numba.extending import intrinsic
from numpy.typing import NDArray

from rsea_core.effects.slots import USER_PLACES, block, slots
from rsea_core.numeric.source_version import SOURCE_VERSION

PORTS = ("output_torque", "load_torque", "load_friction")
N_ARRAY_MOST = 1024  # numbers of a machine, at most
Hook = Callable[[np.ndarray, float, float, float], float]

OUTSIDE = slots("outside")  # address of the hooks of others
USER = block("user", USER_PLACES)
_HOOKS: dict[str, list[Hook]] = {port: [] for port in PORTS}
_FOLDED: set[str] = set()  # ports that engines have: further hooks are called by their address
_INLINED = {"error_model": "numpy", "forceinline": True}


def hook(port: str) -> Callable[[Hook], Hook]:
    """Decorator: put a law into a port.

    Raises
    ------
    ValueError
        If there is no such port.
    """
    if port not in PORTS:
        raise ValueError(f"port {port!r} is not one of {', '.join(PORTS)}")

    def register(law: Hook) -> Hook:
        if _FOLDED:
            OUTSIDE_HOOKS.add(port, law)
            return law
        compiled = njit(**_INLINED)(law)
        _HOOKS[port].append(compiled)
        return compiled

    return register


def folded(port: str) -> Hook:
    """All hooks of a port as one compiled function: (fx, angle, speed, sum) -> sum."""

    _FOLDED.add(port)

    @njit(**_INLINED)
    def through(fx, angle, speed, total):
        return total

    for part in _HOOKS[port]:
        through = _after(through, part)
    return _with_outside(through, PORTS.index(port))


def summed(port: str, fx: NDArray, angles: NDArray, speeds: NDArray) -> NDArray:
    """What all hooks of a port make at angles and speeds (n,): (n,) array, for drawing."""
    return _at_each()(PORTS.index(port), fx, angles, speeds)


@cache
def _at_each() -> Callable[[int, NDArray, NDArray, NDArray], NDArray]:
    """A port's hooks over arrays, compiled once and kept on disk.

    The laws are globals: numba's cache has no key for compiled functions in a closure.
    """
    global _output_torque, _load_torque, _load_friction
    _output_torque, _load_torque, _load_friction = (folded(port) for port in PORTS)
    return _cached(SOURCE_VERSION)


def _cached(version):
    def at_each(port, fx, angles, speeds):
        found = np.zeros(angles.size + version * 0)
        for j in range(angles.size):
            if port == 0:
                found[j] = _output_torque(fx, angles[j], speeds[j], 0.0)
            elif port == 1:
                found[j] = _load_torque(fx, angles[j], speeds[j], 0.0)
            else:
                found[j] = _load_friction(fx, angles[j], speeds[j], 0.0)
        return found

    return njit(cache=True, error_model="numpy")(at_each)


def _after(first: Hook, second: Hook) -> Hook:
    @njit(**_INLINED)
    def both(fx, angle, speed, total):
        return second(fx, angle, speed, first(fx, angle, speed, total))

    return both


def _with_outside(inside: Hook, port: int) -> Hook:
    @njit(**_INLINED)
    def every(fx, angle, speed, total):
        total = inside(fx, angle, speed, total)
        if fx[OUTSIDE] != 0.0:
            total = _call(np.int64(fx[OUTSIDE]), port, fx.ctypes.data, angle, speed, total)
        return total

    return every


@intrinsic
def _call(typingctx, address, port, data, angle, speed, total):
    """Call the function at an address: float64(int64, float64*, float64, float64, float64)."""
    real = types.float64
    signature = real(types.int64, types.int64, types.intp, real, real, real)

    def generate(context, builder, signature, arguments):
        number, whole = ir.DoubleType(), ir.IntType(64)
        kind = ir.FunctionType(number, [whole, number.as_pointer(), number, number, number])
        function = builder.inttoptr(arguments[0], kind.as_pointer())
        numbers = builder.inttoptr(arguments[2], number.as_pointer())
        return builder.call(function, [arguments[1], numbers, *arguments[3:]])

    return signature, generate


def _by_port(before: Callable, port: int, law: Hook) -> Callable:
    @njit(error_model="numpy")
    def after(number, fx, angle, speed, total):
        total = before(number, fx, angle, speed, total)
        return law(fx, angle, speed, total) if number == port else total

    return after


@njit(error_model="numpy")
def _nothing(number, fx, angle, speed, total):
    return total


def _entry(laws: Callable):
    real = types.float64
    signature = real(types.int64, types.CPointer(real), real, real, real)

    @cfunc(signature, error_model="numpy")
    def entry(port, numbers, angle, speed, total):
        return laws(port, carray(numbers, (N_ARRAY_MOST,)), angle, speed, total)

    return entry


class OutsideHooks:
    """Hooks that are registered after the engines were compiled, behind one address.

    Those that numba cannot compile are called in Python, about a thousand times slower.
    """

    def __init__(self):
        self.laws: list[tuple[int, Hook]] = []
        self.interpreted = False
        self._made = None  # kept alive: engines have its address
        self._address = 0.0

    def add(self, port: str, law: Hook) -> None:
        """Put a law into a port."""
        self.laws.append((PORTS.index(port), law))
        self._address = 0.0

    def address(self) -> float:
        """Of one function of all laws; 0 where there are none. Below 2^53, so exact as a float."""
        if self.laws and self._address == 0.0:
            self._address = self._compiled()
        return self._address

    def _compiled(self) -> float:
        laws = _nothing
        for port, law in self.laws:
            laws = _by_port(laws, port, njit(error_model="numpy")(law))
        try:
            self._made = _entry(laws)
            return float(self._made.address)
        except NumbaError:
            self.interpreted = True
            return self._called_in_python()

    def _called_in_python(self) -> float:
        number = ctypes.c_double
        kind = ctypes.CFUNCTYPE(
            number, ctypes.c_int64, ctypes.POINTER(number), number, number, number
        )

        def entry(port, numbers, angle, speed, total):
            fx = np.ctypeslib.as_array(numbers, shape=(N_ARRAY_MOST,))
            for own, law in self.laws:
                total = law(fx, angle, speed, total) if own == port else total
            return total

        self._made = kind(entry)
        return float(ctypes.cast(self._made, ctypes.c_void_p).value)


OUTSIDE_HOOKS = OutsideHooks()
