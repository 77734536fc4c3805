"""`dftfs simulate`: a scenario file, with the spring it names, through the actuator."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from dftfs.cli.common import add_output, emit, progress
from dftfs.cli.output import output_folder
from dftfs.cli.own_effects import add_effects, load_own_effects

if TYPE_CHECKING:  # what the work needs is imported by it: `--help` needs none of it
    from rsea_core.performance.compensation_trace import CompensationTrace
    from rsea_core.performance.loop_study import LoopStudy
    from rsea_core.scenarios.scenario import ScenarioResult

FILES = ("csv", "json", "html", "torque.png", "motion.png")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("scenario", type=Path, metavar="SCENARIO.toml")
    parser.add_argument(
        "--solid",
        action="store_true",
        help="solve the spring with 3D instead of plane-stress elements",
    )
    parser.add_argument(
        "--mjcf", type=Path, metavar="FILE", help="also write the actuator as MuJoCo XML"
    )
    add_effects(parser)
    add_output(parser, folder=True)


def run(arguments: argparse.Namespace) -> int:
    """Simulate, judge, and write the trajectory where a folder is given."""
    from dftfs.cli.scenario_run import run_of
    from dftfs.files import file_stem, refuse_existing, to_json, write_text
    from dftfs.report.control.simulation import write_simulation_page, write_simulation_pictures
    from rsea_core.scenarios.scenario import Scenario

    say = progress()
    load_own_effects(arguments, say)
    scenario = Scenario.from_toml(arguments.scenario)
    list(map(say, scenario.notes))
    paths: dict[str, Path] = {}
    folder, stem = output_folder(arguments, f"simulate-{scenario.name}"), file_stem(scenario.name)
    if folder is not None:
        paths = {kind: folder / f"{stem}.{kind}" for kind in FILES}
    wanted = [*paths.values(), *([arguments.mjcf] if arguments.mjcf else [])]
    refuse_existing(wanted, force=arguments.force)
    result, design = run_of(scenario, arguments.scenario.parent, say, solid=arguments.solid)
    ran = result.trajectory
    why = "" if ran.engine_reason is None else f" ({ran.engine_reason})"
    say(f"{scenario.name}: {scenario.duration_s:g} s simulated, {ran.engine} engine{why}")
    record = {
        "scenario": scenario.name,
        "engine": ran.engine,
        "engine_reason": ran.engine_reason,
        "metrics": result.metrics,
        "limits": result.limits,
    }
    if paths:
        ran.to_csv(paths["csv"])
        write_text(paths["json"], to_json(record))
        study = _study(result, say)
        inputs = [arguments.scenario]
        write_simulation_page(result, design, paths["html"], inputs, study, _trace(result))
        write_simulation_pictures(result, paths["torque.png"], paths["motion.png"])
    written = {kind: str(path) for kind, path in paths.items()}
    record |= {"trajectory_file": written.get("csv"), "page_file": written.get("html")}
    if arguments.mjcf is not None:
        record["mjcf_left_out"] = _write_mjcf(result, arguments.mjcf)
        say(f"MJCF leaves out: {'; '.join(record['mjcf_left_out']) or 'nothing'}")
    emit(record, _text(result, paths), as_json=arguments.json)
    return 0


def _study(result: "ScenarioResult", say) -> "LoopStudy | None":
    """What the page shows of the loop beside the task."""
    from rsea_core.errors import RseaError
    from rsea_core.performance.loop_study import loop_study
    from rsea_core.simulation.reference import largest_amplitude

    scenario, ran = result.scenario, result.trajectory
    law, size = scenario.controller, largest_amplitude(scenario.reference)
    try:
        return loop_study(law.kind, ran.model, law, ran.load, size)
    except RseaError as problem:
        say(f"no figures of the loop: {problem}")
        return None


def _trace(result: "ScenarioResult") -> "CompensationTrace | None":
    """What each part of a torque law's command carries; None for another law."""
    from rsea_core.errors import RseaError
    from rsea_core.performance.compensation_trace import compensation_trace

    scenario = result.scenario
    try:
        return compensation_trace(scenario.controller, result.trajectory, scenario.reference)
    except RseaError:
        return None


def _write_mjcf(result: "ScenarioResult", path: Path) -> tuple[str, ...]:
    from dftfs.files import write_text
    from rsea_core.interop.mjcf import to_mjcf

    run = result.trajectory
    exported = to_mjcf(run.model, run.load, command_name=run.command_name)
    write_text(path, exported.text)
    return exported.left_out


def _text(result: "ScenarioResult", paths: dict[str, Path]) -> str:
    m, unit = result.metrics, result.scenario.reference.unit
    rmse, peak = getattr(m, f"rmse_{unit}"), getattr(m, f"peak_error_{unit}")
    lines = [
        f"{result.scenario.name}: RMSE {rmse:.4f} {unit}, peak error {peak:.4f} {unit}"
        f" (from {m.from_s:g} s on)"
    ]
    if m.amplitude_ratio is not None:
        lines.append(f"amplitude ratio {m.amplitude_ratio:.4f}, phase {m.phase_deg:+.2f} deg")
    lines.append(
        f"current {m.current_rms_A:.3f} A rms, {m.current_peak_A:.3f} A peak; motor speed"
        f" {m.motor_speed_peak_rad_per_s:.1f} rad/s peak"
    )
    return "\n".join([*lines, result.limits.sentence, *map(str, paths.values())])
