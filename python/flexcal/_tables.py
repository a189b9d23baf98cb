"""Tables on their way in: from paths, frames, dicts and arrays to columns of numbers and words."""

from __future__ import annotations

import csv
import io
import operator
import os
import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

from .errors import FlexcalWarning, InputError

if TYPE_CHECKING:
    import pandas as pd

T = TypeVar("T")

Path: TypeAlias = str | os.PathLike[str]
"""A file."""

Data: TypeAlias = Path | Sequence[Path] | Mapping[str, Any] | Any
"""Measurements: a CSV file or several of one table, a DataFrame (pandas, polars, pyarrow or any other that speaks Arrow), a
structured array, or a dict of arrays. Names of columns and their units are those of files (``q1_deg``, ``x_mm``, ``split``);
in a dict one array may stand for several columns: ``q_rad`` or ``q_deg``, shape (rows, joints), ``xyz_mm`` or ``xyz_m``,
shape (rows, 3), and ``approach``, shape (rows, joints). A DataFrame in place of such an array is matched by the names of its
columns (joints, ``q1`` …, ``x``, ``y``, ``z``), not by their order; the key states their unit."""

Column: TypeAlias = bytes | tuple[bytes, list[str]]
"""Bytes of 64-bit numbers, or of the 64-bit numbers of words with the words."""
Region: TypeAlias = tuple[list[float] | None, list[list[float]]]
"""Box and planes [mm] of a workspace."""
Source: TypeAlias = list[Path] | tuple[str, list[tuple[str, Column]]]


def source(data: Data, joints: Sequence[str], argument: str = "data") -> Source:
    """What the reader takes: files, or the name of a table and its columns. ``joints`` are the names of the arm's joints."""
    if isinstance(data, (str, os.PathLike)):
        return [data]
    if isinstance(data, (list, tuple)) and data and all(isinstance(file, (str, os.PathLike)) for file in data):
        return list(data)
    columns = [part for name, values in _columns(data, argument) for part in _split(str(name), values, joints)]
    if not columns:
        raise InputError("data: no columns; give a table with columns such as q1_deg, x_mm, y_mm, z_mm", key="data")
    return "data", columns


def asked(read: Callable[[Source], T], given: Source) -> T:
    """What a reader makes of a source; its error on a table in memory says how the units of a whole table are stated."""
    try:
        return read(given)
    except InputError as error:
        if isinstance(given, tuple) and "the first line holds numbers" in str(error):
            message = (
                "data: the columns have numbers in place of names; name them, as in "
                'table.columns = ["q1_deg", "q2_deg", …, "x_mm", "y_mm", "z_mm"]'
            )
            raise InputError(message, key="data") from None
        if not isinstance(given, tuple) or "needs a unit" not in str(error):
            raise
        message = (
            f"{error}; for a whole table, pass "
            '{"q_rad": table[problem.joints], "xyz_mm": table[["x", "y", "z"]]}, whose keys state the units (q_deg, xyz_m likewise)'
        )
        raise InputError(message, file=error.file, line=error.line, key=error.key) from None


class Shape(NamedTuple):
    """How configurations were given."""

    single: bool
    """One configuration alone, not a row of them."""
    every_joint: bool
    """An array with a column for every joint, fixed ones as well."""


def configurations(
    argument: str, q: Any, units: Sequence[str | None], columns: Mapping[str, Any], joints: Sequence[str]
) -> tuple[Source, Shape]:
    """Configurations with further columns as a table, and how they were given.

    ``argument`` is the one that takes ``q``: ``q``, ``q_rad`` or ``q_deg``. ``units`` holds for each of the ``joints`` the unit of its
    command, None at fixed joints. A value of ``columns`` may be one for all rows. Unless the argument is ``q``, columns of a table
    that bear the names of joints without a unit have these units.
    """
    one_row = _named_values(q)
    if one_row is not None:
        # A Series with the names of joints is one configuration, whose further columns have one value each.
        table_of_one = one_row | {name: [value] for name, value in columns.items()}
        poses = table_of_one if argument == "q" else _with_units(argument, table_of_one, units, joints)
        return source(poses, joints), Shape(single=True, every_joint=False)
    if isinstance(q, (str, os.PathLike, Mapping)) or hasattr(q, "columns") or hasattr(q, "column_names"):
        if columns:
            q = _with_columns(q, columns)
        poses = q if argument == "q" else _with_units(argument, q, units, joints)
        return source(poses, joints), Shape(single=False, every_joint=False)
    values = _reals("q", _plain("q", q, "q"))
    single = values.ndim == 1
    values = np.atleast_2d(values)
    moving = [unit for unit in units if unit is not None]
    if values.ndim != 2 or values.shape[1] not in (len(units), len(moving)):
        shape = " × ".join(str(size) for size in np.shape(q))
        message = f"q: shape {shape}; an array of shape (poses, joints) has {len(moving)} columns here"
        raise InputError(message, key="q")
    every_joint = values.shape[1] == len(units)
    if every_joint:
        values = values[:, [k for k, unit in enumerate(units) if unit is not None]]
    # Without their numbers joints go by their order among those that move.
    table: dict[str, Any] = {f"q{k + 1}_{unit}": values[:, k] for k, unit in enumerate(moving)}
    for name, value in columns.items():
        one_each = np.ndim(_plain(name, value, "q")) > 0
        table[name] = value if one_each else np.full(len(values), value)
    return source(table, joints), Shape(single, every_joint)


