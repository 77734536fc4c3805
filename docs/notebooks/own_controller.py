# %% [markdown]
# # Your own controller on your own machine
#
# A machine from its data sheets, a control law of your own in a few lines, its margins, its
# simulation beside the built-in PID, and C code of it.

# %%
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import rsea_core
from rsea_core import (
    ActuatorModel,
    Load,
    PidTorque,
    Reference,
    Rig,
    loop_margins,
    simulate_closed_loop,
)

# %% [markdown]
# Your machine: a preset with your values, or `Rig.from_toml` of a file that
# `dftfs new rig my-rig.toml` began.

# %%
bench = Rig.preset("rsea-bench")
rig = replace(bench, gear_ratio=50.0, spring_stiffness_Nm_per_rad=80.0)
machine = ActuatorModel(rig)
print(machine.describe())


# %% [markdown]
# Your law: class attributes are its parameters, which files set and `dftfs tune` searches.


# %%
@rsea_core.controller(sample_time_s=1e-3)
class MyLaw:
    kp: float = 60.0
    ki: float = 10.0
    state = {"integral": 0.0}

    def design(self, machine):
        return {"scale": machine.command_per_Nm, "T": machine.sample_time_s}

    def step(self, y):
        error = y.reference - y.torque_Nm
        self.integral += self.ki * self.T * error
        return self.scale * (y.reference + self.kp * error + self.integral)


# %% [markdown]
# Sampled, with one sample of delay: how far from unstable is each loop?

# %%
load = Load(kind="locked")
laws = {"mine": MyLaw(kp=100.0), "built-in PID": PidTorque(kp=6.0, ki=10.0, sample_time_s=1e-3)}
for name, law in laws.items():
    margins = loop_margins(machine, law, load)
    print(
        f"{name}: crossover {margins.crossover_Hz:.2f} Hz,"
        f" gain margin {margins.gain_margin_dB:.1f} dB,"
        f" phase margin {margins.phase_margin_deg:.1f}°, largest pole {margins.pole_radius:.4f}"
    )

# %%
reference = Reference(kind="sine", amplitude_Nm=5.0, frequency_Hz=2.0)
figure, (upper, lower) = plt.subplots(2, 1, sharex=True)
for name, law in laws.items():
    run = simulate_closed_loop(machine, law, reference, load, duration_s=2.0)
    error = run.reference - run.torque_Nm
    print(f"{name}: RMSE {np.sqrt(np.mean(error[run.time_s > 0.5] ** 2)):.4f} Nm")
    upper.plot(run.time_s, run.torque_Nm, label=name)
    lower.plot(run.time_s, error)
upper.plot(run.time_s, run.reference, "k:", label="reference")
upper.set_ylabel("torque (Nm)")
lower.set_ylabel("error (Nm)")
lower.set_xlabel("time (s)")
upper.legend()
plt.show()

# %% [markdown]
# The same law in a file, `kind = "my_law:MyLaw"`, is simulated with a page (`dftfs simulate`),
# tuned beside others (`dftfs tune`, `dftfs compare`) and written as guarded C (`dftfs deploy`).
