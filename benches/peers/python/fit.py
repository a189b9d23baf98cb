"""The fit of benches/fit.rs by tools for Python.

    fit.py <csv> <scipy|scipy-jac|dogbox|lmfit|pybotics> <repeats>

Prints the median time in milliseconds, the final cost 1/2 |r|^2 and the number of evaluations that the tool reports.

scipy      least_squares, its default "trf" with its default forward differences, on residuals vectorised in numpy
scipy-jac  the same with a Jacobian by hand, vectorised in numpy
dogbox     the same by its method "dogbox"
           All three keep the bounds of the file, and take SciPy's loss of the same name; that counts coordinates by themselves, not
           poses, so that its optimum is another one: the cost that is printed is flexcal's at that point.
lmfit      minimize, its default "leastsq" (MINPACK) with forward differences, on the same residuals; with its covariance;
           bounds by its transforms
pybotics   optimize_accuracy by least_squares, as its documentation has it: one distance a pose, forward differences,
           millimetres; a beta is a further link of pybotics' own kind, whose joint does not move
"""

import statistics
import sys
import time

import lmfit
import numpy as np
from arm import JOINTS, Arm
from pybotics.optimization import OptimizationHandler, optimize_accuracy
from pybotics.robot import Robot
from scipy.optimize import least_squares

TOLERANCES = {"ftol": 1e-12, "xtol": 1e-10, "gtol": 1e-10}


def by_scipy(arm, jacobian, method="trf"):
    more = {} if arm.bounds is None else {"bounds": tuple(arm.bounds)}
    if arm.loss == "huber":
        more.update(loss="huber", f_scale=arm.numbers[0])
    elif arm.loss == "l1":
        more.update(loss="soft_l1", f_scale=arm.numbers[1])
    found = least_squares(arm.residuals, np.zeros(len(arm.unknowns)), jac=jacobian, method=method, **more, **TOLERANCES)
    return found.x, found.nfev


def by_lmfit(arm):
    parameters = lmfit.Parameters()
    for column, k in enumerate(arm.unknowns):
        limits = {} if arm.bounds is None else {"min": arm.bounds[0, column], "max": arm.bounds[1, column]}
        parameters.add(f"x{k}", value=0.0, **limits)

    def residuals(parameters):
        return arm.residuals(np.array(list(parameters.valuesdict().values())))

    found = lmfit.minimize(residuals, parameters, **TOLERANCES)
    return np.array(list(found.params.valuesdict().values())), found.nfev


def by_pybotics(arm):
    # Ry(beta) = Rz(90°) Rx(beta) Rz(-90°): the joint turns 90° further, a link with alpha = beta turns back.
    links, target = arm.values(np.zeros(len(arm.unknowns)))
    free = np.zeros(len(arm.nominal), dtype=bool)
    free[arm.unknowns] = True
    chain, mask, owner, columns = [], [], [], []
    for i, (alpha, a, theta, d, beta) in enumerate(links):
        bends = beta != 0.0 or free[5 * i + 4]
        chain += [alpha, 1e3 * a, theta + bends * np.pi / 2, 1e3 * d]
        mask += list(free[5 * i : 5 * i + 4])
        owner += list(range(5 * i, 5 * i + 4))
        columns.append(arm.q[:, i])
        if bends:
            chain += [beta, 0.0, -np.pi / 2, 0.0]
            mask += [free[5 * i + 4], False, False, False]
            owner += [5 * i + 4, -1, -1, -1]
            columns.append(np.zeros(len(arm.q)))
    robot = Robot.from_parameters(np.array(chain))
    robot.tool.position = 1e3 * target
    handler = OptimizationHandler(robot, kinematic_chain_mask=mask, tool_mask=[*free[-3:], False, False, False])
    start = handler.generate_optimization_vector()
    arguments = (handler, np.stack(columns, axis=1), 1e3 * arm.measured)
    found = least_squares(optimize_accuracy, start, args=arguments, **TOLERANCES)
    owners = [k for k, free in zip(owner, mask) if free] + [k for k in range(5 * JOINTS, 5 * JOINTS + 3) if free[k]]
    turns = np.array([k < 5 * JOINTS and k % 5 in (0, 2, 4) for k in owners])
    moved = (found.x - start) * np.where(turns, 1.0, 1e-3)
    order = {k: value for k, value in zip(owners, moved)}
    return np.array([order[k] for k in arm.unknowns]), found.nfev


def main():
    path, tool, repeats = sys.argv[1], sys.argv[2], int(sys.argv[3])
    arm = Arm(path)
    solve = {
        "scipy": lambda: by_scipy(arm, "2-point"),
        "scipy-jac": lambda: by_scipy(arm, arm.jacobian),
        "dogbox": lambda: by_scipy(arm, arm.jacobian, "dogbox"),
        "lmfit": lambda: by_lmfit(arm),
        "pybotics": lambda: by_pybotics(arm),
    }[tool]
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        x, evaluations = solve()
        times.append(1e3 * (time.perf_counter() - begin))
    print(f"{statistics.median(times):.4f} {arm.cost(x):.9e} {evaluations}")


main()
