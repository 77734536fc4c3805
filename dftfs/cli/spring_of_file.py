"""A spring design that a comparison names, solved for its curve."""

from collections.abc import Callable
from pathlib import Path

from dftfs.analysis.study.actuator import spring_curve
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.solve import solve_torsion
from dftfs.design import built_in_names, load_design


def design_solver(folder: Path, say: Callable[[str], None]):
    """A function from the name of a design, or of a file beside the comparison, to its curve."""
    solved: dict = {}

    def solve(name: str):
        if name not in solved:
            design = load_design(name if name in built_in_names() else str(folder / name))
            problem = TorsionProblem(design=design, dimension=2)
            say(f"spring {design.name}: {problem.model}")
            curve = solve_torsion(problem, on_progress=say)
            solved[name] = spring_curve(curve, f"{design.name}, {curve.model}")
        return solved[name]

    return solve
