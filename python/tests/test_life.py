"""Earlier estimates as prior, changes of an arm, and fleets."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import flexcal
import numpy as np
import pandas as pd
import pytest
from conftest import Command

ARM = """\
name = "elbow"
joint = [
  { d_m = 0.45, min_deg = -150, max_deg = 150 },
  { alpha_deg = 90, a_m = 0.05, min_deg = 0, max_deg = 120 },
  { a_m = 0.60, min_deg = -130, max_deg = -10 },
]
tool.target_m = [0.5, 0.02, 0.0]

[parameters]
"joint*.*" = { sigma_deg = 0.2, sigma_mm = 1 }

[data]
position_sigma_mm = 0.03
held_out = "none"
"""
TRUTH = """\
[parameters]
"joint2.theta" = { deg = 0.11 }
"joint3.a" = { mm = 0.6 }

[noise]
position_sigma_mm = 0.03

[poses]
q1_deg = [-150, 150]
q2_deg = [0, 120]
q3_deg = [-130, -10]
"""


class Sessions:
    """An arm with its calibration, and tables that were measured later."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "problem.toml").write_text(ARM)
        self.problem = flexcal.Problem(folder)
        self.first = self.measured(24, 1)
        self.identified = self.problem.identify(self.first)
        self.estimate = folder / "estimate.json"
        self.estimate.write_text(self.identified.to_json())

    def measured(self, poses: int, seed: int, zero: float = 0.11) -> Path:
        """Measures the arm, the zero of joint 2 off by so many degrees."""
        truth, table = self.folder / "truth.toml", self.folder / f"rows-{seed}.csv"
        truth.write_text(TRUTH.replace("deg = 0.11", f"deg = {zero}"))
        self.problem.simulate(truth, poses=poses, seed=seed).measurements.to_csv(table, index=False)
        return table


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Sessions:
    return Sessions(tmp_path_factory.mktemp("arm"))


def timeless(text: str) -> Any:
    """A result without times and digests of the whole, and without names of files."""
    document = json.loads(text)
    for key in ("seconds", "digest", "estimate", "command", "sources"):
        document.pop(key, None)
    return document


def test_watch(arm: Sessions, command: Command) -> None:
    same, moved = arm.measured(6, 2), arm.measured(6, 3, zero=0.16)
    assert arm.identified.watch(same, drift_days=7)["changed"] is False
    verdict = arm.identified.watch(moved)
    assert verdict["changed"] and verdict["causes"][0]["label"] == "zero of joint 2"
    ran, out = command("watch", arm.folder, "--estimate", arm.estimate, "--data", moved)
    assert ran.returncode == 3
    assert timeless(json.dumps(verdict)) == timeless((out / "watch.json").read_text())
    again = pickle.loads(pickle.dumps(arm.identified))
    assert again.watch(moved) == verdict
    for wrong in ({"false_alarms": 0.0}, {"false_alarms": 1.5}, {"drift_days": -1.0}):
        with pytest.raises(flexcal.InputError, match="is needed"):
            arm.identified.watch(moved, **wrong)
    with pytest.raises(flexcal.InputError, match="nothing is new"):
        arm.identified.watch(arm.first)


