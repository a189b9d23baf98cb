"""Python gives what the command line gives, to the last bit."""

from __future__ import annotations

import contextlib
import re
from pathlib import Path
from typing import Any

import flexcal
import numpy as np
import pandas as pd
import pytest
from conftest import assert_written, Command, exact, LUNAR, ROOT, timeless, UR10_DATA


@pytest.mark.parametrize("strategy", ["joint", "geometry-only", "rigid"])
def test_identify(lunar: flexcal.Problem, command: Command, strategy: str) -> None:
    run, out = command("identify", LUNAR, "--strategy", strategy, "--verbose")
    # Without elasticity the residual is far above the declared σ.
    untrusted = pytest.warns(flexcal.FlexcalWarning, match="not to be trusted")
    with untrusted if strategy == "rigid" else contextlib.nullcontext():
        result = lunar.identify(strategy=strategy)  # type: ignore[arg-type]
    assert result.trusted == (run.returncode == 0)
    assert timeless(result.to_json()) == timeless((out / "estimate.json").read_text())
    # The time of the fit ends its line.
    summary, printed = (
        [re.sub(r"\d+\.\d+ s$", "s", line) for line in text.splitlines()] for text in (result.summary(), run.stdout)
    )
    assert summary[4:] == printed[4 : len(summary)]
    assert result.html == (out / "report.html").read_text()
    assert_written(result.residuals, out / "residuals.csv")


def test_loop_trace_check_plan(lunar: flexcal.Problem, closed: flexcal.ClosedLoop, command: Command) -> None:
    truth = ROOT / "tests" / "cases" / "truth.toml"
    run, out = command("loop", LUNAR, "--verbose")
    assert timeless(closed.to_json()) == timeless((out / "loop.json").read_text())
    assert run.stdout.startswith(closed.summary())
    assert_written(closed.residuals, out / "residuals.csv")
    assert sorted(closed.figures) == sorted(file.stem for file in (out / "figures").iterdir())
    run, out = command("trace", LUNAR)
    assert timeless(lunar.trace().to_json()) == timeless((out / "trace.json").read_text())
    run, out = command("check", LUNAR, "--truth", truth, "--poses", 28)
    assert lunar.check(poses=28, truth=truth).to_json() == (out / "check.json").read_text()
    run, out = command("check", LUNAR)
    assert lunar.check().to_json() == (out / "check.json").read_text()
    run, out = command("plan", LUNAR, "--truth", truth, "--poses", 12, "--criterion", "D", "--seed", 3)
    plan = lunar.plan(12, criterion="D", truth=truth, seed=3)
    assert plan.to_json() == (out / "plan.json").read_text()
    assert len(plan.poses) == 12 and plan.poses.equals(exact(out / "plan.csv"))
    run, out = command("plan", LUNAR, "--poses", 5, "--candidates", out / "plan.csv", "--data", LUNAR / "measurements.csv")
    again = lunar.plan(5, LUNAR / "measurements.csv", candidates=plan.poses)
    assert again.to_json() == (out / "plan.json").read_text()
    inside = ("--workspace-mm=0,4000,-4000,4000,-500,3000", "--keep-out-mm", "0,0,1,-200")
    run, out = command("plan", LUNAR, "--truth", truth, "--poses", 4, *inside)
    near = lunar.plan(4, truth=truth, workspace_mm=[0, 4000, -4000, 4000, -500, 3000], keep_out_mm=[[0, 0, 1, -200]])
    assert near.to_json() == (out / "plan.json").read_text()


AROUND = """
name = "around"
joint = [{ d_m = 0.4 }, { alpha_deg = 90 }, { a_m = 0.6 }, { alpha_deg = 90, a_m = 0.1, d_m = 0.55 }, { alpha_deg = -90 }, { alpha_deg = 90, d_m = 0.1 }]
tool.target_m = [0.05, 0.02, 0.15]
anchor = [{ name = "A" }]
surface = [{ name = "table", kind = "plane" }]
[parameters]
"joint*.theta" = { sigma_deg = 0.2 }
"joint*.a" = { sigma_mm = 2 }
[data]
position_sigma_mm = 0.05
distance_sigma_mm = 0.05
surface_sigma_mm = 0.05
tilt_sigma_deg = 0.01
held_out = { column = "split" }
"""
AROUND_TRUTH = """
[parameters]
"joint3.a" = { mm = 0.8 }
"anchor[A].x" = { mm = 1500 }
"anchor[A].y" = { mm = 500 }
"anchor[A].z" = { mm = 1200 }
"surface[table].rx" = { deg = 0 }
"surface[table].ry" = { deg = 0 }
"surface[table].d" = { mm = 200 }
[noise]
position_sigma_mm = 0.05
[poses]
q1_deg = [-90, 90]
q2_deg = [-60, 100]
q3_deg = [-120, 120]
q4_deg = [-150, 150]
q5_deg = [-100, 100]
q6_deg = [-150, 150]
positions = 20
"""


