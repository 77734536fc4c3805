"""What `dftfs size` prints: the best design and its limits, or what is in the way of any."""

from collections.abc import Sequence

from dftfs.analysis.sizing.archive import Archive
from dftfs.analysis.sizing.comparison import Comparison
from dftfs.analysis.sizing.relaxation import Relaxation
from dftfs.analysis.sizing.search import Sizing
from dftfs.analysis.sizing.task import SizingTask
from dftfs.cli.common import table


def unmet_text(
    task: SizingTask, found: Archive, changes_found: Sequence[Relaxation], wall_s: float
) -> str:
    """Which requirements are in the way, and the nearest ones that can be met."""
    text = [
        f"{task.name}: no spring meets all requirements; the nearest violates {found.best.why}"
        f" ({len(found.known)} candidates, {wall_s:.1f} s). One of these would do (rod model):",
        *(f"  {one.line()}" for one in changes_found if one.works is not None),
    ]
    idle = ", ".join(one.requirement for one in changes_found if one.works is None)
    return "\n".join([*text, f"changed alone, no remedy: {idle}"] if idle else text)


def text_of(task, found: Sizing, others: tuple[Comparison, ...], checked, wall_s: float) -> str:
    """The best design, its limits, what binds it, and what finite elements find."""
    best = found.best
    lines = [
        f"{task.name}: {best.mass_kg * 1e3:.1f} g, K = {best.stiffness_Nm_per_rad:.2f} Nm/rad,"
        f" {best.stress_Pa / 1e6:.0f} MPa at {task.operating_torque_Nm:g} Nm (rod model;"
        f" {found.judged} candidates in {found.wall_s:.1f} s)",
        "  "
        + ", ".join(f"{name} {value:g}" for name, value in best.values_mm)
        + f", width_mm {best.width_mm:g}, {best.material}",
        "binding limits: "
        + ("; ".join(f"{stop.limit} ({stop.step})" for stop in found.stops) or "none found"),
    ]
    rows = [
        [limit.name, f"{limit.found:.4g}", f"{limit.asked:.4g}", limit.unit]
        for limit in best.limits
    ]
    lines.append(table(["limit", "found", "required", ""], rows))
    for other in others:
        lines += other.lines()
    for one in checked:
        touches = (f"{w} {t:.1f} Nm" for w, t in one.contact_Nm.items() if t is not None)
        contact = ", ".join(touches) or "none"
        solid = one.stiffness_3d_Nm_per_rad
        lines.append(
            f"{one.design.name} by finite elements: width {one.design.width_m * 1e3:g} mm, K ="
            f" {one.stiffness_2d_Nm_per_rad:.3f} Nm/rad in 2D"
            + ("" if solid is None else f", {solid:.3f} in 3D")
            + f"; first contact {contact}, {one.stress_Pa / 1e6:.0f} MPa (2D curve"
            + ("" if solid is None else ", torques by the 3D stiffness")
            + ")"
        )
        lines += ["  " + check.line() for check in one.checks]
    return "\n".join([*lines, f"{wall_s:.1f} s in all"])
