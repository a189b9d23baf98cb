"""Calls beyond fits: residuals by parameters, comparisons, commands, simulations, studies, plots."""

from __future__ import annotations

import json
import pickle
import sys
import warnings
from pathlib import Path

import flexcal
import numpy as np
import pytest
from conftest import Command, exact, LUNAR, ROOT

SIGMA_MM = 0.05


def test_residuals_by_parameters(lunar: flexcal.Problem, identified: flexcal.Identification) -> None:
    fit = lunar.least_squares()
    unknowns = fit.unknowns
    assert list(unknowns.index) == list(identified.parameters.index[identified.parameters["fitted"]])
    assert (unknowns["unit"]["joint2.stiffness"], unknowns["x_unit"]["joint2.stiffness"]) == ("N·m/rad", "1")
    assert (unknowns["unit"]["joint2.alpha"], unknowns["x_unit"]["joint2.alpha"]) == ("rad", "rad")
    assert unknowns["start"]["joint2.alpha"] == 0.0
    values = identified.parameters.loc[unknowns.index, "estimate"].to_numpy()
    x = fit.deviations(values)
    np.testing.assert_allclose(fit.values(x), values, rtol=1e-14)
    # Those of measured numbers are those of the residual table, in units of σ; priors follow.
    residuals, rows = fit.residuals(x), fit.rows
    measured = (rows["row"] >= 0).to_numpy()
    assert residuals.shape == (len(rows),) and measured.sum() == 28 * 3
    table = identified.residuals.filter(like="residual_").to_numpy()
    places = rows["row"][measured].to_numpy().reshape(-1, 3)[:, 0]
    np.testing.assert_allclose(SIGMA_MM * residuals[measured].reshape(-1, 3), table[places], rtol=0, atol=1e-8)
    priors = unknowns["prior_sigma"].notna().to_numpy()
    assert list(rows["of"][~measured]) == list(unknowns.index[priors])
    np.testing.assert_allclose(residuals[~measured], (x / unknowns["prior_sigma"])[priors], rtol=1e-14)
    # The problem itself has the same functions, and derivatives are those of the residuals.
    jacobian = lunar.jacobian_by_parameters(x)
    assert (lunar.residuals(x) == residuals).all() and jacobian.shape == (len(rows), len(unknowns))
    for unknown in range(0, len(unknowns), 5):
        step = np.zeros(len(x))
        step[unknown] = 1e-6
        slope = (fit.residuals(x + step) - fit.residuals(x - step)) / 2e-6
        np.testing.assert_allclose(jacobian[:, unknown], slope, rtol=1e-5, atol=1e-5 * np.abs(slope).max())
    again = pickle.loads(pickle.dumps(fit))
    assert (again.residuals(x) == residuals).all()
    with pytest.raises(AttributeError, match="cannot be changed"):
        fit.start = x  # type: ignore[misc]


def test_unknowns_that_are_none(lunar: flexcal.Problem) -> None:
    fit = lunar.least_squares(strategy="stiffness-only")
    x = fit.start
    assert fit.unknowns.index.str.contains("stiffness|E|G|tool").all()
    masked = np.ma.masked_array(x, mask=np.arange(len(x)) == 0)
    for wrong in (x[1:], x[None], x * np.nan, masked, x > 0.0, list("ab")):
        with pytest.raises(flexcal.InputError, match="x: |x:") as caught:
            fit.residuals(wrong)
        assert caught.value.key == "x"


@pytest.mark.filterwarnings("ignore::flexcal.FlexcalWarning")
def test_compare(command: Command, tmp_path: Path) -> None:
    bench = ROOT / "problems" / "bench-arm"
    (tmp_path / "problem.toml").write_text(flexcal.Problem.from_urdf(bench / "arm.urdf").text)
    (tmp_path / "measurements.csv").write_bytes((bench / "measurements.csv").read_bytes())
    _, out = command("compare", tmp_path)
    compared = flexcal.Problem(tmp_path).compare()
    written, document = json.loads((out / "compare.json").read_text()), compared.to_dict()
    assert document["registered"] == written["registered"] and document["procedures"] == written["procedures"]
    fits = compared.fits
    assert fits["strategy"].tolist() == [row["strategy"] for row in written["rows"]]
    assert fits["held_out_mean_mm"].tolist() == [row["held_out"]["mean_mm"]["norm"] for row in written["rows"]]
    assert "joint" in set(fits["strategy"]) and len(compared.ablations) == len(written["ablations"])
    assert compared.trusted and compared.html == (out / "report.html").read_text()
    again = pickle.loads(pickle.dumps(compared))
    assert again.fits.equals(fits) and again.parameters.equals(compared.parameters)


def test_compensate(identified: flexcal.Identification, command: Command, tmp_path: Path) -> None:
    (tmp_path / "estimate.json").write_text(identified.to_json())
    targets = LUNAR / "targets.csv"
    _, out = command("compensate", LUNAR, "--estimate", tmp_path / "estimate.json", "--data", targets)
    found = identified.compensate(exact(targets))
    assert found.reached and found.commands.equals(exact(out / "commands.csv"))
    # Words for true and false become truth values, which select rows.
    assert found.commands["reached"].dtype == bool and found.commands["extrapolated"].dtype == bool
    assert len(found.commands[found.commands["reached"]]) == len(found.commands)
    with pytest.raises(flexcal.InputError, match="frame"):
        identified.compensate(targets, frame="tool")  # type: ignore[arg-type]
    with pytest.raises(flexcal.InputError, match="level"):
        identified.compensate(targets, level=1.0)
    assert pickle.loads(pickle.dumps(found)).commands.equals(found.commands)
    with pytest.raises(flexcal.InputError, match="q1: missing.*targets need a configuration to start from") as caught:
        identified.compensate(exact(targets)[["x_mm", "y_mm", "z_mm"]])
    assert caught.value.key == "column q1"


