"""Every mistake that the command line finds in its input is an InputError, in the same words and at the same place."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path

import flexcal
import pytest
from conftest import LUNAR, ROOT
from flexcal import _core

PROBLEM = (LUNAR / "problem.toml").read_text()
TABLE = (LUNAR / "measurements.csv").read_text()
RIGID, TRUTH = ((ROOT / "tests" / "corpus" / part / "rigid.toml").read_text() for part in ("problem", "truth"))
URDF = (ROOT / "tests" / "urdf" / "odd.urdf").read_text()


def keys_changed(text: str) -> Iterator[str]:
    """Each line of a TOML file left out, twice, with another key, and with values that are none."""
    lines = text.splitlines()
    for place, line in enumerate(lines):
        key, equals, _ = line.partition("=")
        others = [[], [line, line]]
        if line.startswith("["):
            others += [[line.replace("]", "x]", 1)], [line.rstrip("]")]]
        elif equals:
            others += [[f"{key.rstrip()}x = 1"], *([f"{key}= {value}"] for value in ('"?"', "nan", "-1", "[1]", "true"))]
        elif not line.strip() or line.startswith("#"):
            continue
        for other in others:
            yield "\n".join([*lines[:place], *other, *lines[place + 1 :]])


def cells_changed(text: str) -> Iterator[str]:
    """Each column of a table left out, renamed, twice, and with cells that are no numbers; rows too short and too long."""
    rows = [line.split(",") for line in text.splitlines()[:12]]
    for column, name in enumerate(rows[0]):
        yield "\n".join(",".join(row[:column] + row[column + 1 :]) for row in rows)
        base = name.rpartition("_")[0] or name
        for header in (base, f"{base}_N", f"{name}x", rows[0][column - 1], ""):
            yield "\n".join(",".join([*row[:column], header if row is rows[0] else row[column], *row[column + 1 :]]) for row in rows)
        for cell in ("", "?", "nan", "inf", "1e400", "1 2", '"'):
            yield "\n".join(",".join([*row[:column], cell if k == 5 else row[column], *row[column + 1 :]]) for k, row in enumerate(rows))
    for wrong in (rows[5][:-1], [*rows[5], "1"], []):
        yield "\n".join(",".join(wrong if k == 5 else row) for k, row in enumerate(rows))
    yield from ("", "\n", rows[0][0], text.splitlines()[0], "PK\x03\x04", text.replace(",", ";", 5), text.replace(".", ","))


def lines_changed(text: str) -> Iterator[str]:
    """Each line of a URDF left out, twice, and with other words."""
    lines = text.splitlines()
    for place, line in enumerate(lines):
        for other in ([], [line, line], [line.replace('="', '="x', 1)], [line.replace("<", "<x", 1)], [line.replace('"/>', ' nan"/>')]):
            yield "\n".join([*lines[:place], *other, *lines[place + 1 :]])


@pytest.mark.parametrize(
    ("changed", "name", "least"),
    [
        (keys_changed(PROBLEM), "problem.toml", 300),
        (cells_changed(TABLE), "measurements.csv", 90),
        (islice(keys_changed(TRUTH), 0, None, 3), "TRUTH.toml", 30),
        (lines_changed(URDF), "arm.urdf", 150),
    ],
    ids=["problem", "table", "truth", "urdf"],
)
@pytest.mark.filterwarnings("ignore::flexcal.FlexcalWarning")
def test_mistakes(changed: Iterator[str], name: str, least: int, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "problem.toml").write_text(RIGID if name == "TRUTH.toml" else PROBLEM)
    file, out = tmp_path / name, str(tmp_path / "out")
    calls: dict[str, tuple[Callable[[], object], list[str]]] = {
        "problem.toml": (lambda: flexcal.Problem(file), ["identify", str(file)]),
        "measurements.csv": (lambda: flexcal.Problem(tmp_path).identify(), ["identify", str(tmp_path)]),
        "TRUTH.toml": (
            lambda: flexcal.Problem(tmp_path).check(poses=5, truth=file),
            ["check", str(tmp_path), "--poses", "5", "--truth", str(file)],
        ),
        "arm.urdf": (lambda: flexcal.Problem.from_urdf(file), ["init", str(file)]),
    }
    call, command = calls[name]
    mistakes = 0
    for text in changed:
        file.write_text(text)
        capfd.readouterr()
        try:
            call()
        except flexcal.InputError as error:
            status, said = _core.command_line(["flexcal", *command, "--out", out]), capfd.readouterr().err
            first = str(error).splitlines()[0]
            assert status == 2 and f"error: {first}\n" in said, (first, said, text)
            place = ":".join(str(part) for part in (error.file, error.line) if part is not None)
            assert error.file == str(file) and first.startswith(f"{place}: {error.key or ''}"), (first, error.key)
            mistakes += 1
    assert mistakes >= least
