# %% [markdown]
# # A Panda, from its URDF to a calibrated one
#
# The URDF holds the arm as drawn. The measurements are those of another arm, whose origins are off by fractions of a millimetre and of a
# degree, made here by a few lines of numpy. What comes out is the same file with its origins moved.

# %%
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

import flexcal
import numpy as np
import pandas as pd

JOINTS = [  # xyz [m] and roll [rad] of each origin; every axis is z
    ((0, 0, 0.333), 0.0),
    ((0, 0, 0), -np.pi / 2),
    ((0, -0.316, 0), np.pi / 2),
    ((0.0825, 0, 0), np.pi / 2),
    ((-0.0825, 0.384, 0), -np.pi / 2),
    ((0, 0, 0), np.pi / 2),
    ((0.088, 0, 0), np.pi / 2),
]
LIMITS = [(-2.9, 2.9), (-1.76, 1.76), (-2.9, 2.9), (-3.07, -0.07), (-2.9, 2.9), (-0.02, 3.75), (-2.9, 2.9)]


def urdf(shift: np.ndarray, turn: np.ndarray) -> str:
    """The arm with its origins shifted [m] and turned [rad], each of shape (7, 3)."""
    joints = "".join(
        f"""
  <joint name="panda_joint{k}" type="revolute">
    <origin xyz="{" ".join(map(repr, map(float, xyz + shift[k - 1])))}" rpy="{" ".join(map(repr, map(float, (roll, 0, 0) + turn[k - 1])))}"/>
    <parent link="panda_link{k - 1}"/> <child link="panda_link{k}"/>
    <axis xyz="0 0 1"/> <limit lower="{low}" upper="{high}" effort="87" velocity="2.2"/>
  </joint> <link name="panda_link{k}"/>"""
        for k, ((xyz, roll), (low, high)) in enumerate(zip(JOINTS, LIMITS), 1)
    )
    return f"""<?xml version="1.0"?>
<!-- A skeleton of the Panda. -->
<robot name="panda"> <link name="panda_link0"/>{joints}
  <joint name="flange" type="fixed"> <origin xyz="0 0 0.107"/> <parent link="panda_link7"/> <child link="panda_link8"/> </joint>
  <link name="panda_link8"/>
</robot>
"""


def tips(text: str, q: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Where a target on the last link is, shape (poses, 3) [m]; knows nothing of flexcal."""
    rotation, position = np.tile(np.eye(3), (len(q), 1, 1)), np.zeros((len(q), 3))
    angles = iter(q.T)
    for joint in ET.fromstring(text).iter("joint"):
        origin = joint.find("origin")
        assert origin is not None
        position = position + rotation @ np.array(origin.get("xyz", "0 0 0").split(), float)
        rotation = rotation @ turned(*np.array(origin.get("rpy", "0 0 0").split(), float))
        if joint.get("type") == "revolute":
            rotation = rotation @ np.array([turned(0.0, 0.0, angle) for angle in next(angles)])
    return np.asarray(position + rotation @ target)


def turned(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Rz(yaw) Ry(pitch) Rx(roll)."""
    (r, p, y), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    return np.array(
        [[y * p, y * sp * sr - sy * r, y * sp * r + sy * sr], [sy * p, sy * sp * sr + y * r, sy * sp * r - y * sr], [-sp, p * sr, p * r]]
    )


# %%
random = np.random.default_rng(11)
nominal = urdf(np.zeros((7, 3)), np.zeros((7, 3)))
real = urdf(random.normal(0.0, 5e-4, (7, 3)), random.normal(0.0, 3e-3, (7, 3)))
folder = Path(tempfile.mkdtemp())
(folder / "panda.urdf").write_text(nominal)

low, high = np.array(LIMITS).T
q = random.uniform(low, high, (80, 7))
target = np.array([0.05, 0.02, 0.1])
measured = pd.DataFrame(q, columns=[f"panda_joint{k}_rad" for k in range(1, 8)])
measured[["x_m", "y_m", "z_m"]] = tips(real, q, target) + random.normal(0.0, 3e-5, (80, 3))

# %% [markdown]
# The problem that comes of the URDF frees what positions tell apart of the arm's geometry, the base and the target. How exact the
# instrument is it cannot know: that line of `problem.text` is one's own.

# %%
problem = flexcal.Problem.from_urdf(folder / "panda.urdf", tip="panda_link8")
problem = flexcal.Problem(problem.text.replace("position_sigma_mm = 0.05", "position_sigma_mm = 0.03"))
result = problem.identify(measured)
print(result.errors)
print(result.parameters[["nominal", "estimate", "std_error"]])
assert result.trusted

# %% [markdown]
# The same file with its origins moved; comments and all else keep every byte.

# %%
calibrated = result.export_urdf(folder / "panda.urdf")
calibrated.write(folder / "panda.calibrated.urdf")
print(calibrated.origins)
print("a URDF cannot hold:", *calibrated.not_held, sep="\n  ")

# %% [markdown]
# Distances between targets in the arm's workspace, where base and target drop out of the comparison: drawn, and calibrated.

# %%
others = random.uniform(low, high, (500, 7))
tool = np.array([result.parameters.loc[f"tool.{axis}", "estimate"] for axis in "xyz"])


def lengths(points: np.ndarray) -> np.ndarray:
    """From each point to the next."""
    return np.asarray(np.linalg.norm(np.diff(points, axis=0), axis=1))


true = lengths(tips(real, others, target))
before = 1e3 * np.abs(lengths(tips(nominal, others, target)) - true)
after = 1e3 * np.abs(lengths(tips(calibrated.text, others, tool)) - true)
print(f"mean error of a length: {before.mean():.3f} mm as drawn, {after.mean():.3f} mm calibrated")
assert after.mean() < 0.1 < before.mean()
