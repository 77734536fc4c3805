# %% [markdown]
# # From a spring to the shop
#
# A spring for 80 Nm/rad: start from the thesis' aluminium one, find the width by closed forms and
# the rod model, see what the shop's tolerances do, and write what the shop needs.

# %%
import shlex
import zipfile

from dftfs.cli.main import main


def dftfs(line):
    """A command as typed in a shell, without its progress."""
    main([*shlex.split(line), "--quiet"])


# %% [markdown]
# `dftfs new` writes a commented design; `--set` tries a change without touching the file.

# %%
dftfs("new design mine.toml")
dftfs("design mine.toml --set width_mm=8.5")

# %% [markdown]
# Stiffness goes with the width: the rod model says where 80 Nm/rad is.

# %%
import numpy as np

from dftfs.design import load_design
from dftfs.spring.rod import rod_curve

design = load_design("mine.toml")
material = design.material


def stiffness(width_mm, deflections_rad=(-1e-3, 1e-3)):
    low, high = rod_curve(
        design.outline,
        1e-3 * width_mm,
        material.youngs_modulus_Pa,
        material.poisson_ratio,
        np.array(deflections_rad),
    ).torque_Nm
    return (high - low) / (deflections_rad[1] - deflections_rad[0])


widths_mm = np.linspace(6.0, 12.0, 7)
found = [stiffness(w) for w in widths_mm]
for width, value in zip(widths_mm, found):
    print(f"{width:5.1f} mm  {value:6.2f} Nm/rad")
print(f"80 Nm/rad: {np.interp(80.0, found, widths_mm):.2f} mm")

# %%
import matplotlib.pyplot as plt

deflection = np.linspace(-0.15, 0.3, 19)
for width in (7.34, 8.9):
    curve = rod_curve(
        design.outline,
        1e-3 * width,
        material.youngs_modulus_Pa,
        material.poisson_ratio,
        deflection,
    )
    plt.plot(np.degrees(deflection), curve.torque_Nm, label=f"{width} mm wide")
plt.xlabel("deflection (°), winding positive")
plt.ylabel("torque (Nm)")
plt.legend()
plt.show()

# %% [markdown]
# What the process does to it: Monte Carlo over wire erosion's tolerances.

# %%
dftfs("tolerance mine.toml --set width_mm=8.9 --process wire-edm --samples 20000 --out spread")

# %% [markdown]
# One file for the shop: STEP, DXF with the exact outline, toleranced drawing, certificate and
# a sheet to measure the first part with. Before ordering, `dftfs study mine.toml` makes the
# finite-element report (minutes).

# %%
dftfs("deliver mine.toml --set width_mm=8.9 --process wire-edm --out shop")
print(*sorted(zipfile.ZipFile("shop/mine-A.zip").namelist()), sep="\n")
