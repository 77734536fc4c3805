"""A scenario of a file, run with the spring that it names."""

from collections.abc import Callable
from pathlib import Path

from dftfs.analysis.study.actuator import run_with_spring
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.solve import solve_torsion
from dftfs.design import SpringDesign, built_in_names, load_design
from rsea_core.scenarios.scenario import Scenario, ScenarioResult, run_scenario


def run_of(
    scenario: Scenario, folder: Path, say: Callable[[str], None], *, solid: bool = False
) -> tuple[ScenarioResult, SpringDesign | None]:
    """The result, and the design of the spring where the scenario names one.

    Parameters
    ----------
    folder : Path
        Of the scenario's file, where a design's file is looked for.
    solid : bool
        Solve the spring with 3D elements.

    Raises
    ------
    DftfsError, RseaError
        As reading and solving the design, and running the scenario.
    """
    if scenario.spring_design is None:
        return run_scenario(scenario), None
    name = scenario.spring_design
    design = load_design(name if name in built_in_names() else str(folder / name))
    problem = TorsionProblem(design=design, dimension=3 if solid else 2)
    say(f"spring {design.name}: {problem.model}")
    curve = solve_torsion(problem, on_progress=say)
    return run_with_spring(scenario, curve, f"{design.name}, {curve.model}"), design