def test_observations_without_a_tracker(command: Command, tmp_path: Path) -> None:
    (tmp_path / "problem.toml").write_text(AROUND)
    (tmp_path / "TRUTH.toml").write_text(AROUND_TRUTH)
    run, made = command("simulate", tmp_path, "--truth", tmp_path, "--poses", 80, "--seed", 1)
    assert run.returncode == 0, run.stderr
    # The tilt of a tool, beside them.
    table = pd.read_csv(made / "measurements.csv")
    others = {"x_mm", "y_mm", "z_mm", "distance_mm", "offset_mm", "anchor", "surface", "point"} & set(table)
    tilt = table.tail(1).assign(time_s=table["time_s"].max() + 60, **dict.fromkeys(others, np.nan), **{f"q{k}_deg": 0.0 for k in range(1, 7)})
    measured = pd.concat([table, tilt.assign(tilt_x_deg=0.0, tilt_y_deg=0.0)])
    measured.to_csv(tmp_path / "all.csv", index=False)
    run, out = command("identify", tmp_path, "--data", tmp_path / "all.csv")
    residuals = flexcal.Problem(AROUND).identify(tmp_path / "all.csv").residuals
    assert_written(residuals, out / "residuals.csv")
    kinds = {"x": 20, "distance": 30, "offset": 30, "tilt_x": 1}
    for kind, count in kinds.items():
        unit = "deg" if kind == "tilt_x" else "mm"
        assert residuals[f"residual_{kind}_{unit}"].notna().sum() == count, kind
    assert (residuals["anchor"] == "A").sum() == (residuals["surface"] == "table").sum() == 30


def test_orientation(lunar: flexcal.Problem, command: Command, tmp_path: Path) -> None:
    oriented = lunar.text.replace("position_sigma_mm", "orientation_sigma_deg = 0.02\nposition_sigma_mm")
    oriented = oriented.replace('"tool.*" = {', '"tool.*" = { sigma_deg = 2.0,')
    (tmp_path / "problem.toml").write_text(oriented)
    truth = ROOT / "tests" / "cases" / "truth.toml"
    run, made = command("simulate", tmp_path, "--truth", truth, "--poses", 30, "--seed", 2)
    assert run.returncode == 0, run.stderr
    run, out = command("identify", tmp_path, "--data", made / "measurements.csv")
    problem = flexcal.Problem(oriented)
    result = problem.identify(made / "measurements.csv")
    assert {"predicted_rx_deg", "residual_rz_deg"} <= set(result.residuals)
    assert_written(result.residuals, out / "residuals.csv")
    # The fit fitted turns as well: their share of the length is no more than theirs.
    turns = np.linalg.norm(result.residuals.filter(regex="^residual_r"), axis=1) / 0.02
    assert (result.residuals["whitened"] > turns).all() and turns.max() > 1.0


def test_tables_in_memory(lunar: flexcal.Problem, identified: flexcal.Identification) -> None:
    polars = pytest.importorskip("polars")
    pyarrow = pytest.importorskip("pyarrow")
    file = LUNAR / "measurements.csv"
    frame = exact(file)
    joints = [f"q{k}_deg" for k in range(1, 5)]
    dictionary = {
        "q_deg": frame[joints].to_numpy(),
        "xyz_mm": frame[["x_mm", "y_mm", "z_mm"]].to_numpy(),
        **{name: frame[name].tolist() for name in frame if name not in (*joints, "x_mm", "y_mm", "z_mm")},
    }
    tables = [
        str(file),
        [file],
        frame,
        frame.astype({"split": "category"}),
        frame.to_records(index=False),
        polars.read_csv(file),
        polars.read_csv(file).with_columns(polars.col("split").cast(polars.Categorical)),
        pyarrow.Table.from_pandas(frame),
        dictionary,
    ]
    def nameless(text: str) -> Any:
        """A result without the names of its files, which tables in memory do not have."""
        document = timeless(text)
        for part in (document, document["digest"]):
            part.pop("measurement_files", None)
        return document

    for table in tables:
        result = lunar.identify(table)
        assert nameless(result.to_json()) == nameless(identified.to_json()), type(table)


@pytest.mark.skipif(not UR10_DATA[0].exists(), reason="the UR10's data are not here")
def test_ur10(command: Command) -> None:
    folder = ROOT / "problems" / "ur10-ipa"
    _, out = command("identify", folder, "--data", *UR10_DATA)
    problem = flexcal.Problem(folder)
    with pytest.warns(flexcal.FlexcalWarning):
        by_path, by_frame = problem.identify(UR10_DATA), problem.identify(_together(UR10_DATA))
    expected = timeless((out / "estimate.json").read_text())
    assert timeless(by_path.to_json()) == expected
    for name in ("parameters", "covariance", "held_out", "reduced_chi2"):
        assert timeless(by_frame.to_json())[name] == expected[name], name
    assert by_path.residuals.drop(columns=["file", "line"]).equals(by_frame.residuals.drop(columns=["file", "line"]))


def _together(files: list[Path]) -> pd.DataFrame:
    return pd.concat([exact(file) for file in files], ignore_index=True)


def test_results_agree(lunar: flexcal.Problem, identified: flexcal.Identification, closed: flexcal.ClosedLoop) -> None:
    for result in (identified, closed):
        variances = np.diag(result.covariance)
        np.testing.assert_allclose(np.sqrt(variances), result.parameters["std_error"], rtol=1e-9)
        residuals = result.residuals
        assert len(residuals) == 78 and residuals["held_out"].sum() == 50
        lengths = np.linalg.norm(residuals.filter(like="residual_"), axis=1)
        mean = result.errors["mean_mm"].xs("held_out", level="rows").iloc[-1]
        np.testing.assert_allclose(lengths[residuals["held_out"]].mean(), mean, rtol=1e-12)
    assert closed.verdict == "explained" and list(closed.effects["status"]) == ["found"]
    assert list(closed.effects["law"]) == ["link-thermal-bending"] and closed.effects["law_probability"][0] > 0.9
    again = closed.closed_problem.identify(LUNAR / "measurements.csv")
    off = (again.parameters["estimate"] - closed.parameters["estimate"]) / closed.parameters["std_error"]
    assert off.abs().max() < 1e-3
