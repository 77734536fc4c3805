"""How often the error bar of a mesh series holds the limit of a series on meshes twice as fine.

`python -m benchmarks.notch_bars --count 20 --seed 0`: random designs (2 to 4 arms, fillets, turns,
thickness), stresses of notch, slit and arm and the stiffness in plane stress. The bar comes from
the default mesh's own series; what it must hold is the extrapolated value of a series that begins
at half the element size. A figure that either series calls singular is listed apart.
"""

import argparse
from dataclasses import replace

import numpy as np

from benchmarks.near_designs import random_design
from dftfs.analysis.strength.mesh_series import mesh_series
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.errors import DftfsError

_TORQUE_NM = 5.0


def main() -> None:
    """Print a line for each design and figure, and how many bars hold."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)
    holds: dict[str, list[bool]] = {}
    for number in range(arguments.count):
        design = random_design(rng, number)
        problem = TorsionProblem(design=design, dimension=2)
        finer = replace(problem, sizing=problem.sizing.finer(2.0))
        try:
            coarse, fine = (mesh_series(p, _TORQUE_NM, contact=False) for p in (problem, finer))
        except DftfsError as error:
            print(f"{design.name}: {error}")
            continue
        for one, limit in zip(coarse, fine):
            kind = one.quantity.partition(" at ")[0]
            if "singular" in (one.verdict, limit.verdict):
                print(f"{design.name}: {kind}: singular")
                continue
            held = abs(one.value - limit.extrapolated) <= one.relative_error * abs(one.value)
            holds.setdefault(kind, []).append(held)
            off, verdict = limit.extrapolated / one.value - 1, "holds" if held else "MISSES"
            print(
                f"{design.name}: {kind}: {one.value:.5g} +- {100 * one.relative_error:.2f} %"
                f" ({one.verdict}), twice finer {100 * off:+.2f} %: {verdict}",
                flush=True,
            )
    for kind, found in holds.items():
        print(f"{kind}: {sum(found)} of {len(found)} bars hold")


if __name__ == "__main__":
    main()
