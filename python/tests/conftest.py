"""The lunar sampler, and what the command line makes of it."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import flexcal
import numpy as np
import pandas as pd
import pytest
from flexcal._tables import table

ROOT = Path(__file__).parents[2]
LUNAR = ROOT / "problems" / "lunar-sampler"
UR10_DATA = [ROOT.parent / "shared" / "measured" / "ur10-ipa" / f"session_{letter}.csv" for letter in "ABC"]

Command = Callable[..., Any]


@pytest.fixture(scope="session")
def command(tmp_path_factory: pytest.TempPathFactory) -> Command:
    """Runs the command line of the package, its results in a folder or in a file of one; what became of it, and the folder."""

    def run(*arguments: object, file: str = "") -> tuple[subprocess.CompletedProcess[str], Path]:
        out = tmp_path_factory.mktemp("out")
        words = [sys.executable, "-m", "flexcal", *map(str, arguments), "--out", str(out / file)]
        return subprocess.run(words, capture_output=True, text=True, check=False), out

    return run


@pytest.fixture(scope="session")
def lunar() -> flexcal.Problem:
    return flexcal.Problem(LUNAR)


@pytest.fixture(scope="session")
def identified(lunar: flexcal.Problem) -> flexcal.Identification:
    return lunar.identify()


@pytest.fixture(scope="session")
def closed(lunar: flexcal.Problem) -> flexcal.ClosedLoop:
    return lunar.loop()


def exact(file: Path) -> pd.DataFrame:
    """A table to the last bit, as the pandas before 3.1 reads it on request alone."""
    return table(file.read_text())


def assert_written(residuals: pd.DataFrame, file: Path) -> None:
    """Residuals are those of a residuals.csv, as far as that has decimals."""
    written = exact(file)
    assert list(residuals) == list(written)
    decimals = {"line": 0, "pose": 15, "mm": 6, "deg": 7, "whitened": 4}
    for name in map(str, written):
        count = decimals.get("mm" if "tilt" in name else name.rpartition("_")[2])
        if count is None:
            # Truth values are true and false in the file.
            words, kept = (
                [value if isinstance(value, str) else str(value).lower() for value in table[name]]
                for table in (residuals, written)
            )
            assert words == kept, name
        else:
            # What a row of another kind has none of is an empty cell.
            cells = pd.to_numeric(written[name], errors="coerce")
            np.testing.assert_allclose(residuals[name], cells, rtol=0, atol=0.501 * 10.0**-count, err_msg=name)


def timeless(text: str) -> Any:
    """A result without the time that it took."""
    document = json.loads(text)
    document.pop("seconds", None)
    for key in ("seconds", "digest"):
        document.get("digest", {}).pop(key, None)
    return document
