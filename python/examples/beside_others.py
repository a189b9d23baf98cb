# %% [markdown]
# # The same arm and the same data by flexcal, SciPy, pybotics and FIGAROH
#
# A UR10 with errors in every length and angle, 100 measured positions with a noise of 0.05 mm, and 25 more that flexcal holds out to judge by.
# The error is that of 1000 other positions without noise. Each tool as its documentation has it; the lines of each function are what
# its user writes.

# %%
import contextlib
import inspect
import io
import logging
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import flexcal
import numpy as np
import yaml
from figaroh.calibration.base_calibration import BaseCalibration
from figaroh.calibration.calibration_tools import calc_updated_fkm
from figaroh.tools.load_robot import load_robot
from pybotics.optimization import OptimizationHandler, optimize_accuracy
from pybotics.robot import Robot
from scipy.optimize import least_squares

Array = np.ndarray
# alpha, a, theta, d of Rx(alpha) Tx(a) Rz(theta + q) Tz(d), and the tool [rad, m]
RIGHT = np.pi / 2
NOMINAL = np.array(
    [
        [0.0, 0.0, 0.0, 0.1273],
        [RIGHT, 0.0, 0.0, 0.0],
        [0.0, -0.612, 0.0, 0.0],
        [0.0, -0.5723, 0.0, 0.1639],
        [RIGHT, 0.0, 0.0, 0.1157],
        [-RIGHT, 0.0, 0.0, 0.0922],
    ]
)
TOOL = np.array([0.05, 0.02, 0.1])


def positions(links: Array, tool: Array, q: Array) -> Array:
    """Where the tool is, shape (poses, 3) [m]; from the last frame inwards."""
    point = np.tile(tool, (len(q), 1))
    for (alpha, a, theta, d), angle in zip(links[::-1], q.T[::-1]):
        sin, cos = np.sin(theta + angle), np.cos(theta + angle)
        x, y, z = cos * point[:, 0] - sin * point[:, 1] + a, sin * point[:, 0] + cos * point[:, 1], point[:, 2] + d
        point = np.stack([x, np.cos(alpha) * y - np.sin(alpha) * z, np.sin(alpha) * y + np.cos(alpha) * z], axis=1)
    return point


random = np.random.default_rng(3)
TRUE = NOMINAL + random.normal(0.0, [1e-3, 1e-3, 1e-3, 1e-3], NOMINAL.shape)
TRUE_TOOL = TOOL + random.normal(0.0, 1e-3, 3)
ALL, JUDGED = random.uniform(-2.5, 2.5, (125, 6)), random.uniform(-2.5, 2.5, (1000, 6))
ALL_MEASURED = positions(TRUE, TRUE_TOOL, ALL) + random.normal(0.0, 50e-6, (125, 3))
SPLIT = np.where(np.arange(125) < 100, "identification", "validation")
Q, MEASURED = ALL[:100], ALL_MEASURED[:100]
FOLDER = Path(tempfile.mkdtemp())


# %%
def by_flexcal() -> Array:
    joints = "\n".join(
        f"[[joint]]\nalpha_rad = {alpha}\na_m = {a}\ntheta_rad = {theta}\nd_m = {d}" for alpha, a, theta, d in NOMINAL
    )
    problem = flexcal.Problem(f"""
name = "ur10"
{joints}
[tool]
target_m = {TOOL.tolist()}
[parameters]
"*" = {{ free = true }}
"base.*" = {{ fixed = true }}
"*.beta" = {{ fixed = true }}
[data]
position_sigma_mm = 0.05
""")
    return problem.identify({"q_rad": ALL, "xyz_m": ALL_MEASURED, "split": SPLIT}).predict(JUDGED)


# %%
def by_scipy() -> Array:
    start = np.concatenate([NOMINAL.ravel(), TOOL])

    def residuals(x: Array) -> Array:
        return (positions(x[:-3].reshape(6, 4), x[-3:], Q) - MEASURED).ravel() / 50e-6

    x = least_squares(residuals, start, x_scale="jac").x
    return positions(x[:-3].reshape(6, 4), x[-3:], JUDGED)


# %%
def by_pybotics() -> Array:
    millimetres = NOMINAL * [1.0, 1e3, 1.0, 1e3]
    robot = Robot.from_parameters(millimetres.ravel())
    robot.tool.position = 1e3 * TOOL
    handler = OptimizationHandler(robot, kinematic_chain_mask=True, tool_mask=[True] * 3 + [False] * 3)
    start = handler.generate_optimization_vector()
    result = least_squares(optimize_accuracy, start, args=(handler, Q, 1e3 * MEASURED))
    handler.apply_optimization_vector(result.x)
    return np.array([1e-3 * handler.robot.fk(q)[:3, 3] for q in JUDGED])


