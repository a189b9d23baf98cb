"""Converts public measurements of robot arms into problems of flexcal, with fixed splits. Fetches nothing.

    python convert.py SET DOWNLOAD OUT [--urdf PANDA.URDF]

SET is one of ur10-ipa, ur5, mukca-panda-2, ur5e-factory, franka-fr3-camera. DOWNLOAD is the folder that holds the clone or the files of the set,
OUT the folder that problem.toml and measurements.csv are written to. docs/benchmark.md says where to get each set.
"""

from __future__ import annotations

import argparse
import io
import pickle
import sys
from pathlib import Path
from typing import Any

import flexcal
import numpy as np
import pandas as pd

ROOT = Path(__file__).parents[2]
FRONT = ("front_center", "front_left", "front_right")
"""Placements of the sockets that are fitted; the six others judge."""
UR5_COUNTS = {"grid": "identification", "random": "validation"}

UR5 = """
name = "ur5"
title = "UR5, laser tracker GTS3800, Tsinghua"
[[joint]]
d_m = 0.089159
body = [{ name = "shoulder", mass_kg = 3.7, com_m = [0, 0, 0] }]
[[joint]]
alpha_deg = 90
body = [{ name = "upper arm", mass_kg = 8.393, com_m = [-0.2125, 0, 0.11336] }]
[[joint]]
a_m = -0.425
body = [{ name = "forearm", mass_kg = 2.275, com_m = [-0.15, 0, 0.0265] }]
[[joint]]
a_m = -0.39225
d_m = 0.10915
body = [{ name = "wrist 1", mass_kg = 1.219, com_m = [0, 0, 0] }]
[[joint]]
alpha_deg = 90
d_m = 0.09465
body = [{ name = "wrist 2", mass_kg = 1.219, com_m = [0, 0, 0] }]
[[joint]]
alpha_deg = -90
d_m = 0.0823
body = [{ name = "wrist 3", mass_kg = 0.1879, com_m = [0, 0, -0.025] }]
[tool]
target_m = [0, 0, 0.031]
[parameters]
"joint*.alpha" = { sigma_deg = 0.5 }
"joint*.a" = { sigma_mm = 3 }
"joint*.theta" = { sigma_deg = 0.5 }
"joint*.d" = { sigma_mm = 3 }
"joint*.beta" = { sigma_deg = 0.5 }
"tool.*" = { sigma_mm = 5 }
"base.*" = { free = true }
[data]
files = ["measurements.csv"]
position_sigma_mm = 0.03
held_out = { column = "split" }
"""

UR5E = """
name = "ur5e-factory"
title = "UR5e, 18 poses as the calibrated controller reports them"
dh = "standard"
joint = [
    { alpha_deg = 90, d_m = 0.1625 }, { a_m = -0.425 }, { a_m = -0.3922 },
    { alpha_deg = 90, d_m = 0.1333 }, { alpha_deg = -90, d_m = 0.0997 }, { d_m = 0.0996 },
]
[parameters]
"joint*.alpha" = { sigma_deg = 0.5 }
"joint*.a" = { sigma_mm = 2 }
"joint*.theta" = { sigma_deg = 0.5 }
"joint*.d" = { sigma_mm = 2 }
"joint3.beta" = { sigma_deg = 0.5 }
"joint4.beta" = { sigma_deg = 0.5 }
"joint1.alpha" = { fixed = true }
"joint1.a" = { fixed = true }
[data]
files = ["measurements.csv"]
position_sigma_mm = 0.01
orientation_sigma_deg = 0.03
held_out = { fraction = 0.3, seed = 1 }
"""


def ur10(download: Path) -> tuple[str, pd.DataFrame]:
    """Three sessions of a UR10; 5000 rows of series A."""
    kept = set(map(int, (ROOT / "problems" / "ur10-ipa" / "rows_A.txt").read_text().split()))
    joints = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
    names = {f"{joint}_joint": f"q{k}_rad" for k, joint in enumerate(joints, 1)}
    names |= {f"measurement_{axis}": f"{axis}_mm" for axis in "xyz"}
    files = ("Series_A/measurements_grid.csv", "Series_B/measurements_joint_configurations.csv", "Series_C/measurements_random_poses.csv")
    tables = []
    for session, file in zip("ABC", files, strict=True):
        table = pd.read_csv(download / file, sep=";", decimal=",")[list(names)].rename(columns=names)
        table.insert(0, "pose", np.arange(1, len(table) + 1))
        table.insert(0, "session", session)
        tables.append(table[table["pose"].isin(kept)] if session == "A" else table)
    text = (ROOT / "problems" / "ur10-ipa" / "problem.toml").read_text()
    return text, pd.concat(tables, ignore_index=True)


def ur5(download: Path) -> tuple[str, pd.DataFrame]:
    """A UR5: 1000 grid poses to fit, 20 random ones held out. Their columns x_dif … are measured − target [mm]."""
    tables = []
    for poses, split in UR5_COUNTS.items():
        table = pd.read_csv(download / f"3D_UR5_uncalibrated_{poses}_cleaned.csv")
        columns = {f"q{k}_deg": table[f"joint_{k}"] for k in range(1, 7)}
        columns |= {f"{axis}_mm": table[f"{axis}_t"] + table[f"{axis}_dif"] for axis in "xyz"}
        tables.append(pd.DataFrame(columns).assign(split=split))
    return UR5, pd.concat(tables, ignore_index=True)


