# %% [markdown]
# # A UR10 and a laser tracker
#
# Three sessions with 9268 poses; `problems/ur10-ipa/README.md` says where to get them. `FLEXCAL_UR10` is the folder that holds them.

# %%
import os
import sys
import warnings
from pathlib import Path

import flexcal
import matplotlib.pyplot as plt
import pandas as pd

ROOT = Path(__file__).parents[2] if "__file__" in globals() else Path.cwd()
folder = Path(os.environ.get("FLEXCAL_UR10", ROOT.parent / "shared" / "measured" / "ur10-ipa"))
files = [folder / f"session_{letter}.csv" for letter in "ABC"]
if not all(file.exists() for file in files):
    print("skipped: the UR10's measurements are not here")
    sys.exit()

# %%
problem = flexcal.Problem(ROOT / "problems" / "ur10-ipa")
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    result = problem.identify(files)
print(*{str(warning.message) for warning in caught}, sep="\n")
print(result.errors)

# %% [markdown]
# The scatter is ten times the tracker's noise: the model lacks something. What is left depends on the joints' angles, as the waves of
# harmonic drives do; `problem.loop(files)` finds them, in some minutes.

# %%
residuals = result.residuals
angles = pd.concat([pd.read_csv(file) for file in files], ignore_index=True)
figure, axes = plt.subplots(figsize=(8, 4))
for session, own in residuals.groupby("session", observed=True):
    axes.plot(angles["q2_rad"][own.index], own["residual_z_mm"], ".", markersize=1, label=f"session {session}")
axes.set(xlabel="q2, rad", ylabel="residual z, mm")
axes.legend(markerscale=8)
plt.show()
