"""Pixels of a camera as columns in memory."""

from __future__ import annotations

from typing import Any

import flexcal
import numpy as np
import pandas as pd
import polars as pl
import pytest
from conftest import ROOT

CAMERA = ROOT / "tests" / "observations" / "camera"


@pytest.fixture(scope="module")
def problem() -> flexcal.Problem:
    """The arm with a camera; the marker is called by the number of its tag."""
    return flexcal.Problem((CAMERA / "problem.toml").read_text().replace('name = "board"', 'name = "7"'))


@pytest.fixture(scope="module")
def pixels() -> pd.DataFrame:
    """The measured pixels, with the number of the tag as the marker."""
    return pd.read_csv(CAMERA / "data.csv").assign(marker=7)


@pytest.fixture(scope="module")
def as_words(problem: flexcal.Problem, pixels: pd.DataFrame) -> flexcal.Identification:
    return problem.identify(pixels.astype({"point": str, "marker": str}))


@pytest.mark.parametrize("kind", ["int64", "Int64", "int32", "float64", "polars", "dict"])
def test_whole_numbers_name_points_and_markers(
    problem: flexcal.Problem, pixels: pd.DataFrame, as_words: flexcal.Identification, kind: str
) -> None:
    columns: dict[str, Any] = {str(name): pixels[name].to_numpy() for name in pixels}
    tables: dict[str, Any] = {"polars": pl.from_dict(columns), "dict": columns}
    table = tables[kind] if kind in tables else pixels.astype({"point": kind, "marker": kind})
    assert problem.identify(table).parameters.equals(as_words.parameters)


def test_a_fraction_is_no_number_of_a_point(problem: flexcal.Problem, pixels: pd.DataFrame) -> None:
    with pytest.raises(flexcal.InputError, match=r"data:2: column point: 0\.5 is no point of the marker"):
        problem.identify(pixels.assign(point=pixels["point"] + 0.5))


def test_a_file_may_hold_points_as_floats(
    problem: flexcal.Problem, pixels: pd.DataFrame, as_words: flexcal.Identification, tmp_path: Any
) -> None:
    pixels.assign(point=pixels["point"].astype(np.float64)).to_csv(tmp_path / "data.csv", index=False)
    assert problem.identify(tmp_path / "data.csv").parameters.equals(as_words.parameters)
