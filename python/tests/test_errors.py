"""Mistakes arrive as InputError, with the place where they stand; nothing else crosses the boundary."""

from __future__ import annotations

import pickle
import signal
import subprocess
import sys
import threading
import time
import warnings
from pathlib import Path
from typing import Any

import flexcal
import numpy as np
import pandas as pd
import pytest
from conftest import Command, exact, LUNAR, ROOT

TEXT = (LUNAR / "problem.toml").read_text()
FRAME = exact(LUNAR / "measurements.csv")


@pytest.mark.parametrize(
    ("wrong", "right", "key"),
    [
        ("stiffness_N_m_per_rad = ", "stifness_N_m_per_rad = ", "joint[2].stifness_N_m_per_rad"),
        ("name = \"lunar-sampler\"", "name = 7", "name"),
        ("[statics]", "[statics", None),
    ],
)
def test_problems(wrong: str, right: str, key: str | None, command: Command, tmp_path: Path) -> None:
    assert wrong in TEXT
    broken = TEXT.replace(wrong, right, 1)
    line = next(k for k, text in enumerate(broken.splitlines(), 1) if right in text)
    with pytest.raises(flexcal.InputError) as caught:
        flexcal.Problem(broken)
    assert (caught.value.file, caught.value.line, caught.value.key) == ("<text>", line, key)
    # The same from a file, in the words of the command line.
    file = tmp_path / "problem.toml"
    file.write_text(broken)
    with pytest.raises(flexcal.InputError) as caught:
        flexcal.Problem(tmp_path)
    run, _ = command("identify", tmp_path)
    assert run.returncode == 2 and str(caught.value).splitlines()[0] in run.stderr
    assert caught.value.file == str(file)


def changed(**columns: Any) -> pd.DataFrame:
    return FRAME.assign(**columns)


@pytest.mark.parametrize(
    ("table", "line", "key", "words"),
    [
        (FRAME.drop(columns="y_mm"), 1, "column y", "missing"),
        (FRAME.rename(columns={"x_mm": "x"}), 1, "column x", "needs a unit"),
        (FRAME.rename(columns={"payload_kg": "paylod_kg"}), 1, "column paylod_kg", "payload_kg"),
        (changed(x_mm=np.where(FRAME["pose"] == 3, np.inf, FRAME["x_mm"])), 4, "column x_mm", "not a finite number"),
        (changed(x_mm=FRAME["x_mm"].astype(str).where(FRAME["pose"] != 2, "1,5")), 3, "column x_mm", "not a number"),
        (changed(split=FRAME["split"].where(FRAME["pose"] != 2, "test")), 3, "column split", "neither"),
        (changed(split=FRAME["split"].where(FRAME["pose"] != 2)), 3, "column split", "empty"),
        (FRAME.iloc[:0], 1, None, "no rows"),
        ({"q1_deg": [1.0, 2.0], "x_mm": [1.0]}, None, "column x_mm", "1 values, and 2 in the first column"),
        ({"x_mm": np.zeros((2, 2))}, None, "column x_mm", "two dimensions"),
        ({"q_deg": np.zeros((3, 60)), "x_mm": np.zeros(60)}, None, "column q_deg", "transpose the array"),
        ({"xyz_mm": np.zeros((3, 60))}, None, "column xyz_mm", r"\(rows, 3\) is needed"),
        (FRAME.set_axis(range(FRAME.shape[1]), axis=1), None, "data", "columns have numbers in place of names"),
        ({}, None, "data", "no columns"),
    ],
)
def test_tables(lunar: flexcal.Problem, table: Any, line: int | None, key: str | None, words: str) -> None:
    with pytest.raises(flexcal.InputError, match=words) as caught:
        lunar.identify(table)
    assert (caught.value.line, caught.value.key) == (line, key)
    assert caught.value.file == (None if key == "data" else "data")


