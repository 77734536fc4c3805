"""Write docs/gallery.md and its pictures: `python docs/gallery.py` (a minute or two).

One picture for each built-in design, each effect of the registry and each controller; a new effect
or controller without an entry below is refused, so that none is forgotten.
"""

import io
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.patches import PathPatch

from dftfs.design import built_in_names, load_design
from dftfs.report.figures.outline_path import solid_path
from rsea_core import ActuatorModel, Inputs, Load, Reference, Rig, readings, simulate
from rsea_core import simulate_closed_loop as close
from rsea_core.control import CONTROLLERS
from rsea_core.effects.registry import LAWS
from rsea_core.simulation.reference import AngleReference

FOLDER = Path(__file__).with_name("gallery")
GREY, BLUE, VERMILION = "#8a949e", "#0072B2", "#D55E00"
RIG = Rig.preset("rsea-bench")
TIME = np.arange(3000) * 1e-3
LOCKED, PENDULUM = Load(kind="locked"), Load(kind="pendulum")
CONTACT = Load(
    kind="contact", contact_stiffness_Nm_per_rad=25.0, contact_angle_rad=0.1,
    contact_damping_Nms_per_rad=0.3,
)  # fmt: skip
ANGLES = np.linspace(-0.5, 0.5, 5)
SPRING_ANGLES = np.linspace(-0.3, 0.3, 61)
# by effect: values of its first law, x and y of the picture, load; duty is a slow sine
EFFECTS = {
    "contact-nonlinear": ({"exponent": 1.8}, "load_angle_rad", "torque_Nm", CONTACT),
    "drive-dead-zone": ({"width_duty": 0.03}, "time_s", "current_A", LOCKED),
    "drive-delay": ({"delay_s": 0.08}, "time_s", "current_A", LOCKED),
    "drive-nonlinear-gain": ({"by_sign": -0.2, "by_size": 0.5}, "time_s", "current_A", LOCKED),
    "drive-offset": ({"offset": 0.03}, "time_s", "current_A", LOCKED),
    "drive-saturation": ({"current_limit_A": 0.25}, "time_s", "current_A", LOCKED),
    "drive-thermal": (
        {"winding_heat_capacity_J_per_K": 0.1, "winding_to_case_W_per_K": 0.1},
        "time_s", "winding_temperature_C", LOCKED,
    ),
    "formula-torque": (
        {"usual_speed_rad_per_s": 2.0, "coefficient_1_Nm": 3.0, "angle_function_1": 1.0},
        "load_angle_rad", "torque_Nm", PENDULUM,
    ),
    "gear-backlash": ({"width_rad": 0.06}, "time_s", "torque_Nm", LOCKED),
    "gear-friction": ({"coulomb_Nm": 0.1}, "time_s", "motor_velocity_rad_per_s", LOCKED),
    "gear-load-friction": (
        {"lead_angle_rad": 0.07, "friction_coefficient": 0.05}, "time_s", "torque_Nm", LOCKED,
    ),
    "gear-transmission-error": (
        {"worm_amplitude_rad": 0.01}, "time_s", "torque_Nm", LOCKED,
    ),
    "load-disturbance": (
        {"start_s": 1.0, "end_s": 1.6, "peak_Nm": 3.0}, "time_s", "torque_Nm", PENDULUM,
    ),
    "load-drag": (
        {"torque_at_5_rad_per_s_Nm": 100.0}, "time_s", "torque_Nm", PENDULUM,
    ),
    "load-flexibility": (
        {"link_stiffness_Nm_per_rad": 8.0, "outer_fraction": 0.6},
        "time_s", "torque_Nm", PENDULUM,
    ),
    "load-inertia-variation": (
        {"cosine_share": 0.6, "cycles_per_rev": 8.0}, "time_s", "torque_Nm", PENDULUM,
    ),
    "load-friction": ({"coulomb_Nm": 0.6}, "time_s", "torque_Nm", PENDULUM),
    "load-friction-angle": (
        {"coulomb_Nm": 0.6, "share": 0.8}, "load_angle_rad", "torque_Nm", PENDULUM,
    ),
    "load-position-torque": (
        {"first_rad": -2.0, "last_rad": 2.0, "node_Nm": tuple(0.6 * np.sin(np.arange(32)))},
        "load_angle_rad", "torque_Nm", PENDULUM,
    ),
    "load-unbalance": ({"torque_amplitude_Nm": 1.0}, "load_angle_rad", "torque_Nm", PENDULUM),
    "motor-cogging": (
        {"amplitude_Nm": 0.02, "cycles_per_rev": 4.0}, "time_s", "current_A", LOCKED,
    ),
    "sensor-delay": (
        {"column": "torque_Nm", "delay_s": 0.1}, "read.torque_Nm", "time_s", LOCKED,
    ),
    "sensor-drift": (
        {"column": "torque_Nm", "rate_per_s": 0.8}, "read.torque_Nm", "time_s", LOCKED,
    ),
    "sensor-noise": (
        {"column": "torque_Nm", "standard_deviation": 0.3}, "read.torque_Nm", "time_s", LOCKED,
    ),
    "sensor-offset": (
        {"column": "torque_Nm", "offset": 1.0}, "read.torque_Nm", "time_s", LOCKED,
    ),
    "sensor-scale": ({"column": "torque_Nm", "scale": 1.2}, "read.torque_Nm", "time_s", LOCKED),
    "sensor-table": (
        {"column": "torque_Nm", "over": "value", "first": -10.0, "last": 10.0,
         "errors": (0.0, 2.0, -1.0, 0.0, 1.0, -2.0, 0.0)},
        "read.torque_Nm", "time_s", LOCKED,
    ),
    "spring-contact": (
        {"onset_rad": 0.05, "stiffness_ratio": 3.0}, "spring_deflection_rad", "torque_Nm", LOCKED,
    ),
    "spring-curve": (
        {"deflection_rad": SPRING_ANGLES, "torque_Nm": 65.0 * np.sinh(8 * SPRING_ANGLES) / 8,
         "tangent_Nm_per_rad": 65.0 * np.cosh(8 * SPRING_ANGLES)},
        "spring_deflection_rad", "torque_Nm", LOCKED,
    ),
    "spring-hardening": (
        {"stiffness_ratio_at_0p15rad": 2.0}, "spring_deflection_rad", "torque_Nm", LOCKED,
    ),
    "spring-hysteresis": (
        {"stiffness_1_Nm_per_rad": 40.0, "yield_1_rad": 0.02},
        "spring_deflection_rad", "torque_Nm", LOCKED,
    ),
    "spring-parallel": (
        {"stiffness_Nm_per_rad": 4.0}, "load_angle_rad", "torque_Nm", PENDULUM,
    ),
    "spring-viscoelastic": (
        {"branch_stiffness_1_Nm_per_rad": 40.0, "branch_time_1_s": 0.05},
        "spring_deflection_rad", "torque_Nm", LOCKED,
    ),
}  # fmt: skip