def _with_columns(q: Any, columns: Mapping[str, Any]) -> Any:
    """A table of poses with further columns; a value of ``columns`` may be one for all rows."""
    if hasattr(q, "assign"):
        return q.assign(**columns)
    if not isinstance(q, Mapping):
        raise TypeError("columns go into the table of poses itself")
    rows = max((len(value) for value in q.values()), default=1)
    spread = {name: value if np.ndim(value) > 0 else np.full(rows, value) for name, value in columns.items()}
    return {**q, **spread}


def _named_values(q: Any) -> dict[str, Any] | None:
    """The values of a pandas Series whose index holds names, as columns of one row; None of anything else."""
    labels = getattr(q, "index", None)
    if getattr(q, "ndim", None) != 1 or callable(labels) or labels is None or not _are_names(labels):
        return None
    _refuse_twice([str(label) for label in labels])
    return {str(label): [value] for label, value in zip(labels, q, strict=True)}


def _are_names(labels: Iterable[Any]) -> bool:
    return any(isinstance(label, str) for label in labels)


def _with_units(argument: str, q: Any, units: Sequence[str | None], joints: Sequence[str]) -> Any:
    """A table of poses whose columns of joints all name their unit."""
    if isinstance(q, (str, os.PathLike)):
        return q
    moving = [(name, unit) for name, unit in zip(joints, units, strict=True) if unit is not None]
    # Numbers count the moving joints, or all joints.
    numbered = {f"q{k + 1}": unit for k, unit in enumerate(units) if unit is not None}
    named = numbered | dict(moving) | {f"q{k + 1}": unit for k, (_, unit) in enumerate(moving)}
    renamed: dict[str, Any] = {}
    other = "deg" if argument == "q_rad" else "rad"
    for name, values in _columns(q):
        written = f"{name}_{named[name]}" if name in named else name
        joint, _, unit = str(name).rpartition("_")
        if unit == other and joint in named:
            raise InputError(
                f"column {name}: {argument}= states another unit; pass the table as q=, where names of columns state the units",
                key=f"column {name}",
            )
        if written in renamed:
            raise InputError(f"column {name}: given already as {written}; keep one of the two", key=f"column {name}")
        renamed[written] = values
    return renamed


def table(text: str) -> pd.DataFrame:
    """A CSV text as a frame, its numbers to the last bit."""
    import pandas as pd

    header, *rows = csv.reader(io.StringIO(text))
    columns = zip(header, zip(*rows, strict=True), strict=True)
    return pd.DataFrame({name: _parsed(cells) for name, cells in columns})


def _parsed(cells: Sequence[str]) -> Any:
    known = set(cells)
    if known and known <= {"true", "false"}:
        return np.array([cell == "true" for cell in cells], dtype=np.bool_)
    for kind in (int, float):
        try:
            return [kind(cell) for cell in cells]
        except ValueError:
            pass
    return list(cells)


def warn(messages: Iterable[str], stacklevel: int) -> None:
    """Warns of each; ``stacklevel`` counts from the caller."""
    for message in messages:
        warnings.warn(message, FlexcalWarning, stacklevel=stacklevel + 1)


def _columns(data: Any, argument: str = "data") -> Iterator[tuple[Any, Any]]:
    if isinstance(data, Mapping):
        yield from data.items()
    elif isinstance(data, np.ndarray) and data.dtype.names is not None:
        yield from ((name, data[name]) for name in data.dtype.names)
    elif hasattr(data, "columns") and not isinstance(data, np.ndarray) and not hasattr(data, "column_names"):
        _refuse_twice([str(name) for name in data.columns])
        yield from ((name, data[name]) for name in data.columns)
    elif hasattr(data, "column_names"):
        yield from zip(data.column_names, data.columns, strict=True)
    elif hasattr(data, "__arrow_c_stream__"):
        import pyarrow

        yield from _columns(pyarrow.table(data))
    else:
        kind = type(data).__name__
        if isinstance(data, (list, tuple)) and data and all(hasattr(table, "columns") for table in data):
            raise TypeError(
                f"{argument}: one table is needed, not a {kind} of {len(data)}; join them: pandas.concat([…], ignore_index=True)"
            )
        raise TypeError(
            f"{argument}: a path, a DataFrame or a dict of arrays is needed, not {kind}; for arrays with a row for each pose "
            'write {"q_deg": q, "xyz_mm": xyz}'
        )


