"""The sizing's search against 20,000 rod evaluations of plain differential evolution.

`python -m benchmarks.sizing_tasks` runs four tasks that can be met and two that cannot, each by one
call as `dftfs size` makes it (finite elements left out); `--further` runs four others, which
were not used while the search was developed; `--brute-force` adds the comparison, some minutes for
each task. Both search the same grids with the same judge; the brute force knows no zooming, no
local models, no pattern search and no screened first population.
"""

import argparse
import time

import numpy as np
from scipy.optimize import differential_evolution

from dftfs.analysis.sizing.archive import Archive
from dftfs.analysis.sizing.pool import judge_pool
from dftfs.analysis.sizing.relaxation import relaxations
from dftfs.analysis.sizing.search import Sizing, size
from dftfs.analysis.sizing.task import SizingTask, load_task

SMALL = {"stiffness_Nm_per_rad": "40", "envelope_mm": "110", "material": "17-4PH"}
TASKS = {
    "thesis' actuator (65 Nm/rad, 20 Nm, 175 mm, 7075-T6, wire EDM)": {},
    "40 Nm/rad, 10 Nm, 110 mm, 17-4PH, water jet": {
        **SMALL,
        "contact_free_torque_Nm": "10",
        "process": "water-jet",
    },
    "5 Nm/rad, 2 Nm, 60 mm, Ti-6Al-4V, wire EDM": {
        "stiffness_Nm_per_rad": "5",
        "contact_free_torque_Nm": "2",
        "envelope_mm": "60",
        "min_bore_mm": "6",
        "material": "Ti-6Al-4V",
    },
    "300 Nm/rad, 60 Nm, 200 mm, 17-4PH, milling": {
        "stiffness_Nm_per_rad": "300",
        "contact_free_torque_Nm": "60",
        "envelope_mm": "200",
        "material": "17-4PH",
        "process": "milling",
    },
}
# of other stiffness, envelope, material, process and requirements
FURTHER = {
    "20 Nm/rad, 8 Nm, 120 mm, Ti-6Al-4V, water jet, 1e5 cycles": {
        "stiffness_Nm_per_rad": "20",
        "contact_free_torque_Nm": "8",
        "envelope_mm": "120",
        "material": "Ti-6Al-4V",
        "process": "water-jet",
        "life_cycles": "1e5",
    },
    "120 Nm/rad, 25 Nm, 140 mm, 17-4PH, wire EDM, 3 arms, 1e6 cycles": {
        "stiffness_Nm_per_rad": "120",
        "contact_free_torque_Nm": "25",
        "envelope_mm": "140",
        "material": "17-4PH",
        "n_arms": "3",
        "life_cycles": "1e6",
    },
    "500 Nm/rad, 120 Nm, 300 mm, 17-4PH or Ti-6Al-4V, milling, 2 to 4 arms, taper": {
        "stiffness_Nm_per_rad": "500",
        "contact_free_torque_Nm": "120",
        "envelope_mm": "300",
        "material": "17-4PH, Ti-6Al-4V",
        "process": "milling",
        "n_arms": "2:4:1",
        "taper": "0.8:1.2:0.02",
    },
    "25 Nm/rad, 6 Nm, 160 mm, 7075-T6, milling, 1e5 cycles": {
        "stiffness_Nm_per_rad": "25",
        "contact_free_torque_Nm": "6",
        "envelope_mm": "160",
        "process": "milling",
        "life_cycles": "1e5",
    },
}
INFEASIBLE = {
    "40 Nm/rad, 45 Nm, 110 mm, 17-4PH, water jet": {
        **SMALL,
        "contact_free_torque_Nm": "45",
        "process": "water-jet",
    },
    "65 Nm/rad, 20 Nm, 60 mm, 6061-T6, wire EDM": {
        "material": "6061-T6",
        "envelope_mm": "60",
    },
}
EVALUATIONS = 20_000
_POPULATION = 200


def brute_force(task: SizingTask, jobs: int, seed: int) -> float:
    """Best objective of 20,000 candidates, infinite where none is feasible."""
    with judge_pool(task, jobs) as judge:
        archive = Archive.of(task, judge)

        def many(_: object, rows) -> list[float]:
            indices = [tuple(round(float(x)) for x in row) for row in rows]
            return [archive.merit(candidate) for candidate in archive.judge(indices)]

        bounds = [(0, grid.steps) for grid in task.searched]
        first = np.random.default_rng(seed).random((_POPULATION, len(bounds)))
        differential_evolution(
            lambda row: many(None, [row])[0],
            bounds,
            init=np.rint(first * [high for _, high in bounds]),
            maxiter=EVALUATIONS // _POPULATION - 1,
            strategy="rand1bin",
            tol=0.0,
            polish=False,
            rng=np.random.default_rng(seed),
            integrality=[high > 0 for _, high in bounds],
            updating="deferred",
            workers=many,
        )
    return archive.best.objective(task.objective) if archive.best.feasible else float("inf")


def main() -> None:
    """Print a line for each task."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--brute-force", action="store_true")
    parser.add_argument("--further", action="store_true", help="four other tasks instead")
    parser.add_argument("--only", type=int, help="number of one task, from 0")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    arguments = parser.parse_args()
    tasks = FURTHER if arguments.further else TASKS | INFEASIBLE
    for number, (name, changes) in enumerate(tasks.items()):
        if arguments.only not in (None, number):
            continue
        task = load_task("default", changes)
        begun = time.perf_counter(), time.process_time()
        with judge_pool(task, arguments.jobs) as judge:
            found = size(task, seed=arguments.seed, judge=judge)
            if isinstance(found, Sizing):
                text = f"{found.best.mass_kg * 1e3:.2f} g, {found.judged} evaluations"
            else:
                changes_found = relaxations(
                    found, lambda other: judge_pool(other, arguments.jobs), seed=arguments.seed
                )
                text = "; ".join(one.line() for one in changes_found)
        print(f"{name}: {text}, {time.perf_counter() - begun[0]:.1f} s", flush=True)
        if arguments.brute_force and isinstance(found, Sizing):
            best = brute_force(task, arguments.jobs, arguments.seed + 1)
            ratio = found.best.mass_kg / best - 1
            print(
                f"  brute force {best * 1e3:.2f} g: the search is {100 * ratio:+.2f} %", flush=True
            )


if __name__ == "__main__":
    main()
