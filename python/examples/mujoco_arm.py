# %% [markdown]
# # An arm of MuJoCo
#
# The measurements come from a MuJoCo model whose second link is 3 mm longer, whose third joint is 0.4° off, and which stands elsewhere than
# one thinks. flexcal knows the nominal arm, finds all that from 40 end points, and the model gets the corrected numbers.

# %%
import flexcal
import mujoco
import numpy as np

MODEL = """
<mujoco>
  <worldbody>
    <body name="turret" pos="{base}">
      <joint name="q1" axis="0 0 1"/> <geom size="0.05"/>
      <body name="upper" pos="0 0 0.4" euler="90 0 0">
        <joint name="q2" axis="0 0 1"/> <geom size="0.05"/>
        <body name="fore" pos="{upper} 0 0" euler="0 0 {elbow}">
          <joint name="q3" axis="0 0 1"/> <geom size="0.05"/>
          <site name="tool" pos="0.35 0.04 0.02"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def positions(model: mujoco.MjModel, q: np.ndarray) -> np.ndarray:
    """Where the site is, shape (poses, 3) [m]."""
    data = mujoco.MjData(model)
    points = []
    for data.qpos[:] in q:
        mujoco.mj_kinematics(model, data)
        points.append(data.site("tool").xpos.copy())
    return np.array(points)


# %%
random = np.random.default_rng(7)
q = random.uniform(-2.5, 2.5, (60, 3))
real = mujoco.MjModel.from_xml_string(MODEL.format(base="0.021 -0.013 0.008", upper=0.503, elbow=0.4))
measured = positions(real, q) + random.normal(0.0, 30e-6, (60, 3))

problem = flexcal.Problem("""
name = "mujoco-arm"
joint = [
    { name = "q1", d_m = 0.4 },
    { name = "q2", alpha_deg = 90.0 },
    { name = "q3", a_m = 0.5 },
]
tool.target_m = [0.35, 0.04, 0.02]

[parameters]
"joint3.a" = { sigma_mm = 10.0 }
"joint*.theta" = { sigma_deg = 1.0 }
"joint2.alpha" = { sigma_deg = 1.0 }
"base.x" = { free = true }
"base.y" = { free = true }
"base.z" = { free = true }

[data]
position_sigma_mm = 0.03
held_out = { fraction = 0.33, seed = 1 }
""")
nominal = mujoco.MjModel.from_xml_string(MODEL.format(base="0 0 0", upper=0.5, elbow=0.0))
assert np.abs(positions(nominal, q) - problem.predict(q)).max() < 1e-12, "both mean the same arm"

# %%
result = problem.identify({"q_rad": q, "xyz_m": measured})
print(result.parameters[["nominal", "estimate", "std_error"]])
print(result.errors)

# %% [markdown]
# Back into the model: lengths and angles as they were found.

# %%
found = result.parameters["estimate"]
base = " ".join(str(found[f"base.{axis}"]) for axis in "xyz")
calibrated = MODEL.format(base=base, upper=found["joint3.a"], elbow=np.rad2deg(found["joint3.theta"]))
better = positions(mujoco.MjModel.from_xml_string(calibrated), q)
print("mean error of the calibrated model:", 1e3 * np.linalg.norm(better - positions(real, q), axis=1).mean(), "mm")
