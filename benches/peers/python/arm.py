"""The rigid arm of the CSV that the bench `peers` writes, over all poses at once in numpy."""

import numpy as np

JOINTS = 6


class Arm:
    """Nominal arm, unknowns and poses; x holds the deviations of the unknowns from nominal."""

    def __init__(self, path):
        with open(path) as file:
            self.sigma = float(file.readline())
            self.nominal = np.array([float(cell) for cell in file.readline().split(",")])
            self.unknowns = np.array([int(cell) for cell in file.readline().split(",")])
            bounds = [float(cell) for cell in file.readline().split(",") if cell.strip()]
            self.bounds = np.array(bounds).reshape(2, -1) if bounds else None
            loss, *numbers = file.readline().strip().split(",")
            self.loss, self.numbers = loss, [float(number) for number in numbers]
            poses = np.loadtxt(file, delimiter=",", ndmin=2)
        self.q, self.measured = poses[:, :JOINTS], poses[:, JOINTS:]

    def values(self, x):
        """alpha, a, theta, d, beta of each joint, and the target."""
        values = self.nominal.copy()
        values[self.unknowns] += x
        return values[:-3].reshape(JOINTS, 5), values[-3:]

    def residuals(self, x):
        """(measured - predicted) / sigma, shape=(3 poses,); the point is carried from the last frame inwards."""
        links, (px, py, pz) = self.values(x)
        for (alpha, a, theta, d, beta), q in zip(links[::-1], self.q.T[::-1]):
            sin, cos = np.sin(beta), np.cos(beta)
            pz, px = pz * cos - px * sin + d, pz * sin + px * cos
            sin, cos = np.sin(theta + q), np.cos(theta + q)
            px, py = px * cos - py * sin + a, px * sin + py * cos
            sin, cos = np.sin(alpha), np.cos(alpha)
            py, pz = py * cos - pz * sin, py * sin + pz * cos
        return ((self.measured - np.stack([px, py, pz], axis=1)) / self.sigma).ravel()

    def cost(self, x):
        """Half the sum of the loss on the length of each pose's residual, as flexcal counts."""
        lengths = np.linalg.norm(self.residuals(x).reshape(-1, 3), axis=1)
        if self.loss == "huber":
            (k,) = self.numbers
            return 0.5 * np.sum(np.where(lengths <= k, lengths**2, k * (2 * lengths - k)))
        if self.loss == "l1":
            slope, smoothing = self.numbers
            return slope * np.sum(np.hypot(lengths, smoothing) - smoothing)
        return 0.5 * np.sum(lengths**2)

    def jacobian(self, x):
        """Derivatives of `residuals` by hand, shape=(3 poses, unknowns): axis × lever of each turn, axis of each shift."""
        links, target = self.values(x)
        poses = len(self.q)
        ones = np.ones((poses, 1))
        axes = [ones * axis for axis in np.eye(3)]
        origin = np.zeros((poses, 3))
        turns, shifts = {}, {}

        def turn(u, v, angle):
            sin, cos = np.sin(angle)[..., None], np.cos(angle)[..., None]
            axes[u], axes[v] = axes[u] * cos + axes[v] * sin, axes[v] * cos - axes[u] * sin

        for i, (alpha, a, theta, d, beta) in enumerate(links):
            turns[5 * i] = (axes[0], origin)
            turn(1, 2, np.asarray(alpha))
            shifts[5 * i + 1] = axes[0]
            origin = origin + axes[0] * a
            turns[5 * i + 2] = (axes[2], origin)
            turn(0, 1, theta + self.q[:, i])
            shifts[5 * i + 3] = axes[2]
            origin = origin + axes[2] * d
            turns[5 * i + 4] = (axes[1], origin)
            turn(2, 0, np.asarray(beta))
        point = origin + sum(axis * t for axis, t in zip(axes, target))
        shifts.update({5 * JOINTS + k: axis for k, axis in enumerate(axes)})
        out = np.empty((poses, 3, len(self.unknowns)))
        for column, k in enumerate(self.unknowns):
            out[:, :, column] = shifts[k] if k in shifts else np.cross(turns[k][0], point - turns[k][1])
        return out.reshape(3 * poses, -1) / -self.sigma