def design_picture(name: str) -> str:
    """Outline of a built-in design; the caption."""
    design = load_design(name)
    figure, axes = plt.subplots(figsize=(2.6, 2.6), layout="constrained")
    axes.add_patch(PathPatch(solid_path(design.outline), fc="#cfd8e3", ec="#1f2933", lw=0.7))
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.axis("off")
    _save(figure, f"design-{name}")
    return f"{design.material.name}, {1e3 * design.width_m:g} mm wide, {1e3 * design.mass_kg:.0f} g"


def effect_picture(effect: str) -> str:
    """The bench with and without an effect under the same command; the caption."""
    values, x, y, load = EFFECTS[effect]
    if x.startswith("read."):
        x, y = y, x
    inputs = Inputs(time_s=TIME, duty=0.16 * np.sin(2 * np.pi * 0.7 * TIME), load=load)
    figure, axes = _axes(x, y)
    law = next(iter(LAWS[effect].values()))
    for terms, colour, label in (((), GREY, "without"), ((law(**values),), VERMILION, "with")):
        run = simulate(ActuatorModel(RIG, terms), inputs)
        if _signal(run, y) is not None:  # only a winding that warms has a temperature
            axes.plot(_signal(run, x), _signal(run, y), color=colour, lw=1.0, label=label)
    axes.legend(fontsize=7, frameon=False)
    _save(figure, effect)
    shown = {k: f"{v:g}" for k, v in values.items() if isinstance(v, float)}
    return f"{law.law}; " + (", ".join(f"{k} = {v}" for k, v in shown.items()) or "a table")


