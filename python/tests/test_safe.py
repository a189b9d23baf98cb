"""Results that last: after a fork, in a pickle, and against changes; arrays and numbers that are refused."""

from __future__ import annotations

import copy
import multiprocessing
import os
import pickle
import signal
from pathlib import Path
from typing import Any

import flexcal
import numpy as np
import pytest
from conftest import ROOT, exact

LUNAR = ROOT / "problems" / "lunar-sampler"
FRAME = exact(LUNAR / "measurements.csv")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_forked_child_calculates(lunar: flexcal.Problem, identified: flexcal.Identification) -> None:
    child = os.fork()
    if child == 0:
        signal.alarm(600)
        again = lunar.identify()
        os._exit(0 if again.parameters.equals(identified.parameters) else 1)
    assert os.waitpid(child, 0)[1] == 0


def fitted(text: str) -> float:
    problem = pickle.loads(bytes.fromhex(text))
    return float(problem.identify().parameters.loc["joint2.alpha", "estimate"])


@pytest.mark.parametrize("method", ["fork", "spawn"])
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_multiprocessing(method: str, lunar: flexcal.Problem, identified: flexcal.Identification) -> None:
    with multiprocessing.get_context(method).Pool(1) as pool:
        found = pool.map_async(fitted, [pickle.dumps(lunar).hex()]).get(timeout=600)
    assert found == [identified.parameters.loc["joint2.alpha", "estimate"]]


def test_pickles_and_copies(lunar: flexcal.Problem, identified: flexcal.Identification, closed: flexcal.ClosedLoop) -> None:
    q = np.zeros(len([unit for unit in lunar.units if unit is not None]))
    for again in (pickle.loads(pickle.dumps(identified)), copy.deepcopy(identified)):
        assert again.to_json() == identified.to_json() and again.summary() == identified.summary()
        assert again.parameters.equals(identified.parameters) and again.residuals.equals(identified.residuals)
        np.testing.assert_array_equal(again.covariance, identified.covariance)
        assert (again.predict(q) == identified.predict(q)).all(), "calculated again"
    loop = pickle.loads(pickle.dumps(closed))
    assert loop.effects.equals(closed.effects) and loop.verdict == closed.verdict
    assert loop.parameters.equals(closed.parameters) and loop.html == closed.html
    assert loop.closed_problem.text == closed.closed_problem.text
    plan = lunar.plan(5, truth=LUNAR / "TRUTH.toml")
    assert pickle.loads(pickle.dumps(plan)).poses.equals(plan.poses)
    again = pickle.loads(pickle.dumps(lunar))
    assert (again.text, again.files) == (lunar.text, lunar.files)


def test_correlation(identified: flexcal.Identification) -> None:
    table = identified.correlation
    assert list(table.index) == list(table.columns) == list(identified.parameters.index)
    known = identified.parameters["std_error"].notna().to_numpy()
    values = table.to_numpy()[np.ix_(known, known)]
    np.testing.assert_allclose(np.diag(values), 1.0, rtol=1e-12)
    assert (np.abs(values) <= 1.0 + 1e-9).all() and np.isnan(table.to_numpy()[~known]).all()


def test_results_cannot_be_changed(identified: flexcal.Identification) -> None:
    with pytest.raises(AttributeError, match="cannot be changed"):
        identified.parameters = None
    with pytest.raises(AttributeError, match="cannot be changed"):
        identified.note = "mine"
    with pytest.raises(ValueError, match="read-only"):
        identified.covariance[0, 0] = 1.0
    table = identified.parameters
    table["estimate"] = 0.0
    assert (identified.parameters["estimate"] != 0.0).any()
    document = identified.to_dict()
    document["identification"].clear()
    assert identified.to_dict()["identification"]


@pytest.mark.parametrize(
    ("changed", "line", "key", "words"),
    [
        ({"x_mm": np.ma.masked_greater(FRAME["x_mm"].to_numpy(), FRAME["x_mm"].max() - 1e-9)}, None, "column x_mm", "masked"),
        ({"q1_deg": FRAME["q1_deg"] > 0}, None, "column q1_deg", "neither numbers nor words"),
        ({"q1_deg": (FRAME["q1_deg"] > 0).to_numpy()}, None, "column q1_deg", "neither numbers nor words"),
        ({"x_mm": FRAME["x_mm"].to_numpy() + 0j}, None, "column x_mm", "neither numbers nor words"),
    ],
)
def test_arrays_that_are_no_numbers(lunar: flexcal.Problem, changed: dict[str, Any], line: int | None, key: str, words: str) -> None:
    columns = {str(name): FRAME[name].to_numpy() for name in FRAME}
    with pytest.raises(flexcal.InputError, match=words) as caught:
        lunar.identify(columns | changed)
    assert (caught.value.key, caught.value.file) == (key, "data")


def test_a_mask_that_masks_nothing_is_no_matter(lunar: flexcal.Problem, identified: flexcal.Identification) -> None:
    columns: dict[str, Any] = {str(name): FRAME[name].to_numpy() for name in FRAME}
    columns["x_mm"] = np.ma.masked_array(columns["x_mm"], mask=False)
    assert lunar.identify(columns).parameters.equals(identified.parameters)


@pytest.mark.parametrize("poses", [0, -1, 10**9, True, 2.5, "ten"])
def test_numbers_of_poses(lunar: flexcal.Problem, poses: Any) -> None:
    for call in (lunar.plan, lambda poses: lunar.check(poses=poses)):
        with pytest.raises(flexcal.InputError, match="not a whole number from 1 to 10000") as caught:
            call(poses)
        assert caught.value.key == "poses"
    with pytest.raises(flexcal.InputError, match="seed: -1"):
        lunar.plan(5, seed=-1)
    with pytest.raises(flexcal.InputError, match="workspace_mm: .* is not 6 finite numbers"):
        lunar.plan(5, workspace_mm=[0, 1])
    with pytest.raises(flexcal.InputError, match="the box is empty"):
        lunar.next(5, workspace_mm=[1, 0, 0, 1, 0, 1])


def test_numbers_of_threads(tmp_path: Path) -> None:
    import subprocess
    import sys

    code = f"import flexcal\ntry:\n flexcal.Problem({str(LUNAR)!r}).identify()\nexcept flexcal.InputError as error:\n print(error.key)"
    environment = os.environ | {"RAYON_NUM_THREADS": "100000"}
    run = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=600, check=True)
    assert run.stdout == "RAYON_NUM_THREADS\n", run.stderr
