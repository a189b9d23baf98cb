"""Remainders correct predictions, and every prediction has its uncertainty."""

from __future__ import annotations

import json
import re
from pathlib import Path

import flexcal
import numpy as np
import numpy.typing as npt
import pytest
from conftest import Command, LUNAR, ROOT, exact

COUNT = 180
SIGMA = 2e-5
MIDDLE = np.array([0.0, 0.0, 0.0, -1.5, 0.0, 1.8, 0.0])
"""A configuration far from the limits of the joints."""


def panda() -> flexcal.Problem:
    text = (ROOT / "problems" / "panda" / "problem.toml").read_text()
    return flexcal.Problem(re.sub("(?m)^held_out = .*$", 'held_out = { column = "split" }', text))


def measured(problem: flexcal.Problem, size: float) -> tuple[npt.NDArray[np.float64], dict[str, object]]:
    """Commands and rows of an arm whose second and fourth joints err by size sin(5 q); every other row is held out."""
    random = np.random.default_rng(7)
    q = MIDDLE + random.uniform(-1.0, 1.0, (COUNT, len(MIDDLE)))
    moved = q.copy()
    for joint in (1, 3):
        moved[:, joint] += size * np.sin(5.0 * q[:, joint])
    positions = problem.predict(moved) + random.normal(0.0, SIGMA, (COUNT, 3))
    split = ["identification" if row % 2 == 0 else "validation" for row in range(COUNT)]
    return q, {"q_rad": q, "xyz_m": positions, "split": split}


@pytest.fixture(scope="module")
def problem() -> flexcal.Problem:
    return panda()


@pytest.fixture(scope="module")
def corrected(problem: flexcal.Problem) -> flexcal.Identification:
    return problem.identify(measured(problem, 3e-4)[1], remainder=True)


def test_a_remainder_corrects_and_bounds_predictions(problem: flexcal.Problem, corrected: flexcal.Identification) -> None:
    q, rows = measured(problem, 3e-4)
    plain = problem.identify(rows)
    assert plain.remainder is None and plain.remainder_json() is None
    remainder = corrected.remainder
    assert remainder is not None and {"joint 2", "joint 4"} <= set(remainder["sites"])
    assert remainder["left_out_mm"] < remainder["left_out_without_mm"]
    assert "remainder (smooth correction) at" in corrected.summary()
    file = corrected.remainder_json()
    assert file is not None and json.loads(file)["format"]["name"] == "flexcal-remainder"
    held_out = slice(1, None, 2)
    predicted, without = corrected.predict(q[held_out]), plain.predict(q[held_out])
    assert isinstance(predicted, flexcal.Prediction)
    positions = np.asarray(rows["xyz_m"])[held_out]
    errors = np.linalg.norm(positions - predicted, axis=1)
    assert type(positions - predicted) is np.ndarray
    assert errors.mean() < 0.6 * np.linalg.norm(positions - without, axis=1).mean()
    # Predictions, residuals and result are of one arm.
    residuals = corrected.residuals.filter(like="residual_").to_numpy()[held_out]
    np.testing.assert_allclose(1e3 * (positions - predicted), residuals, rtol=0, atol=1e-8)
    assert corrected.to_dict()["held_out"]["mean_mm"]["norm"] == pytest.approx(1e3 * errors.mean(), rel=1e-9)
    # The uncertainty is a covariance, and the bound holds for about as many poses as it says.
    count = len(errors)
    assert predicted.covariance.shape == (count, 3, 3) and predicted.bound95.shape == (count,)
    assert np.linalg.eigvalsh(predicted.covariance).min() > 0.0
    np.testing.assert_allclose(predicted.sigma**2, np.einsum("kii->ki", predicted.covariance), rtol=1e-12)
    assert np.mean(errors <= predicted.bound95) > 0.85
    assert np.all(predicted.bound(0.99) > predicted.bound95) and predicted.extrapolated.mean() < 0.1
    # One pose alone, and one far from all others.
    one = corrected.predict(q[1])
    np.testing.assert_allclose(one, predicted[0], rtol=0, atol=1e-12)
    assert one.covariance.shape == (3, 3) and float(one.bound95) == pytest.approx(predicted.bound95[0])
    with pytest.warns(flexcal.FlexcalWarning, match="beyond its limits"):
        far = corrected.predict(q[1] + np.pi)
    assert far.extrapolated and far.bound95 > 2.0 * one.bound95
    with pytest.raises(AttributeError, match="prediction itself"):
        _ = predicted.T.covariance
    with pytest.raises(ValueError, match="between 0 and 1"):
        predicted.bound(1.0)


def test_the_jacobian_of_a_corrected_arm_is_the_slope_of_its_positions(
    problem: flexcal.Problem, corrected: flexcal.Identification
) -> None:
    q = measured(problem, 3e-4)[0][:3]
    jacobian, step = corrected.jacobian(q), 3e-5
    for joint, direction in enumerate(np.eye(q.shape[1])):
        slope = (corrected.predict(q + step * direction) - corrected.predict(q - step * direction)) / (2 * step)
        np.testing.assert_allclose(jacobian[:, :, joint], slope, rtol=0, atol=1e-7)


def test_a_declared_remainder_is_applied(
    problem: flexcal.Problem, corrected: flexcal.Identification, tmp_path: Path
) -> None:
    q, rows = measured(problem, 3e-4)
    text = corrected.remainder_json()
    assert text is not None
    (tmp_path / "remainder.json").write_text(text)
    for use, of in (("true", corrected.predict(q)), ("false", problem.identify(rows).predict(q))):
        declared = f'{problem.text}\n[remainder]\nfile = "{tmp_path}/remainder.json"\nuse = {use}\n'
        predicted = flexcal.Problem(declared).identify(rows).predict(q)
        np.testing.assert_allclose(predicted, of, rtol=0, atol=1e-9)


def test_uncertainty_is_that_of_the_command_line(identified: flexcal.Identification, command: Command, tmp_path: Path) -> None:
    frame = exact(LUNAR / "measurements.csv")
    (tmp_path / "estimate.json").write_text(identified.to_json())
    done, out = command(
        "predict", LUNAR, "--estimate", tmp_path / "estimate.json", "--data", LUNAR / "measurements.csv", "--quiet"
    )
    assert done.returncode == 0, done.stderr
    written = exact(out / "predictions.csv")
    predicted = identified.predict(frame.drop(columns=["x_mm", "y_mm", "z_mm"]))
    np.testing.assert_allclose(1e3 * predicted.bound95, written["bound95_mm"], rtol=0, atol=0.501e-4)
    np.testing.assert_allclose(1e3 * predicted.sigma, written.filter(like="sigma_").to_numpy(), rtol=0, atol=0.501e-4)
    assert [str(flag).lower() for flag in predicted.extrapolated] == written["extrapolated"].astype(str).str.lower().tolist()
