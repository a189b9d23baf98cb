"""Tables whose columns have names go by these, wherever they stand; names and units that contradict each other are refused."""

from __future__ import annotations

from typing import Any

import flexcal
import numpy as np
import pandas as pd
import pytest
from conftest import LUNAR, exact

FRAME = exact(LUNAR / "measurements.csv")
DEGREES = [f"q{k}_deg" for k in range(1, 5)]
AXES = ["x_mm", "y_mm", "z_mm"]
OTHERS = {str(name): FRAME[name].to_numpy() for name in FRAME if name not in (*DEGREES, *AXES)}


def bare(columns: list[str]) -> pd.DataFrame:
    """Columns without their unit."""
    return FRAME[columns].rename(columns=lambda name: name.rpartition("_")[0])


def shuffled(table: pd.DataFrame) -> pd.DataFrame:
    return table[table.columns[::-1]]


def test_tables_in_a_dict_go_by_their_names(lunar: flexcal.Problem, identified: flexcal.Identification) -> None:
    polars = pytest.importorskip("polars")
    q, points = bare(DEGREES), bare(AXES)
    named = q.set_axis(lunar.joints, axis=1)
    of_polars = polars.DataFrame({name: named[name].to_numpy() for name in reversed(lunar.joints)})
    unnamed = q.set_axis(range(4), axis=1)
    for configurations in (q, shuffled(q), shuffled(named), of_polars, unnamed, shuffled(FRAME[DEGREES])):
        found = lunar.identify(OTHERS | {"q_deg": configurations, "xyz_mm": shuffled(points)})
        assert found.parameters.equals(identified.parameters)
    commands = identified.compensate({"q_deg": shuffled(q).head(3), "xyz_mm": shuffled(points).head(3), "hoist_N": np.full(3, 60.0)})
    expected = identified.compensate(FRAME.head(3)[[*DEGREES, *AXES]].assign(hoist_N=60.0))
    assert commands.commands.equals(expected.commands)


@pytest.mark.parametrize(
    ("columns", "key", "words"),
    [
        ({"q_deg": bare(DEGREES).set_axis(list("abcd"), axis=1)}, "column q_deg", "its column a is none of"),
        ({"q_rad": FRAME[DEGREES]}, "column q_rad", "its column q1_deg is none of"),
        ({"xyz_m": FRAME[AXES]}, "column xyz_m", "its column x_mm is none of x, y, z"),
        ({"payload_kg": FRAME[AXES]}, "column payload_kg", "alone may have two dimensions"),
    ],
)
def test_other_names_are_refused(lunar: flexcal.Problem, columns: dict[str, Any], key: str, words: str) -> None:
    given = OTHERS | {"q_deg": FRAME[DEGREES].to_numpy(), "xyz_mm": FRAME[AXES].to_numpy()} | columns
    with pytest.raises(flexcal.InputError, match=words) as caught:
        lunar.identify(given)
    assert (caught.value.key, caught.value.file) == (key, "data")


def test_a_series_of_names_is_one_configuration(lunar: flexcal.Problem) -> None:
    row = FRAME[DEGREES].iloc[5]
    expected = lunar.predict(q_deg=row.to_numpy(), hoist_N=60.0)
    turned = row[::-1]
    names = turned.rename(lambda name: name.removesuffix("_deg"))
    for found in (
        lunar.predict(q_deg=names, hoist_N=60.0),
        lunar.predict(q_deg=turned, hoist_N=60.0),
        lunar.predict(pd.concat([turned, pd.Series({"hoist_N": 60.0})])),
    ):
        assert found.shape == (3,)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)
    assert lunar.jacobian(q_deg=names, hoist_N=60.0).shape == (3, 4)
    # Numbers of rows are no names.
    np.testing.assert_array_equal(lunar.predict(q_deg=row.reset_index(drop=True), hoist_N=60.0), expected)
    with pytest.raises(flexcal.InputError, match="needs a unit"):
        lunar.predict(names)


def test_units_that_contradict_the_argument(lunar: flexcal.Problem) -> None:
    with pytest.raises(flexcal.InputError, match="q_rad= states another unit") as caught:
        lunar.predict(q_rad=FRAME[DEGREES])
    assert caught.value.key == "column q1_deg"
    expected = lunar.predict(FRAME[DEGREES].assign(hoist_N=60.0))
    np.testing.assert_array_equal(lunar.predict(q_deg=FRAME[DEGREES].assign(hoist_N=60.0)), expected)


def test_a_table_without_units_is_told_how_to_state_them(lunar: flexcal.Problem) -> None:
    table = FRAME.rename(columns=lambda name: name.removesuffix("_deg").removesuffix("_mm"))
    with pytest.raises(flexcal.InputError, match=r"needs a unit; write .*table\[problem.joints\]") as caught:
        lunar.identify(table)
    assert (caught.value.file, caught.value.line, caught.value.key) == ("data", 1, "column q1")


def test_a_column_that_stands_twice(lunar: flexcal.Problem) -> None:
    with pytest.raises(flexcal.InputError, match="stands twice") as caught:
        lunar.identify(pd.concat([FRAME, FRAME[["x_mm"]]], axis=1))
    assert caught.value.key == "column x_mm"


def test_a_missing_number_is_called_so(lunar: flexcal.Problem, identified: flexcal.Identification) -> None:
    polars = pytest.importorskip("polars")
    pyarrow = pytest.importorskip("pyarrow")
    gap = [*FRAME["x_mm"].tolist()[:2], None, *FRAME["x_mm"].tolist()[3:]]
    columns = {str(name): FRAME[name].tolist() for name in FRAME}
    tables = [
        polars.DataFrame(columns | {"x_mm": gap}),
        pyarrow.table(columns | {"x_mm": gap}),
        FRAME.assign(x_mm=pd.array(gap, dtype="Float64")),
    ]
    for table in tables:
        with pytest.raises(flexcal.InputError, match="the cell is empty") as caught:
            lunar.identify(table)
        assert (caught.value.line, caught.value.key) == (4, "column x_mm")
    # A type that may have gaps and has none is read to the last bit.
    whole = FRAME.assign(x_mm=FRAME["x_mm"].astype("Float64"))
    assert lunar.identify(whole).parameters.equals(identified.parameters)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("identify", 'flexcal.Problem("FOLDER").identify(…)'),
        ("calibrate", 'flexcal.Problem("FOLDER").identify(…)'),
        ("load", 'write flexcal.Problem("FOLDER")'),
        ("compensate", 'flexcal.Problem("FOLDER").identify().compensate'),
    ],
)
def test_functions_that_are_methods_are_named(name: str, words: str) -> None:
    with pytest.raises(AttributeError) as caught:
        getattr(flexcal, name)
    assert words in str(caught.value)


def test_results_of_a_problem_that_is_not_identified_are_named(lunar: flexcal.Problem) -> None:
    for name in ("compensate", "watch", "export_urdf", "parameters"):
        with pytest.raises(AttributeError, match=rf"problem\.identify\(\)\.{name}"):
            getattr(lunar, name)
    with pytest.raises(AttributeError, match="write identify"):
        getattr(lunar, "fit")
    assert not hasattr(lunar, "nothing") and not hasattr(flexcal, "__path_of_nothing__")
    with pytest.raises(flexcal.InputError, match=r"write 0\.3 for 30 %"):
        lunar.identify(FRAME, held_out=30)
    with pytest.raises(TypeError, match=r"join them: pandas\.concat"):
        tables: Any = [FRAME[:9], FRAME[9:]]
        lunar.identify(tables)