def _refuse_twice(names: Sequence[str]) -> None:
    for place, name in enumerate(names):
        if name in names[:place]:
            raise InputError(f"column {name}: stands twice in the table; keep one of the two", file="data", key=f"column {name}")


def _split(name: str, values: Any, joints: Sequence[str]) -> Iterator[tuple[str, Column]]:
    """Its columns: more than one where an array has two dimensions, by their names where they have names."""
    if hasattr(values, "columns") and not isinstance(values, (np.ndarray, Mapping)) and _is_labelled(values):
        yield from _split_by_name(name, values, joints)
        return
    if getattr(values, "ndim", None) != 2 and not _is_nested(values):
        yield name, _column(name, values)
        return
    array = _plain(f"column {name}", values, "data")
    base, _, unit = name.partition("_")
    suffix = f"_{unit}" if unit else ""
    most = {"xyz": 3, "q": len(joints), "approach": len(joints)}.get(base, 0)
    rows, columns = array.shape
    if rows <= most < columns:
        wanted = "(rows, 3)" if base == "xyz" else "(rows, joints)"
        message = f"column {name}: shape {array.shape}, and {wanted} is needed, with a row for each pose; transpose the array (.T)"
        raise InputError(message, file="data", key=f"column {name}")
    if base == "xyz" and array.shape[1] == 3:
        parts = ["x", "y", "z"]
    elif base in ("q", "approach"):
        parts = [f"{base}{k + 1}" for k in range(array.shape[1])]
    else:
        raise _no_second_dimension(name, f"shape {array.shape}")
    for k, part in enumerate(parts):
        yield part + suffix, _column(part + suffix, array[:, k])


def _is_labelled(values: Any) -> bool:
    """True of a DataFrame whose columns have names, and not numbers."""
    labels = getattr(values, "column_names", values.columns)
    return _are_names(labels)


def _split_by_name(name: str, values: Any, joints: Sequence[str]) -> Iterator[tuple[str, Column]]:
    """The columns of a DataFrame that stands for several columns in a dict; each goes by its name, with the unit of the key."""
    base, _, unit = name.partition("_")
    suffix = f"_{unit}" if unit else ""
    numbered = re.compile(r"approach[1-9]\d*" if base == "approach" else r"q[1-9]\d*")
    known: dict[str, str] = {}
    if base == "xyz":
        known = {axis: axis for axis in "xyz"}
    elif base == "q":
        known = {joint: joint for joint in joints}
    elif base == "approach":
        known = {joint: f"approach{k + 1}" for k, joint in enumerate(joints)}
    else:
        raise _no_second_dimension(name, f"a table of {len(list(_columns(values)))} columns")
    for label, column in _columns(values):
        part = str(label).removesuffix(suffix) if suffix else str(label)
        written = known.get(part) or (part if base != "xyz" and numbered.fullmatch(part) else None)
        if written is None:
            names = ", ".join(known)
            message = (
                f"column {name}: its column {label} is none of {names}; name the columns so (the key states their unit), or pass "
                "an array for their order"
            )
            raise InputError(message, file="data", key=f"column {name}")
        yield written + suffix, _column(written + suffix, column)


def _no_second_dimension(name: str, shape: str) -> InputError:
    message = f"column {name}: {shape}; q, approach and xyz alone may have two dimensions (xyz three columns)"
    return InputError(message, file="data", key=f"column {name}")


def _is_nested(values: Any) -> bool:
    return isinstance(values, (list, tuple)) and bool(values) and isinstance(values[0], (list, tuple, np.ndarray))


