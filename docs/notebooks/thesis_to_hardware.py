# %% [markdown]
# # From the thesis to the hardware
#
# The thesis prints numbers and gains. Which of them come out when they are computed again? Then its
# spring and a torque loop go to C that a bench replays bit by bit.

# %%
import shlex
from pathlib import Path

from dftfs.cli.main import main


def dftfs(line):
    """A command as typed in a shell, without its progress."""
    main([*shlex.split(line), "--quiet"])


# %% [markdown]
# Every number that can be recomputed, with a verdict (here by the rod model; `--model 3d` takes the
# finite elements). [The whole table](../thesis.md) has an erratum for each that does not come out.

# %%
dftfs("thesis --model rod --only spring")

# %% [markdown]
# Its aluminium spring in an actuator, at 5 Nm and 1 Hz against a locked output.

# %%
scenario = """
name = "thesis"
rig = "rsea-bench"
load = {kind = "locked"}
reference = {kind = "sine", amplitude_Nm = 5.0, frequency_Hz = 1.0}
simulation = {duration_s = 1.0, judge_from_s = 0.3}

[spring]
design = "al1"

[controller]
kind = "pid-torque"
kp = 6.0
ki = 10.0
sample_time_s = 0.001
delay_samples = 1
"""
Path("thesis.toml").write_text(scenario)
dftfs("simulate thesis.toml --out simulated")

# %% [markdown]
# The same loop as C99 with a guard between readings, law and drive. The bench that comes with it is
# compiled here, replays the simulation and injects each fault.

# %%
dftfs("deploy thesis.toml --out firmware")
print(*sorted(p.name for p in Path("firmware").iterdir()), sep="\n")

# %% [markdown]
# `firmware/rig.toml` and `log.csv` are a case: the machine's own log takes its place, and
# `dftfs diagnose firmware` says where the real machine differs. The circle is closed by
# `tests/dftfs/cli/test_deploy.py`.
