"""Predictions as arrays: parts, copies and pickles of them, and their uncertainty."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import flexcal
import numpy as np
import pytest
from conftest import LUNAR, exact

FRAME = exact(LUNAR / "measurements.csv")
Q = np.deg2rad(FRAME[[f"q{k}_deg" for k in range(1, 5)]].to_numpy())


@pytest.fixture(scope="module")
def predicted(identified: flexcal.Identification) -> flexcal.Prediction:
    return identified.predict(Q, hoist_N=60.0)


@pytest.mark.parametrize("key", [0, -1, np.int64(3), slice(3), slice(None, None, 2), [1, 4], np.arange(len(Q)) < 5, ...])
def test_poses_keep_their_uncertainty(predicted: flexcal.Prediction, key: Any) -> None:
    part = predicted[key]
    assert isinstance(part, flexcal.Prediction)
    np.testing.assert_array_equal(part, np.asarray(predicted)[key])
    for of_part, whole in (
        (part.covariance, predicted.covariance),
        (part.sigma, predicted.sigma),
        (part.bound(0.9), predicted.bound(0.9)),
        (part.extrapolated, predicted.extrapolated),
    ):
        np.testing.assert_array_equal(of_part, whole[key])


def test_what_is_computed_has_none(predicted: flexcal.Prediction) -> None:
    for key in ((0, 1), (slice(None), 0), np.asarray(predicted) > 0.0, None):
        assert not isinstance(predicted[key], flexcal.Prediction)
    for plain in (predicted.copy(), 1e3 * predicted, predicted - predicted[0], predicted[0][:2]):
        assert type(plain) is np.ndarray and not hasattr(plain, "covariance")
    assert not hasattr(predicted.T, "covariance")
    with pytest.raises(AttributeError, match="computed from a prediction"):
        _ = predicted.T.bound95
    assert [pose.covariance.shape for pose in predicted] == len(Q) * [(3, 3)]


def test_pickles_and_copies(predicted: flexcal.Prediction) -> None:
    predicted.bound(0.9)
    for whole in (predicted, predicted[0], predicted[2:5]):
        whole.bound(0.9)
        pickles = [pickle.loads(pickle.dumps(whole, protocol)) for protocol in range(pickle.HIGHEST_PROTOCOL + 1)]
        for again in (*pickles, copy.copy(whole), copy.deepcopy(whole)):
            assert isinstance(again, flexcal.Prediction) and np.array_equal(again, whole)
            assert np.array_equal(again.covariance, whole.covariance) and np.array_equal(again.bound95, whole.bound95)
            assert np.array_equal(again.bound(0.9), whole.bound(0.9)) and np.array_equal(again.extrapolated, whole.extrapolated)
        with pytest.raises(ValueError, match=r"levels 0\.9, 0\.95 alone"):
            pickles[0].bound(0.5)


def test_they_cannot_be_changed(predicted: flexcal.Prediction) -> None:
    again = pickle.loads(pickle.dumps(predicted))
    for prediction in (predicted, predicted[:2], again):
        for values in (prediction, prediction.covariance, prediction.sigma, prediction.bound95, prediction.extrapolated):
            with pytest.raises(ValueError, match="read-only"):
                values[0] = 0
    mine = predicted.copy()
    mine[0] = 0.0
    assert predicted[0].any()


@pytest.mark.parametrize("kind", [object, str, np.float32, "longdouble"])
def test_numbers_of_any_type(lunar: flexcal.Problem, kind: Any) -> None:
    q = np.round(Q[:3], 3)
    np.testing.assert_allclose(lunar.predict(q.astype(kind), hoist_N=60.0), lunar.predict(q, hoist_N=60.0), rtol=0, atol=1e-6)
    table = {"q_rad": q.astype(kind), "hoist_N": np.full(3, 60.0).astype(kind)}
    np.testing.assert_allclose(lunar.predict(table), lunar.predict(q, hoist_N=60.0), rtol=0, atol=1e-6)
    for wrong in (np.array([["a", 0, 0, 0]], dtype=object), np.array([[True, 0, 0, 0]], dtype=object)):
        with pytest.raises(flexcal.InputError, match="neither numbers nor words"):
            lunar.predict(wrong)
