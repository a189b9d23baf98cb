"""Fits to all rows: they are judged by rows that are left out in turn, and geometries by the rows that were fitted."""

from __future__ import annotations

import json
from pathlib import Path

import flexcal
import numpy as np
import pytest
from conftest import ROOT, Command

BENCH = ROOT / "problems" / "bench-arm"
HELD_OUT = 'held_out = "none"'

pytestmark = pytest.mark.filterwarnings("ignore::flexcal.FlexcalWarning")


@pytest.fixture(scope="module")
def problem() -> flexcal.Problem:
    text = flexcal.Problem.from_urdf(BENCH / "arm.urdf").text
    lines = [HELD_OUT if line.startswith("held_out") else line for line in text.splitlines()]
    assert HELD_OUT in lines
    return flexcal.Problem("\n".join(lines) + "\n")


@pytest.fixture(scope="module")
def fitted(problem: flexcal.Problem) -> flexcal.Identification:
    return problem.identify(BENCH / "measurements.csv")


def test_errors_are_those_of_rows_left_out(problem: flexcal.Problem, fitted: flexcal.Identification) -> None:
    document = fitted.to_dict()
    assert list(fitted.errors.index) == [(arm, rows) for arm in ("registered", "identified") for rows in ("identification", "left_out")]
    judged = fitted.held_out_error
    assert judged.rows == "left_out" and judged.n == document["left_out"]["n"]
    assert judged.mean_mm == document["left_out"]["mean_mm"]["norm"] < judged.rms_mm < judged.max_mm
    assert f"{judged.mean_mm:.4f} mm" in fitted._repr_html_() and "left-out poses" in fitted._repr_html_()
    trace = problem.trace(BENCH / "measurements.csv")
    assert f"{judged.mean_mm:.4f} mm" in trace._repr_html_()
    compared = problem.compare(BENCH / "measurements.csv")
    assert compared.errors.equals(fitted.errors) and compared.held_out_error == judged
    assert compared.fits["left_out_mean_mm"].min() > 0.0 and "held_out_mean_mm" not in compared.fits


def test_a_loop(problem: flexcal.Problem) -> None:
    closed = problem.loop(BENCH / "measurements.csv")
    errors = closed.errors["mean_mm"]
    assert closed.held_out_error.mean_mm == errors["closed", "left_out"]
    assert f"{errors['closed', 'left_out']:.4f} mm" in closed._repr_html_()


def test_an_export_is_judged_by_the_fitted_rows(problem: flexcal.Problem, command: Command, tmp_path: Path) -> None:
    # The effects that are found are what a geometry alone lacks.
    (tmp_path / "problem.toml").write_text(problem.loop(BENCH / "measurements.csv").closed_problem.text)
    (tmp_path / "measurements.csv").write_bytes((BENCH / "measurements.csv").read_bytes())
    fitted = flexcal.Problem(tmp_path).identify()
    exported = fitted.export_urdf(BENCH / "arm.urdf")
    errors = exported.errors
    assert set(errors["rows"]) == {"fitted"} and (errors["n"] == fitted.errors["n"]["identified", "identification"]).all()
    assert errors["mean_mm"]["whole"] == pytest.approx(fitted.errors["mean_mm"]["identified", "identification"])
    assert {"whole", "rigid", "fitted_alone"} <= set(errors.index) and (errors["mean_mm"] > 0.0).all()
    assert "fitted poses by" in " ".join(exported.summary().split()) and "error of fitted rows, mm" in exported.summary()
    document = exported.to_dict()
    assert document["held_out"] is None and document["fitted"]["whole"]["n"] == errors["n"]["whole"]
    _, out = command("identify", tmp_path)
    run, _ = command(
        "export", tmp_path, "--estimate", out / "estimate.json", "--urdf", BENCH / "arm.urdf", "--json", file="calibrated.urdf"
    )
    assert json.loads(run.stdout)["fitted"] == document["fitted"]


def test_a_simulation_follows_the_problem(problem: flexcal.Problem, tmp_path: Path) -> None:
    (tmp_path / "TRUTH.toml").write_text("[noise]\nposition_sigma_mm = 0.05\n")
    # Without [poses] the limits of the joints hold.
    made = problem.simulate(tmp_path, 30)
    assert "split" not in made.measurements and "held out" not in made.summary()
    assert problem.identify(made.measurements).held_out_error.n == 30
    again = problem.simulate(tmp_path, data=made.measurements)
    joints = made.measurements.filter(regex="^q").columns
    np.testing.assert_allclose(again.measurements[joints], made.measurements[joints], rtol=0, atol=1e-6)
    parts = fitted_parts(problem.identify(made.measurements))
    assert all(part.count("{") == part.count("}") for part in parts)


def fitted_parts(fitted: flexcal.Identification) -> list[str]:
    return list(fitted.to_dict()["arm_parts"])
