"""Half a million unknowns with contact: time and memory of `al1` unwinding past its first contact.

    python benchmarks/large_mesh.py --size 0.34 --layers 6 [--threads 2]

3D, one sector and half of the width as `dftfs verify` solves it, by the coarse mesh's first
contact: to 0.95 of it, the onset, then 1.05 and 1.10 of it in contact. Printed: unknowns, torque at
the end, CPU and wall time, peak memory. Targets on 2 free cores: 4 GB, 5 minutes.
"""

import argparse
import os
import time
from resource import RUSAGE_SELF, getrusage


def main() -> None:
    """Solve and print one line a phase."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=float, default=0.34)
    parser.add_argument("--layers", type=int, default=6)
    parser.add_argument("--threads", type=int, default=1, help="of the linear solver")
    arguments = parser.parse_args()
    os.environ["DFTFS_SOLVER_THREADS"] = str(arguments.threads)  # read when the library is loaded
    from dftfs.analysis.torsion.contact_path import continued_in_contact, path_to_contact
    from dftfs.analysis.torsion.problem import meshed_problem
    from dftfs.design import MeshChoice, load_design

    near, begun = 0.2017, (time.process_time(), time.perf_counter())  # `verify al1 --plane`

    def say(text: str) -> None:
        cpu, wall = time.process_time() - begun[0], time.perf_counter() - begun[1]
        peak_GiB = getrusage(RUSAGE_SELF).ru_maxrss / 1024**2
        print(f"{text}: {cpu:.0f} s CPU, {wall:.0f} s wall, {peak_GiB:.2f} GiB", flush=True)

    choice = MeshChoice(size=arguments.size, layers=arguments.layers)
    problem = meshed_problem(load_design("al1"), choice, dimension=3)
    static = problem.static_problem()
    say(f"{problem.mesh.nodes.size} unknowns meshed")
    path = path_to_contact(problem, static, -1.0, near, 1, [0.95 * near], "auto")
    say(f"first contact {path.onset.torque_Nm:.3f} Nm at {path.onset.deflection_rad:.4f} rad")
    path = continued_in_contact(problem, path, -1.10 * near, 1, [1.05 * near])
    torque = problem.copies * path.states[-1].drive_force
    say(f"in contact {torque:.3f} Nm at {path.states[-1].t:.4f} rad ({path.end})")


if __name__ == "__main__":
    main()