# %%
def by_figaroh() -> Array:
    links = "".join(f'<link name="l{k}"/>' for k in range(8))
    bodies = "".join(
        f'<joint name="j{k + 1}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/><axis xyz="0 0 1"/>'
        f'<origin rpy="{alpha} 0 0" xyz="{a} {-np.sin(alpha) * d} {np.cos(alpha) * d}"/>'
        '<limit lower="-6" upper="6" effort="1" velocity="1"/></joint>'
        for k, (alpha, a, _, d) in enumerate(NOMINAL)
    )
    tool = f'<joint name="t" type="fixed"><parent link="l6"/><child link="l7"/><origin xyz="{" ".join(map(str, TOOL))}"/></joint>'
    (FOLDER / "ur10.urdf").write_text(f'<robot name="ur10">{links}{bodies}{tool}</robot>')
    names = ["x1", "y1", "z1", *(f"j{k}" for k in range(1, 7))]
    np.savetxt(FOLDER / "data.csv", np.hstack([MEASURED, Q]), delimiter=",", header=",".join(names), comments="")
    task = {
        "type": "kinematic_calibration",
        "kinematics": {"base_frame": "universe", "tool_frame": "l7"},
        "joints": {"active_joints": names[3:]},
        "measurements": {
            "markers": [{"measurable_dof": [True] * 3 + [False] * 3}],
            "poses": {"base_pose": [0.0] * 6, "tool_pose": [0.0] * 6},
        },
        "parameters": {"calibration_level": "full_params"},
        "data": {"source_file": str(FOLDER / "data.csv"), "number_of_samples": len(Q)},
    }
    (FOLDER / "config.yaml").write_text(yaml.dump({"robot": {"name": "ur10"}, "tasks": {"calibration": task}}))

    class Calibration(BaseCalibration):  # type: ignore[misc]
        def cost_function(self, var: Array) -> Array:
            predicted = calc_updated_fkm(self.model, self.data, var, self.q_measured, self.calib_config)
            return np.asarray(self.PEE_measured - predicted)

    calibration = Calibration(load_robot(str(FOLDER / "ur10.urdf")), str(FOLDER / "config.yaml"))
    calibration.calib_config.update(known_baseframe=True, known_tipframe=False)
    calibration.initialize()
    calibration.solve(enable_logging=False)
    calibration.calib_config["NbSample"] = len(JUDGED)
    judged = calc_updated_fkm(calibration.model, calibration.data, calibration.LM_result.x, JUDGED, calibration.calib_config)
    return np.asarray(judged).reshape(3, -1).T


# %%
def timed(tool: Callable[[], Array]) -> tuple[float, Array]:
    """The time that a tool takes [s], and what it predicts [m]."""
    begin = time.perf_counter()
    with contextlib.redirect_stdout(io.StringIO()):
        predicted = tool()
    return time.perf_counter() - begin, predicted


def measure(tools: list[Callable[[], Array]], rounds: int = 5) -> None:
    """Prints lines, time and error of each tool: the median of rounds in which they take turns, as other work slows all of them."""
    runs = [[timed(tool) for tool in tools] for _ in range(rounds)]
    for k, tool in enumerate(tools):
        took = float(np.median([run[k][0] for run in runs]))
        ratio = float(np.median([run[k][0] / run[0][0] for run in runs]))
        error = 1e3 * np.linalg.norm(runs[0][k][1] - positions(TRUE, TRUE_TOOL, JUDGED), axis=1)
        lines = len(inspect.getsource(tool).splitlines()) - 1
        print(
            f"{tool.__name__[3:]:10} {lines:3} lines {took:9.3f} s {ratio:7.1f} times flexcal's   "
            f"mean error {error.mean():.4f} mm, largest {error.max():.4f} mm"
        )


if __name__ == "__main__":
    logging.disable()
    warnings.simplefilter("ignore")
    before = 1e3 * np.linalg.norm(positions(NOMINAL, TOOL, JUDGED) - positions(TRUE, TRUE_TOOL, JUDGED), axis=1)
    print(f"nominal: mean error {before.mean():.4f} mm")
    measure([by_flexcal, by_scipy, by_pybotics, by_figaroh])