def _column(name: str, values: Any) -> Column:
    module = type(values).__module__.partition(".")[0]
    if module == "polars":
        return _of_polars(values)
    if module == "pyarrow":
        has_gaps = values.null_count > 0
        values = values.to_pandas()
        module = "pandas"
        if has_gaps and values.dtype.kind in "fiu":
            return _with_gaps(list(values), values.isna().to_numpy())
    if module == "pandas":
        import pandas as pd

        if pd.api.types.is_bool_dtype(values.dtype) or pd.api.types.is_complex_dtype(values.dtype):
            raise _no_numbers(f"column {name}", str(values.dtype), "data")
        if pd.api.types.is_numeric_dtype(values.dtype):
            if pd.api.types.is_extension_array_dtype(values.dtype) and values.isna().any():
                return _with_gaps(list(values), values.isna().to_numpy(dtype=np.bool_))
            return _numbers(values.to_numpy(dtype=np.float64, na_value=np.nan))
        return _words(values)
    array = _plain(f"column {name}", values, "data")
    if array.ndim != 1:
        message = f"column {name}: shape {array.shape}; a column has one value a row"
        raise InputError(message, file="data", key=f"column {name}")
    return _numbers(array) if array.dtype.kind in "fiu" else _words(array)


def _plain(key: str, values: Any, file: str) -> npt.NDArray[Any]:
    """An array without a mask, of numbers or words."""
    mask = np.ma.getmaskarray(values) if isinstance(values, np.ma.MaskedArray) else np.zeros(0, dtype=np.bool_)
    if mask.any():
        line = int(np.argwhere(mask)[0][0]) + 2 if file == "data" or mask.ndim > 1 else None
        message = f"{key}: masked{'' if line is None else f' in line {line}'}, {int(mask.sum())} values in all; leave such rows out, or fill them"
        raise InputError(message, file=file, line=line, key=key)
    array = np.asarray(values)
    if array.dtype.kind in "bc":
        raise _no_numbers(key, str(array.dtype), file)
    return array


def _reals(key: str, values: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
    """Numbers of any type as 64-bit numbers, words that are numbers included, as in tables."""
    if values.dtype.kind not in "fiu":
        try:
            if any(isinstance(value, (bool, np.bool_)) for value in values.flat):
                raise TypeError
            return values.astype(np.float64)
        except (TypeError, ValueError):
            raise _no_numbers(key, str(values.dtype), key) from None
    return values.astype(np.float64)


def _no_numbers(key: str, dtype: str, file: str) -> InputError:
    message = f"{key}: values of type {dtype} are neither numbers nor words; convert them first"
    return InputError(message, file=file, key=key)


def count(key: str, value: Any, least: int, most: int) -> int:
    """A whole number within limits, of an argument."""
    try:
        number = None if isinstance(value, (bool, np.bool_)) else operator.index(value)
    except TypeError:
        number = None
    if number is None or not least <= number <= most:
        raise InputError(f"{key}: {value!r} is not a whole number from {least} to {most}", key=key)
    return number


def region(workspace_mm: Sequence[float] | None, keep_out_mm: Sequence[Sequence[float]]) -> Region:
    """The box and the planes of a workspace, with their lengths checked."""
    box = None if workspace_mm is None else _finite("workspace_mm", workspace_mm, 6)
    return box, [_finite("keep_out_mm", plane, 4) for plane in keep_out_mm]


def _finite(key: str, values: Any, length: int) -> list[float]:
    try:
        numbers = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.shape != (length,) or not np.isfinite(numbers).all():
        raise InputError(f"{key}: {values!r} is not {length} finite numbers", key=key)
    return [float(number) for number in numbers]


def _numbers(values: Any) -> Column:
    return np.asarray(values, dtype=np.float64).tobytes()


def _words(values: Any) -> Column:
    import pandas as pd

    codes, words = pd.factorize(values)
    return _coded(codes, [str(word) for word in words])


def _of_polars(values: Any) -> Column:
    import polars as pl

    if values.dtype == pl.Boolean:
        raise _no_numbers(f"column {values.name}", "Boolean", "data")
    if values.dtype.is_numeric():
        if values.null_count():
            return _with_gaps(values.to_list(), values.is_null().to_numpy())
        return _numbers(values.cast(pl.Float64).to_numpy())
    text = values.cast(pl.String)
    words = text.drop_nulls().unique(maintain_order=True)
    codes = text.cast(pl.Enum(words)).to_physical().cast(pl.Int64).fill_null(-1)
    return _coded(codes.to_numpy(), words.to_list())


def _with_gaps(values: list[Any], missing: npt.NDArray[np.bool_]) -> Column:
    """Numbers of which some are missing: words, the empty one where there is no number."""
    words = ["" if gap else repr(float(value)) for value, gap in zip(values, missing, strict=True)]
    codes, known = np.unique(np.array(words, dtype=np.str_), return_inverse=True)[::-1]
    return _coded(codes, [str(word) for word in known])


def _coded(codes: npt.NDArray[np.integer[Any]], words: list[str]) -> Column:
    """A missing word is an empty cell."""
    missing = codes < 0
    if missing.any():
        codes = np.where(missing, len(words), codes)
        words = [*words, ""]
    return codes.astype(np.int64, copy=False).tobytes(), words