def mukca(download: Path, urdf: Path | None) -> tuple[str, pd.DataFrame]:
    """A Panda whose ball sits in one of two sockets 50 mm apart, in nine placements; three in front are fitted."""
    columns = [f"panda_joint{k}_rad" for k in range(1, 8)]
    tables, places = [], []
    for file in sorted(download.rglob("*hole_[01].csv")):
        place = file.stem.removeprefix("panda_2-").removesuffix(file.stem[-7:]) or file.parent.name
        point = f"{place}_{file.stem[-1]}"
        split = "identification" if place in FRONT else "validation"
        tables.append(pd.read_csv(file, names=columns).assign(point=point, split=split))
        places.append(place)
    text = from_urdf(urdf or download / "panda.urdf", "")
    text = text.replace("target_m = [0, 0, 0]", "target_m = [0, 0, 0.1335]")
    text = text.replace('"tool.*" = { sigma_mm = 100.0 }', '"tool.*" = { sigma_mm = 5 }')
    text = text.replace('"base.*" = { free = true }', '"base.*" = { fixed = true }')
    for place in sorted(set(places)):
        text += f'[[point]]\nname = "{place}_0"\n[[point]]\nname = "{place}_1"\n'
        text += f'[[distance]]\nbetween = ["{place}_0", "{place}_1"]\nmm = 50.0\n'
    return text, pd.concat(tables, ignore_index=True)


def ur5e(download: Path) -> tuple[str, pd.DataFrame]:
    """18 poses of a UR5e as its calibrated controller reports them."""
    table = pd.read_csv(download / "data" / "joint-eef-data.csv")
    table.columns = pd.Index([*(f"q{k}_deg" for k in range(1, 7)), "x_mm", "y_mm", "z_mm", "rx_rad", "ry_rad", "rz_rad"])
    return UR5E, table


def franka(download: Path, urdf: Path | None) -> tuple[str, pd.DataFrame]:
    """114 poses of a camera on the hand of an FR3, in the frame of a board."""
    with open(download / "Examples" / "calib_data.pickle", "rb") as file:
        held = ArraysOnly(io.BytesIO(file.read())).load()
    poses = np.array([np.asarray(getattr(pose, "A", pose)) for pose in held["camera_poses"]], dtype=np.float64)
    table = pd.DataFrame(np.asarray(held["joint_positions"], np.float64), columns=[f"panda_joint{k}_rad" for k in range(1, 8)])
    table[["x_m", "y_m", "z_m"]] = poses[:, :3, 3]
    if urdf is None:
        raise SystemExit("franka-fr3-camera needs --urdf: the panda.urdf of example-robot-data")
    text = from_urdf(urdf, "position_sigma_mm = 1\nheld_out = { fraction = 0.3, seed = 1 }\n")
    return text.replace("target_m = [0, 0, 0]", "target_m = [0.0945, -0.009, 0.0405]"), table


class ArraysOnly(pickle.Unpickler):
    """Reads pickled arrays and refuses everything else, which could run code."""

    def find_class(self, module: str, name: str) -> Any:
        if module.partition(".")[0] == "numpy" and name in ("_reconstruct", "ndarray", "dtype", "scalar"):
            return super().find_class(module, name)
        raise pickle.UnpicklingError(f"{module}.{name} is no array")


def from_urdf(urdf: Path, data: str) -> str:
    """The problem of a Panda's chain; ``data`` are the lines of its last section, [data]."""
    text = flexcal.Problem.from_urdf(urdf, tip="panda_link8").text
    return f'{text[: text.index("[data]")]}[data]\nfiles = ["measurements.csv"]\n{data}'


def with_split(text: str, table: pd.DataFrame) -> tuple[str, pd.DataFrame]:
    """Problem and table with the held-out rows in a column, for every program alike."""
    if "split" not in table:
        fitted = set(flexcal.Problem(text).least_squares(table).rows["row"])
        table["split"] = ["identification" if row in fitted else "validation" for row in range(len(table))]
    lines = [line for line in text.splitlines() if not line.startswith(("held_out", "files"))]
    place = lines.index("[data]") + 1
    lines[place:place] = ['files = ["measurements.csv"]', 'held_out = { column = "split" }']
    return "\n".join(lines) + "\n", table


SETS = {"ur10-ipa": ur10, "ur5": ur5, "ur5e-factory": ur5e}
SETS_OF_A_PANDA = {"mukca-panda-2": mukca, "franka-fr3-camera": franka}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("set", choices=[*SETS, *SETS_OF_A_PANDA])
    parser.add_argument("download", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--urdf", type=Path)
    given = parser.parse_args()
    if given.set in SETS:
        text, table = SETS[given.set](given.download)
    else:
        text, table = SETS_OF_A_PANDA[given.set](given.download, given.urdf)
    text, table = with_split(text, table)
    given.out.mkdir(parents=True, exist_ok=True)
    (given.out / "problem.toml").write_text(text)
    table.to_csv(given.out / "measurements.csv", index=False)
    held_out = int((table["split"] == "validation").sum())
    sys.stdout.write(f"{given.out}: {len(table)} rows, {held_out} of them held out\n")


if __name__ == "__main__":
    main()