def test_compensate_doubts_senseless_starts(identified: flexcal.Identification) -> None:
    targets = exact(LUNAR / "targets.csv")
    joints = [f"q{k}_deg" for k in range(1, 5)]
    exchanged = targets.assign(q1_deg=targets["q2_deg"], q2_deg=targets["q1_deg"])
    far = targets.assign(**{name: targets[name] + 40.0 for name in joints})
    for table, words in ((exchanged, "columns of joints 1 and 2 exchanged"), (far, "from where their joint columns lead")):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            identified.compensate(table)
        assert any(words in str(own.message) for own in caught), [str(own.message) for own in caught]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        identified.compensate(targets)
    assert not any("joint columns" in str(own.message) for own in caught)


def test_simulate(lunar: flexcal.Problem, command: Command) -> None:
    _, out = command("simulate", LUNAR, "--truth", LUNAR, "--poses", 40, "--seed", 3)
    simulation = lunar.simulate(LUNAR, 40, seed=3)
    assert simulation.measurements.equals(exact(out / "measurements.csv"))
    assert simulation.to_json() == (out / "truth.json").read_text()
    longer = simulation.truth["true"] - simulation.truth["nominal"]
    assert longer["joint3.a"] == pytest.approx(0.024)
    assert [effect["effect"] for effect in simulation.effects] == ["link-thermal-bending"]
    again = lunar.simulate(LUNAR, data=simulation.measurements, seed=3)
    joints = [f"q{joint}_deg" for joint in range(1, 5)]
    np.testing.assert_allclose(again.measurements[joints], simulation.measurements[joints], rtol=0, atol=1e-6)
    with pytest.raises(TypeError, match="one of the two"):
        lunar.simulate(LUNAR)
    with pytest.raises(flexcal.InputError, match="no such file"):
        lunar.simulate(LUNAR / "none.toml", 5)


STUDY = """
name = "small"
problem = "{problem}"
seed = 1
repetitions = 2
position_sigma_mm = [0.05]
identification_poses = [16]
held_out_poses = 5
strategies = ["geometry-only"]
[poses]
q1_deg = [-90, 90]
q2_deg = [-65, 15]
q3_deg = [15, 130]
q4_deg = [-95, 75]
payload_kg = [0, 2]
hoist_N = [58, 65]
temperature_C = [17, 31]
"""


def test_study(command: Command, tmp_path: Path) -> None:
    file = tmp_path / "STUDY.toml"
    file.write_text(STUDY.format(problem=LUNAR / "problem.toml"))
    steps: list[tuple[int, int]] = []
    study = flexcal.study(file, progress=lambda *step: steps.append(step))
    assert sorted(steps) == [(1, 2), (2, 2)]
    _, out = command("study", file)
    assert study.to_dict()["cells"] == json.loads((out / "study.json").read_text())["cells"]
    assert study.cells.equals(exact(out / "study.csv")) and study.parameters.equals(exact(out / "parameters.csv"))
    assert "small" in repr(study)
    with pytest.raises(flexcal.InputError, match="no such file"):
        flexcal.study(tmp_path / "none.toml")


def test_plots(identified: flexcal.Identification) -> None:
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    axes = identified.plot_parameters()
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names[0] == "joint1.alpha" and "joint2.stiffness" in names
    figure, axes = pyplot.subplots()
    assert identified.plot_correlation(axes) is axes and axes.images
    pyplot.close("all")


def test_without_matplotlib(identified: flexcal.Identification, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("matplotlib", "matplotlib.pyplot"):
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ImportError, match=r"flexcal\[plots\]"):
        identified.plot_parameters()


def test_units_of_configurations(lunar: flexcal.Problem, identified: flexcal.Identification) -> None:
    q = np.array([[0.3, -0.2, 1.1, 0.4], [0.1, 0.0, 0.9, -0.3]])
    for arm in (lunar, identified):
        expected = arm.predict(q, hoist_N=60.0)
        np.testing.assert_array_equal(arm.predict(q_rad=q, hoist_N=60.0), expected)
        np.testing.assert_allclose(arm.predict(q_deg=np.degrees(q), hoist_N=60.0), expected, rtol=0, atol=1e-12)
        np.testing.assert_array_equal(arm.jacobian(q_rad=q, hoist_N=60.0), arm.jacobian(q, hoist_N=60.0))
        with pytest.raises(TypeError, match="one of q, q_rad and q_deg"):
            arm.predict(q, q_rad=q)
        with pytest.raises(flexcal.InputError, match="neither numbers nor words"):
            arm.predict(q_rad=q > 0.0)
        with pytest.raises(flexcal.InputError, match="masked"):
            arm.predict(q_rad=np.ma.masked_less(q, 0.0))
        with pytest.raises(flexcal.InputError, match="masked"):
            arm.predict(q, payload_kg=np.ma.masked_array([1.0, 2.0], mask=[True, False]), hoist_N=60.0)
