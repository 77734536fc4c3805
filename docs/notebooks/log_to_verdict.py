# %% [markdown]
# # From a stranger's log to a verdict
#
# A log arrives as `bench.csv`, with names, units and decimal commas of its own. Here it is made by
# a simulation with dry gear friction of 20 mNm (motor side) that the rig file does not know of.

# %%
import json
import shlex
from pathlib import Path

import numpy as np

from dftfs.cli.main import main
from rsea_core import ActuatorModel, Inputs, Load, Rig, simulate
from rsea_core.effects import GearFriction


def dftfs(line):
    """A command as typed in a shell, without its progress."""
    main([*shlex.split(line), "--quiet"])


# %%
friction = GearFriction(coulomb_Nm=0.02)
machine = ActuatorModel(Rig.preset("rsea-bench"), (friction,))
time_s = np.arange(3000) * 1e-3
duty = 0.14 * np.sin(2 * np.pi * (0.2 + 0.2 * time_s) * time_s)
run = simulate(machine, Inputs(time_s=time_s, duty=duty, load=Load(kind="locked")))
noise = np.random.default_rng(1)
columns = {
    "t [ms]": 1e3 * time_s,
    "PWM [%]": 100 * duty,
    "motor [deg]": np.degrees(run.encoder_motor_angle_rad),
    "I [mA]": 1e3 * (run.current_A + 5e-3 * noise.standard_normal(time_s.size)),
    "torque [Nm]": run.torque_Nm + 0.03 * noise.standard_normal(time_s.size),
}
text = ";".join(columns) + "\n"
text += "\n".join(";".join(f"{v:.5g}" for v in row) for row in zip(*columns.values()))
Path("bench.csv").write_text(text.replace(".", ","), encoding="utf-8")
print(Path("bench.csv").read_text()[:190])

# %% [markdown]
# The importer proposes column, unit and sign, each with how sure it is; what is not sure it
# asks, and `--yes` takes every proposal. The rig file has the data sheets' values.

# %%
dftfs("new rig data-sheets.toml")
dftfs("import bench.csv --rig data-sheets.toml --load locked --yes --out case")

# %% [markdown]
# Is the log healthy? Then: where does it differ from the simulation, and which physics is missing?

# %%
dftfs("doctor case --no-slips")

# %%
dftfs("diagnose case --quick --out found")

# %%
verdict = json.loads(Path("found/diagnosis.json").read_text())
print(verdict["verdict"])
for effect in verdict["effects"]:
    print(effect["name"], f"confidence {effect['confidence']:.2f}")
    for name, entry in effect["parameters"].items():
        print(f"  {name} = {entry['value']:.4g} ± {entry['std']:.2g}")

# %% [markdown]
# 20 mNm were put in. Without `--quick` every candidate is fitted in full (minutes for long logs).
# `found/report.html` shows why; `found/model.toml` is the corrected machine, to be simulated and
# controlled. What it will read under new inputs: `dftfs predict found/model.toml TEST/`.