def test_arguments(lunar: flexcal.Problem, tmp_path: Path) -> None:
    with pytest.raises(flexcal.InputError, match="none of joint") as caught:
        lunar.identify(strategy="all")  # type: ignore[arg-type]
    assert caught.value.key == "strategy"
    with pytest.raises(flexcal.InputError, match="no such file") as caught:
        lunar.identify(tmp_path / "none.csv")
    assert caught.value.file == str(tmp_path / "none.csv")
    with pytest.raises(flexcal.InputError, match="min_deg") as caught:
        flexcal.Problem(ROOT / "tests" / "golden").plan(10)
    assert caught.value.key == "joint[1].min_deg" and caught.value.file is not None
    truth = ROOT / "tests" / "cases" / "truth.toml"
    before, free = TEXT[: TEXT.index("[parameters]")], TEXT[TEXT.index("[parameters]") :]
    silent = "\n".join(line for line in TEXT.splitlines() if not line.startswith("position_sigma_mm"))
    for text, key in ((silent, "data.position_sigma_mm"), (before + free[free.index("[data]") :], "parameters")):
        with pytest.raises(flexcal.InputError, match="missing|nothing to identify") as caught:
            flexcal.Problem(text).check(poses=5, truth=truth)
        assert (caught.value.file, caught.value.key) == ("<text>", key)
    with pytest.raises(flexcal.InputError, match="absent.csv.*pass data=") as caught:
        flexcal.Problem(TEXT.replace("measurements.csv", "absent.csv")).identify()
    assert (caught.value.file, caught.value.key) == ("<text>", "data.files")
    with pytest.raises(TypeError, match="not int"):
        lunar.identify(7)
    arm = flexcal.Problem.from_urdf(ROOT / "tests" / "urdf" / "odd.urdf", tip="tool")
    with pytest.raises(flexcal.InputError, match="pass poses=, candidates= or data=") as named:
        arm.check()
    assert named.value.key == "poses"
    with pytest.raises(flexcal.InputError, match="not its text") as named:
        flexcal.Problem.from_urdf((ROOT / "tests" / "urdf" / "odd.urdf").read_text())
    assert named.value.key == "path" and len(str(named.value)) < 200
    with pytest.raises(TypeError, match="progress: a function, True or False"):
        lunar.identify(progress=3)  # type: ignore[arg-type]
    again = pickle.loads(pickle.dumps(caught.value))
    assert (str(again), again.file, again.key) == (str(caught.value), caught.value.file, caught.value.key)


def test_columns_passed_over_are_warnings(lunar: flexcal.Problem) -> None:
    with pytest.warns(flexcal.FlexcalWarning, match="operator") as caught:
        lunar.identify(FRAME.assign(operator="me"))
    assert all(own.filename == __file__ for own in caught)


def test_every_finding_that_is_a_warning_is_raised(closed: flexcal.ClosedLoop) -> None:
    gross = FRAME.index == FRAME.index[FRAME["split"] == "identification"][4]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = closed.closed_problem.identify(changed(x_mm=FRAME["x_mm"] + 5.0 * gross))
    expected = [own["text"] for own in found.findings if own["severity"] == "warning"]
    assert "influential-rows" in {own["code"] for own in found.findings}
    assert len(found.cautions) == len(expected)
    told = [str(own.message) for own in caught if own.category is flexcal.FlexcalWarning]
    assert all(text in caution and caution in told for text, caution in zip(expected, found.cautions, strict=True))


def test_progress(lunar: flexcal.Problem, capsys: pytest.CaptureFixture[str]) -> None:
    steps: list[flexcal.Progress] = []
    lunar.identify(progress=steps.append)
    assert steps[-1].cost < steps[0].cost and {step.unknowns for step in steps} >= {32}

    def stop(step: flexcal.Progress) -> None:
        raise LookupError(step.iteration)

    with pytest.raises(LookupError):
        lunar.loop(progress=stop)
    lunar.identify(progress=True)
    assert capsys.readouterr().out == ""


def many(rows: int) -> dict[str, Any]:
    """Poses of the lunar sampler with noise that no effect explains."""
    random = np.random.default_rng(1)
    repeated = {str(name): np.resize(FRAME[name].to_numpy(), rows) for name in FRAME if name != "pose"}
    for name in [*(f"q{k}_deg" for k in range(1, 5)), "x_mm", "y_mm", "z_mm"]:
        repeated[name] = repeated[name] + random.normal(0.0, 0.3, rows)
    if "time_s" in repeated:
        repeated["time_s"] = 60.0 * np.arange(rows)
    return repeated


def test_others_run_and_an_interrupt_is_heard(lunar: flexcal.Problem) -> None:
    ticks = 0
    running = True

    def tick() -> None:
        nonlocal ticks
        while running:
            ticks += 1
            time.sleep(0.001)

    # What runs in the background of a shell has its interrupts ignored, unless it asks for them.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    other = threading.Thread(target=tick)
    other.start()
    interrupt = threading.Timer(1.0, signal.raise_signal, [signal.SIGINT])
    interrupt.start()
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        lunar.loop(many(20_000))
    took = time.monotonic() - begin
    signal.signal(signal.SIGINT, before)
    running = False
    other.join()
    assert 0.9 < took < 3.0 and ticks > 100 * took


def test_the_command_line_is_the_same_program() -> None:
    script = Path(sys.executable).with_name("flexcal")
    for program in ([str(script)], [sys.executable, "-m", "flexcal"]):
        run = subprocess.run([*program, "--version"], capture_output=True, text=True, check=False)
        assert run.returncode == 0 and run.stdout.startswith("flexcal ")
        run = subprocess.run([*program, "identify", "nowhere"], capture_output=True, text=True, check=False)
        assert run.returncode == 2 and "no such file" in run.stderr


def test_rows_without_a_position_are_left_out(lunar: flexcal.Problem) -> None:
    gaps = changed(x_mm=np.where(FRAME["pose"] == 3, np.nan, FRAME["x_mm"]))
    with pytest.warns(flexcal.FlexcalWarning, match="1 row without a measurement"):
        found = lunar.identify(gaps)
    assert len(found.residuals) == len(FRAME) - 1
