"""From a URDF to a calibrated one, as the command line does it."""

from __future__ import annotations

import json
from pathlib import Path

import flexcal
import numpy as np
import pandas as pd
import pytest
from conftest import Command, ROOT

ODD = ROOT / "tests" / "urdf" / "odd.urdf"


@pytest.mark.parametrize(
    ("urdf", "base", "tip", "words"),
    [
        (ODD, None, "tool", None),
        (ROOT / "tests" / "corpus" / "urdf" / "plain.urdf", "base", None, None),
        (ODD, None, None, "several links end the tree"),
        (ODD, "nowhere", "tool", 'no link is called "nowhere"'),
        (ODD, "hand", "base", 'link "base" is not below link "hand"'),
        ("none.urdf", None, None, "no such file"),
        ("<robot name='broken'>\n<link/>\n</robot>", None, None, "no attribute name"),
    ],
)
def test_from_urdf(
    urdf: Path | str, base: str | None, tip: str | None, words: str | None, command: Command, tmp_path: Path
) -> None:
    if isinstance(urdf, str) and urdf.startswith("<"):
        text, urdf = urdf, tmp_path / "broken.urdf"
        urdf.write_text(text)
    ends = [word for name, link in (("--base", base), ("--tip", tip)) if link for word in (name, link)]
    run, out = command("init", urdf, *ends)
    if words is None:
        problem = flexcal.Problem.from_urdf(urdf, base, tip)
        assert problem.text == (out / "problem.toml").read_text()
        *notes, target, sigma, held_out = problem.notes
        assert notes and all(f"note: {note}\n" in run.stdout for note in notes)
        # What is left to fill in.
        for note, name in ((target, "target_m"), (sigma, "position_sigma_mm"), (held_out, "held_out")):
            words = note.removeprefix("fill in ").removeprefix(f"{name}: ")
            assert f"{name} " in run.stdout and words.split(";")[0].split(" in the frame")[0] in run.stdout
        return
    with pytest.raises(flexcal.InputError, match=words) as caught:
        flexcal.Problem.from_urdf(urdf, base, tip)
    assert run.returncode == 2 and str(caught.value) in run.stderr
    assert (caught.value.file, caught.value.line) == (str(urdf), 2 if "broken" in str(urdf) else None)


def test_export_urdf(command: Command, tmp_path: Path) -> None:
    problem = flexcal.Problem.from_urdf(ODD, tip="tool")
    random = np.random.default_rng(5)
    q = pd.DataFrame(random.uniform(-1.0, 1.0, (60, 4)), columns=["rail_m", "shoulder_rad", "elbow_rad", "wrist_rad"])
    q["rail_m"] *= 0.4
    shift = 1e-3 * np.sin(3.0 * q["elbow_rad"].to_numpy())[:, None] + random.normal(0.0, 5e-5, (60, 3))
    measured = q.assign(**dict(zip(["x_m", "y_m", "z_m"], (problem.predict(q) + shift).T, strict=True)))
    result = problem.identify(measured)
    exported = result.export_urdf(ODD)
    # The same by the command line, to the byte.
    (tmp_path / "problem.toml").write_text(problem.text)
    measured.to_csv(tmp_path / "measurements.csv", index=False)
    _, out = command("identify", tmp_path)
    estimate = ["--estimate", out / "estimate.json"]
    run, out = command("export", tmp_path, *estimate, "--urdf", ODD, "--json", file="calibrated.urdf")
    assert exported.text == (out / "calibrated.urdf").read_text()
    assert exported.to_dict() == json.loads(run.stdout) | {"file": None}
    run, _ = command("export", tmp_path, *estimate, "--urdf", ODD, file="calibrated.urdf")
    assert run.stdout.startswith(exported.summary())
    exported.write(tmp_path / "written.urdf")
    assert (tmp_path / "written.urdf").read_bytes() == exported.text.encode()
    assert set(exported.origins.index) >= {"shoulder", "elbow", "wrist", "flange"} and exported.origins["moved_mm"].min() >= 0.0
    assert exported.errors["n"].tolist() == 2 * [int(result.residuals["held_out"].sum())]
    assert exported.errors["mean_mm"]["whole"] == pytest.approx(result.errors["mean_mm"]["identified", "held_out"])
    assert any("base and target" in what for what in exported.not_held)
    # The same geometry, since nothing else is in the model; arguments without effect are refused.
    alone = result.export_urdf(ODD, fitted_alone=True)
    assert list(alone.errors.index) == ["whole", "rigid", "identified"] and "Base and tool" in alone.summary()
    with pytest.raises(TypeError, match="workspace_mm"):
        result.export_urdf(ODD, workspace_mm=[0, 1, 0, 1, 0, 1])
    with pytest.raises(TypeError, match="keep one"):
        result.export_urdf(ODD, True, fitted_alone=True)
    # The URDF of another arm is refused.
    other = tmp_path / "other.urdf"
    other.write_text(ODD.read_text().replace("0.45 0 0.02", "0.55 0 0.02"))
    with pytest.raises(flexcal.InputError, match="differs from the URDF") as caught:
        result.export_urdf(other)
    run, _ = command("export", tmp_path, *estimate, "--urdf", other)
    assert run.returncode == 2 and str(caught.value) in run.stderr and caught.value.file == str(other)


@pytest.mark.filterwarnings("ignore::flexcal.FlexcalWarning")
def test_sigma_and_held_out_rows_are_arguments(tmp_path: Path) -> None:
    bench = ROOT / "problems" / "bench-arm"
    problem = flexcal.Problem.from_urdf(bench / "arm.urdf", position_sigma_mm=0.1, held_out=0.2)
    assert "position_sigma_mm = 0.1 " in problem.text and "held_out = { fraction = 0.2, seed = 1 } " in problem.text
    assert [note.partition(":")[0] for note in problem.notes[-1:]] == ["fill in target_m"]
    fitted = problem.identify(bench / "measurements.csv", held_out="none")
    assert 'held_out = "none"' in fitted.problem.text and fitted.held_out_error.rows == "left_out"
    assert problem.identify(bench / "measurements.csv").held_out_error.rows == "held_out"
    for wrong in (1.5, 0, "", True):
        with pytest.raises(flexcal.InputError, match="held_out: .* is neither"):
            problem.identify(held_out=wrong)
    with pytest.raises(flexcal.InputError, match="is not above 0"):
        flexcal.Problem.from_urdf(bench / "arm.urdf", position_sigma_mm=-1.0)
    load = {"target_m": (0.01, 0, 0.2), "payload_kg": 4, "payload_at_m": np.array([0, 0, 0.1]), "reference_temperature_C": 21}
    loaded = flexcal.Problem.from_urdf(bench / "arm.urdf", **load)  # type: ignore[arg-type]
    for line in ("target_m = [0.01, 0.0, 0.2] ", "payload_kg = 4.0", "payload_at_m = [0.0, 0.0, 0.1]", "reference_temperature_C = 21.0"):
        assert line in loaded.text
    assert not any("target_m" in note for note in loaded.notes)
    with pytest.raises(flexcal.InputError, match="target_m: three finite numbers"):
        flexcal.Problem.from_urdf(bench / "arm.urdf", target_m=(0.0, 1.0))
    inline = flexcal.Problem("name = 'a'\n[[joint]]\na_m = 0.5\n")
    with pytest.raises(flexcal.InputError, match=r"no section \[data\]"):
        inline.identify(held_out="none")
    exported = fitted.export_urdf(bench / "arm.urdf")
    exported.write(tmp_path / "new" / "arm.urdf")
    assert (tmp_path / "new" / "arm.urdf").read_text() == exported.text
