"""Arms as functions of their configuration."""

from __future__ import annotations

import flexcal
import numpy as np
import pandas as pd
import pytest
from conftest import exact, LUNAR

# Effects of every way in which a position follows commands beyond the joint itself, and a joint that slides.
FOLLOWING = """
name = "following"
joint = [
    { alpha_deg = 90.0, d_m = 0.3 },
    { a_m = 0.6, kind = "prismatic" },
    { kind = "fixed", theta_deg = 30.0, a_m = 0.1 },
    { a_m = 0.5, alpha_deg = 20.0 },
]
tool.target_m = [0.1, 0.02, 0.0]
[[effect]]
joint-harmonic = { joint = 4, orders = [1, 2] }
[[effect]]
gear-ratio = { joint = 1 }
[[effect]]
joint-coupling = { joint = 4, from = 1 }
[[effect]]
tracker-scale = {}
[parameters]
"joint4.a" = { sigma_mm = 5.0 }
"joint-harmonic*" = { sigma_deg = 2.0 }
"tracker-scale*" = { free = true }
"gear-ratio*" = { free = true }
"joint-coupling*" = { free = true }
[data]
position_sigma_mm = 0.01
held_out = { fraction = 0.2, seed = 1 }
"""


def test_predictions_are_those_of_the_residuals(lunar: flexcal.Problem, identified: flexcal.Identification) -> None:
    frame = exact(LUNAR / "measurements.csv")
    predicted = identified.predict(frame.drop(columns=["x_mm", "y_mm", "z_mm"]))
    expected = identified.residuals.filter(like="predicted_").to_numpy()
    np.testing.assert_allclose(1e3 * predicted, expected, rtol=0, atol=1e-9)
    q = np.deg2rad(frame.filter(regex=r"^q\d").to_numpy())
    known = {name: frame[name] for name in ("payload_kg", "hoist_N", "temperature_C") if name in frame}
    np.testing.assert_allclose(identified.predict(q, **known), predicted, rtol=0, atol=1e-12)
    # One configuration alone, one value for all, and the nominal arm.
    one = identified.predict(q[3], **{name: values[3] for name, values in known.items()})
    assert one.shape == (3,) and np.allclose(one, predicted[3], atol=1e-12)
    assert 1e-4 < np.linalg.norm(lunar.predict(q, **known) - predicted, axis=1).min() < 0.1


@pytest.mark.parametrize("which", ["lunar", "following"])
def test_jacobian_is_the_derivative_of_predict(which: str, lunar: flexcal.Problem, identified: flexcal.Identification) -> None:
    arm: flexcal.Problem | flexcal.Identification
    arms: list[flexcal.Problem | flexcal.Identification]
    random = np.random.default_rng(4)
    if which == "lunar":
        arms = [lunar, identified]
        q = random.uniform(-0.5, 0.5, (5, 4))
    else:
        problem = flexcal.Problem(FOLLOWING)
        truth = random.uniform(-2.0, 2.0, (80, 3))
        wave = np.column_stack([1.002 * truth[:, 0], truth[:, 1], truth[:, 2] + 0.03 * np.sin(truth[:, 2]) + 0.01 * truth[:, 0]])
        data = {"q_rad": truth, "xyz_m": 1.0005 * problem.predict(wave)}
        data = {"q1_rad": truth[:, 0], "q2_m": truth[:, 1], "q3_rad": truth[:, 2], "xyz_m": data["xyz_m"]}
        arms = [problem, problem.identify(data)]
        q = truth[:5]
        assert problem.jacobian(np.insert(q, 2, 0.0, axis=1)).shape == (5, 3, 4)
    for arm in arms:
        jacobian = arm.jacobian(q)
        assert jacobian.shape == (len(q), 3, q.shape[1])
        step = 1e-5
        for joint, direction in enumerate(np.eye(q.shape[1])):
            difference = (arm.predict(q + step * direction) - arm.predict(q - step * direction)) / (2 * step)
            np.testing.assert_allclose(jacobian[:, :, joint], difference, rtol=0, atol=2e-8)
    np.testing.assert_array_equal(arms[1].jacobian(q[0]), arms[1].jacobian(q)[0])


