"""MuJoCo's loop closed in C: the same PI law as the benchmarks have in Python, no Python in a run.

The loop is compiled with the headers of MuJoCo's own package, on the package's library.
"""

import ctypes
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

SOURCE = Path(__file__).with_name("mujoco_loop.c")


@cache
def _library() -> ctypes.CDLL:
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        raise RuntimeError("MuJoCo's loop in C needs a C compiler (cc or gcc)")
    home = Path(mujoco.__file__).parent
    shared = next(home.glob("libmujoco.so*"))
    with tempfile.TemporaryDirectory() as made:
        subprocess.run(
            [compiler, "-std=c99", "-O3", "-march=native", "-shared", "-fPIC", f"-I{home}/include",
             str(SOURCE), str(shared), f"-Wl,-rpath,{home}", "-o", "loop.so", "-lm"],
            cwd=made, check=True,
        )  # fmt: skip
        return ctypes.CDLL(str(Path(made, "loop.so")))


def _pointer(array: NDArray | None):
    return None if array is None else array.ctypes.data_as(ctypes.c_void_p)


def loop_in_c(
    model: "mujoco.MjModel",
    data: "mujoco.MjData",
    target: NDArray,
    *,
    numbers: tuple[float, float, float, float, float, float],
    tick_s: float,
    duty: NDArray | None = None,
) -> NDArray:
    """Spring torque at each tick.

    Parameters
    ----------
    target : (n,) array
        Reference of the torque.
    numbers : stiffness, gear ratio, encoder count (0: exact), kp, ki times tick, volts
    tick_s : float
        Of the law; MuJoCo's step divides it.
    duty : (n,) array or None
        A command in place of the law.
    """
    steps = round(tick_s / model.opt.timestep)
    torque, given = np.zeros(target.size), np.array(numbers)
    _library().loop(
        ctypes.c_void_p(model._address), ctypes.c_void_p(data._address), target.size - 1, steps,
        _pointer(given), _pointer(target), _pointer(duty), _pointer(torque),
    )  # fmt: skip
    return torque