def controller_picture(kind: str) -> str:
    """A step that the controller follows on the bench, with its default values; the caption."""
    law = CONTROLLERS[kind]()
    angle = "impedance" in kind
    reference, name = (0.35, "load_angle_rad") if angle else (5.0, "torque_Nm")
    unit = "rad" if angle else "Nm"
    kind_of = AngleReference if angle else Reference
    step = kind_of(kind="step", **{f"amplitude_{unit}": reference}, start_s=0.1)
    load = CONTACT if angle else LOCKED
    rig = replace(RIG, load_inertia_kgm2=0.1, load_viscous_Nms_per_rad=0.5) if angle else RIG
    run = close(ActuatorModel(rig), law, step, load, duration_s=1.5)
    figure, axes = _axes("time_s", name)
    axes.plot(run.time_s, run.reference, color=GREY, lw=1.0, label="reference")
    axes.plot(run.time_s, getattr(run, name), color=BLUE, lw=1.0, label=kind)
    axes.legend(fontsize=7, frameon=False)
    _save(figure, f"controller-{kind}")
    return " ".join(law.__doc__.split("\n")[0].split())


def _signal(run, name: str) -> np.ndarray:
    plain = name.removeprefix("read.")
    return getattr(run, plain) if plain == name else readings(run)[plain]


def _axes(x: str, y: str):
    figure, axes = plt.subplots(figsize=(3.2, 2.2), layout="constrained")
    axes.tick_params(labelsize=7)
    axes.set_xlabel(x, fontsize=7)
    axes.set_ylabel(y.removeprefix("read."), fontsize=7)
    return figure, axes


def _save(figure, name: str) -> None:
    FOLDER.mkdir(exist_ok=True)
    stream = io.BytesIO()
    figure.savefig(stream, dpi=110)
    plt.close(figure)
    Image.open(stream).convert("RGB").quantize(24).save(FOLDER / f"{name}.png", optimize=True)


def main() -> None:
    """Draw everything and write the page."""
    assert set(EFFECTS) == set(LAWS), sorted(set(EFFECTS) ^ set(LAWS))
    made = "Made by `python docs/gallery.py`: the thesis' bench under a slow sine of its duty;"
    lines = ["# Gallery", "", f"{made} grey is without the effect, or the reference."]
    sections = (
        ("Designs", sorted(built_in_names()), design_picture, "design-", "spring-design.md"),
        ("Effects", sorted(LAWS), effect_picture, "", "effects.md"),
        ("Controllers", CONTROLLERS, controller_picture, "controller-", "control-comparison.md"),
    )
    for title, names, draw, prefix, more in sections:
        lines += ["", f"## {title}", "", f"More: [{more}]({more}).", ""]
        lines += ["| | | |", "| --- | --- | --- |"]
        cells = [
            f"![{name}](gallery/{prefix}{name}.png)<br>**{name}**<br>{draw(name)}" for name in names
        ]
        cells += [""] * (-len(cells) % 3)
        lines += ["| " + " | ".join(cells[k : k + 3]) + " |" for k in range(0, len(cells), 3)]
    Path(__file__).with_name("gallery.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
