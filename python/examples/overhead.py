# %% [markdown]
# # What Python adds to a fit
#
# A UR10 with 27 free parameters and 1000 poses in a DataFrame: the time of `problem.identify(frame)`, which reads and checks the table,
# beside that of the fit within it, and beside the command line with the same poses in a file. `python overhead.py 1000000` counts memory
# instead.

# %%
import resource
import subprocess
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import flexcal
import numpy as np
import pandas as pd

LINKS = [(0, 0, 0.1273), (90, 0, 0), (0, -0.612, 0), (0, -0.5723, 0.1639), (90, 0, 0.1157), (-90, 0, 0.0922)]
TEXT = f"""
name = "ur10"
{"".join(f"[[joint]]{chr(10)}alpha_deg = {alpha}{chr(10)}a_m = {a}{chr(10)}d_m = {d}{chr(10)}" for alpha, a, d in LINKS)}
[tool]
target_m = [0.05, 0.02, 0.1]
[parameters]
"*" = {{ free = true }}
"base.*" = {{ fixed = true }}
"*.beta" = {{ fixed = true }}
[data]
files = ["measurements.csv"]
position_sigma_mm = 0.05
held_out = {{ fraction = 0.1, seed = 1 }}
"""


def poses(problem: flexcal.Problem, count: int) -> pd.DataFrame:
    """Measurements of an arm whose joints are off by waves."""
    random = np.random.default_rng(0)
    q = random.uniform(-2.5, 2.5, (count, 6))
    frame = pd.DataFrame(q, columns=[f"q{k}_rad" for k in range(1, 7)])
    frame[["x_m", "y_m", "z_m"]] = problem.predict(q + 5e-4 * np.cos(q)) + random.normal(0.0, 5e-5, (count, 3))
    return frame


def best(work: Callable[[], object], times: int = 20) -> float:
    """The shortest time of several runs [s]."""

    def once() -> float:
        begin = time.perf_counter()
        work()
        return time.perf_counter() - begin

    return min(once() for _ in range(times))


# %%
problem = flexcal.Problem(TEXT)
count = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
frame = poses(problem, count)
if count > 100_000:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    tracemalloc.start()
    problem.identify(frame)
    print(f"{count} rows of {frame.shape[1]} columns, {frame.memory_usage().sum() / 1e6:.0f} MB")
    print(f"largest of Python's own memory meanwhile: {tracemalloc.get_traced_memory()[1] / 1e6:.0f} MB")
    print(f"more of the whole process: {(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - peak) / 1e3:.0f} MB")
else:
    fits: list[flexcal.Identification] = []
    whole = best(lambda: fits.append(problem.identify(frame)))
    core = min(fit.to_dict()["seconds"] for fit in fits)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "problem.toml").write_text(TEXT)
        frame.to_csv(Path(folder) / "measurements.csv", index=False)
        command = [sys.executable, "-m", "flexcal", "identify", folder, "--out", f"{folder}/out", "--quiet"]
        program = best(lambda: subprocess.run(command, check=True), 3)
    print(f"fit {core:.4f} s, with the reading and checking of the frame {whole:.4f} s; command line, with its report, {program:.2f} s")
