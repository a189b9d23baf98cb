"""The fits of tests/cases/bounded by SciPy, from nominal values, on flexcal's residuals and derivatives.

    bounded.py <peers program> [name ...]

For each problem and method: evaluations, time, the cost 1/2 |r|^2, by how much flexcal's is above it, and how far the point is outside
its limits in units of the priors. Every method is charged with what an evaluation of residuals and derivatives costs flexcal itself, not
with the pipe that serves them here, and with the time that it spends beside them.

trf    least_squares, for bounds alone; dogbox likewise
slsqp  minimize, for bounds and constraints; begun again where it ended as long as that lowers the cost

Both work in units of the priors.
"""

import subprocess
import sys
import time

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, least_squares, minimize

NAMES = ["stiffness", "tight-geometry", "mild-constraints", "against-the-truth", "constraints-against-the-truth"]
AGAIN = 100  # times that SLSQP begins, at most


class Fit:
    """The problem in units of the priors, and how often it was evaluated."""

    def __init__(self, program, name):
        self.process = subprocess.Popen([program, "serve", name], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        lower, upper, (count,) = self.line(), self.line(), self.line()
        rows = np.array([self.line() for _ in range(int(count))]).reshape(int(count), 2 + len(lower))
        steps, self.cost, self.seconds, self.once, *found = self.line()
        self.steps, self.found, self.n = int(steps), np.array(found), len(lower)
        self.at, self.evaluations, self.waited, self.unit = None, 0, 0.0, np.ones(self.n)
        _, slopes = self.both(np.zeros(self.n))
        self.unit = 1.0 / np.diag(slopes[-self.n :])  # the last rows are those of the priors
        self.at, self.evaluations, self.found = None, 0, self.found / self.unit
        self.bounds = Bounds(lower / self.unit, upper / self.unit)
        self.rows = LinearConstraint(rows[:, 2:] * self.unit, rows[:, 0], rows[:, 1]) if count else None

    def line(self):
        return np.array([float(word) for word in self.process.stdout.readline().split()])

    def both(self, x):
        if self.at is None or not np.array_equal(self.at, x):
            begin = time.perf_counter()
            self.process.stdin.write(" ".join(repr(float(value)) for value in x * self.unit) + "\n")
            self.process.stdin.flush()
            values = self.line()
            m = len(values) // (self.n + 1)
            self.values = values[:m], values[m:].reshape(m, self.n) * self.unit
            self.at = x.copy()
            self.evaluations += 1
            self.waited += time.perf_counter() - begin
        return self.values

    def residuals(self, x):
        return self.both(x)[0]

    def jacobian(self, x):
        return self.both(x)[1]

    def value(self, x):
        r = self.residuals(x)
        return 0.5 * (r @ r) if np.isfinite(r).all() else 1e300

    def gradient(self, x):
        r, slopes = self.both(x)
        return slopes.T @ r

    def outside(self, x):
        limits = [self.bounds.lb - x, x - self.bounds.ub]
        if self.rows is not None:
            values = self.rows.A @ x
            limits += [self.rows.lb - values, values - self.rows.ub]
        return max(0.0, max(limit.max() for limit in limits))


def by_trf(fit, method="trf"):
    tolerances = {"ftol": 1e-15, "xtol": 1e-15, "gtol": 1e-15}
    limits = (fit.bounds.lb, fit.bounds.ub)
    start = np.zeros(fit.n)
    return least_squares(fit.residuals, start, fit.jacobian, limits, method, max_nfev=20000, **tolerances).x


def by_slsqp(fit):
    x, cost = np.zeros(fit.n), np.inf
    for _ in range(AGAIN):
        found = minimize(fit.value, x, jac=fit.gradient, method="SLSQP", bounds=fit.bounds, constraints=fit.rows or (),
                         options={"maxiter": 5000, "ftol": 1e-14})
        if not found.fun < cost * (1 - 1e-12) or fit.outside(found.x) > 1e-9:
            break
        x, cost = found.x, found.fun
    return x


def main():
    program, names = sys.argv[1], sys.argv[2:] or NAMES
    print(f"{'problem':30} {'by':8} {'evaluations':>11} {'time [ms]':>10} {'cost':>19} {'flexcal above':>13} {'outside':>8}")
    for name in names:
        fit = Fit(program, name)
        print(f"{name:30} {'flexcal':8} {fit.steps:5} steps {1e3 * fit.seconds:10.2f} {fit.cost:19.12e} {'':13} {fit.outside(fit.found):8.1e}")
        methods = {"trf": by_trf, "dogbox": lambda fit: by_trf(fit, "dogbox")} if fit.rows is None else {}
        methods["slsqp"] = by_slsqp
        for method, solve in methods.items():
            fit.at, fit.evaluations, fit.waited, begin = None, 0, 0.0, time.perf_counter()
            x = solve(fit)
            seconds = time.perf_counter() - begin - fit.waited + fit.evaluations * fit.once
            cost = fit.value(x)
            print(f"{'':30} {method:8} {fit.evaluations:11} {1e3 * seconds:10.1f} {cost:19.12e} {fit.cost / cost - 1:13.1e} {fit.outside(x):8.1e}",
                  flush=True)


if __name__ == "__main__":
    main()