def test_tables_of_configurations() -> None:
    """Shapes of tables are not those of arrays: a table with as many columns as joints is none of all joints."""
    problem = flexcal.Problem(FOLLOWING)
    q = np.random.default_rng(5).uniform(-1.0, 1.0, (6, 3))
    expected = problem.jacobian(q, time_s=0.0)
    columns = {"q1_rad": q[:, 0], "q2_m": q[:, 1], "q3_rad": q[:, 2], "time_s": np.zeros(6)}
    for table in (columns, pd.DataFrame(columns)):
        np.testing.assert_array_equal(problem.jacobian(table), expected)
    np.testing.assert_array_equal(problem.predict(q[0]), problem.predict(q)[0])


def test_covariates_of_ones_own() -> None:
    effect = "[[effect]]\ncovariate = { joint = 4, of = 'tilt_deg' }\n[data.covariates]\n'tilt_deg' = 'tilt of the carriage'\n"
    head, mark, tail = FOLLOWING.partition("[parameters]")
    plain = flexcal.Problem(FOLLOWING)
    problem = flexcal.Problem(head + effect.split("[data")[0] + mark + tail + "[data" + effect.split("[data")[1])
    random = np.random.default_rng(6)
    q, tilt = random.uniform(-2.0, 2.0, (60, 3)), random.uniform(-2.0, 2.0, 60)
    # Joint 4 is the third that moves.
    moved = plain.predict(q + np.outer(tilt, [0.0, 0.0, 2e-3]))
    data = {"q1_rad": q[:, 0], "q2_m": q[:, 1], "q3_rad": q[:, 2], "tilt_deg": tilt, "xyz_m": moved}
    for table in (data, pd.DataFrame({**data, "xyz_m": 0.0, **dict(zip(["x_m", "y_m", "z_m"], moved.T))}).drop(columns="xyz_m")):
        result = problem.identify(table)
        found = result.parameters.filter(like="covariate", axis=0)
        np.testing.assert_allclose(found["estimate"], 2e-3, rtol=1e-3)
        np.testing.assert_allclose(result.predict(q, tilt_deg=tilt), moved, atol=1e-7)
    assert abs(result.predict(q[0], tilt_deg=1.0) - result.predict(q[0], tilt_deg=0.0)).max() > 1e-4
    for wrong, words in ((q, "column tilt_deg: missing"), ({**data, "tilt_deg": tilt[:-1]}, "59 values, and 60 in the first column")):
        with pytest.raises(flexcal.InputError, match=words) as caught:
            result.predict(wrong)
        assert caught.value.key == "column tilt_deg"


def test_shapes_that_fit_no_arm(lunar: flexcal.Problem) -> None:
    with pytest.raises(flexcal.InputError, match="shape 2 × 3") as caught:
        lunar.predict(np.zeros((2, 3)))
    assert caught.value.key == "q"
    with pytest.raises(flexcal.InputError, match="finite"):
        lunar.predict(np.full((2, 4), np.nan))


def test_tables_whose_unit_the_argument_states() -> None:
    problem = flexcal.Problem(FOLLOWING)
    q = np.random.default_rng(3).uniform(-1.0, 1.0, (4, 3))
    expected = problem.predict(q_rad=q)
    table = pd.DataFrame(q, columns=["q1", "q2", "q3"])
    assert np.array_equal(problem.predict(q_rad=table), expected)
    degrees = table.assign(q1=np.degrees(table["q1"]), q3=np.degrees(table["q3"]))
    assert np.allclose(problem.predict(q_deg=degrees), expected, rtol=0.0, atol=1e-12)
    with pytest.raises(flexcal.InputError, match="unit"):
        problem.predict(table)
    with pytest.raises(flexcal.InputError, match="keep one of the two"):
        problem.predict(q_rad=table.assign(q1_rad=0.0))