def test_an_earlier_identification_as_prior(arm: Sessions, command: Command) -> None:
    rows = arm.measured(5, 4)
    found = arm.problem.identify(rows, prior=arm.identified, drift_days=7)
    assert "No contradiction is shown" in found.summary() and found.to_dict()["prior"]["drift_days"] == 7
    of_file = arm.problem.identify(rows, prior=arm.estimate, drift_days=7)
    assert (of_file.parameters["estimate"] == found.parameters["estimate"]).all()
    _, out = command("identify", arm.folder, "--data", rows, "--prior", arm.estimate, "--drift", 7)
    written = json.loads((out / "estimate.json").read_text())
    assert written["parameters"] == of_file.to_dict()["parameters"]
    # Far fewer rows than parameters, and no less is known than before.
    before, after = (fit.parameters["std_error"].to_numpy(dtype=float) for fit in (arm.identified, found))
    assert np.nanmax(after / before) < 1.5
    closed = arm.problem.loop(arm.first)
    of_loop, of_fit = (closed.closed_problem.identify(rows, prior=prior, drift_days=7) for prior in (closed, closed.after))
    assert of_loop.parameters.equals(of_fit.parameters)
    with pytest.raises(TypeError, match="not int"):
        arm.problem.identify(rows, prior=7)  # type: ignore[arg-type]
    again = pickle.loads(pickle.dumps(found))
    assert again.to_json() == found.to_json()
    assert (again.predict(q_deg=[10, 20, -30]) == found.predict(q_deg=[10, 20, -30])).all()
    with pytest.raises(flexcal.InputError, match="none is given"):
        arm.problem.identify(rows, drift_days=7)
    with pytest.raises(flexcal.InputError, match="takes over that of the prior"):
        arm.problem.identify(rows, prior=arm.identified, remainder=True)
    with pytest.raises(flexcal.InputError, match=r"absent\.json"):
        arm.problem.identify(rows, prior=arm.folder / "absent.json")


def test_a_prior_in_memory_keeps_its_remainder(arm: Sessions, tmp_path: Path) -> None:
    angles, axes = ["q1_deg", "q2_deg", "q3_deg"], ["x_mm", "y_mm", "z_mm"]

    def bent(poses: int, seed: int) -> pd.DataFrame:
        """Measures the arm whose joint 2 errs by waves of its command."""
        table = pd.read_csv(arm.measured(poses, seed))
        commands = table[angles].to_numpy(dtype=float)
        turned = commands + np.array([0, 0.05, 0]) * np.sin(np.deg2rad(7 * commands))
        table[axes] += 1e3 * (arm.identified.predict(q_deg=turned) - arm.identified.predict(q_deg=commands))
        return table

    def missed(fit: flexcal.Identification, table: pd.DataFrame) -> float:
        predicted = fit.predict(q_deg=table[angles].to_numpy(dtype=float))
        return float(np.linalg.norm(table[axes].to_numpy(dtype=float) - 1e3 * predicted, axis=1).mean())

    earlier = arm.problem.identify(bent(80, 30), remainder=True)
    text = earlier.remainder_json()
    assert text is not None
    found = arm.problem.identify(bent(5, 31), prior=earlier)
    assert found.remainder_json() is not None
    (tmp_path / "estimate.json").write_text(earlier.to_json())
    (tmp_path / "remainder.json").write_text(text)
    of_file = arm.problem.identify(bent(5, 31), prior=tmp_path / "estimate.json")
    assert timeless(of_file.remainder_json() or "") == timeless(found.remainder_json() or "")
    others = bent(60, 32)
    assert missed(found, others) < 1.15 * missed(earlier, others)


def test_fleet(arm: Sessions, command: Command) -> None:
    files = [arm.estimate]
    for number in (1, 2):
        table = arm.measured(24, 10 + number, zero=0.11 + 0.02 * number)
        files.append(arm.folder / f"estimate-{number}.json")
        files[-1].write_text(arm.problem.identify(table).to_json())
    prior = arm.folder / "PRIOR.toml"
    found = flexcal.fleet(files, out=prior)
    # Identifications in memory are estimates as well, and so is what a loop fitted last.
    of_objects = flexcal.fleet([arm.identified, *files[1:]])
    assert of_objects["parameters"] == found["parameters"]
    for wrong in (str(arm.estimate), arm.identified):
        with pytest.raises(TypeError, match="a list of at least three arms"):
            flexcal.fleet(wrong)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="not int"):
        flexcal.fleet([1, 2, 3])  # type: ignore[list-item]
    zero = next(row for row in found["parameters"] if row["name"] == "joint2.theta")
    assert zero["spread"] > 0 and len(found["arms"]) == 3
    _, out = command("fleet", *files, file="PRIOR.toml")
    assert (out / "PRIOR.toml").read_text() == prior.read_text()
    assert arm.problem.identify(arm.measured(5, 20), prior=prior).trusted
    with pytest.raises(flexcal.InputError, match="a fleet of 2 is too small"):
        flexcal.fleet(files[:2])
