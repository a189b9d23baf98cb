"""Tables on their way in: from paths, frames, dicts and arrays to columns of numbers and words."""

from __future__ import annotations

import csv
import io
import operator
import os
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from .errors import FlexcalWarning, InputError

if TYPE_CHECKING:
    import pandas as pd

Path: TypeAlias = str | os.PathLike[str]
"""A file."""

Data: TypeAlias = Path | Sequence[Path] | Mapping[str, Any] | Any
"""Measurements: a CSV file or several of one table, a DataFrame (pandas, polars, pyarrow or any other that speaks Arrow), a
structured array, or a dict of arrays. Names of columns and their units are those of files (``q1_deg``, ``x_mm``, ``split``);
in a dict one array may stand for several columns: ``q_rad`` or ``q_deg``, shape (rows, joints), ``xyz_mm`` or ``xyz_m``,
shape (rows, 3), and ``approach``, shape (rows, joints)."""

Column: TypeAlias = bytes | tuple[bytes, list[str]]
"""Bytes of 64-bit numbers, or of the 64-bit numbers of words with the words."""
Region: TypeAlias = tuple[list[float] | None, list[list[float]]]
"""Box and planes [mm] of a workspace."""
Source: TypeAlias = list[Path] | tuple[str, list[tuple[str, Column]]]


def source(data: Data) -> Source:
    """What the reader takes: files, or the name of a table and its columns."""
    if isinstance(data, (str, os.PathLike)):
        return [data]
    if isinstance(data, (list, tuple)) and data and all(isinstance(file, (str, os.PathLike)) for file in data):
        return list(data)
    columns = [part for name, values in _columns(data) for part in _split(str(name), values)]
    if not columns:
        raise InputError("data: no columns; give a table with columns such as q1_deg, x_mm, y_mm, z_mm", key="data")
    return "data", columns


class Shape(NamedTuple):
    """How configurations were given."""

    single: bool
    """One configuration alone, not a row of them."""
    every_joint: bool
    """An array with a column for every joint, fixed ones as well."""


def configurations(
    q: Any, units: Sequence[str | None], columns: Mapping[str, Any], joints: Sequence[str] = ()
) -> tuple[Source, Shape]:
    """Configurations with further columns as a table, and how they were given.

    ``units`` holds for each joint the unit of its command, None at fixed joints. A value of ``columns`` may be one for all rows.
    Columns of a table that bear the names of ``joints`` without a unit have these units.
    """
    if isinstance(q, (str, os.PathLike, Mapping)) or hasattr(q, "columns") or hasattr(q, "column_names"):
        if columns:
            raise TypeError("columns go into the table of poses itself")
        poses = _with_units(q, units, joints) if joints else q
        return source(poses), Shape(single=False, every_joint=False)
    values = _plain("q", q, "q")
    if values.dtype.kind not in "fiu":
        raise _no_numbers("q", str(values.dtype), "q")
    values = values.astype(np.float64)
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
    return source(table), Shape(single, every_joint)


def _with_units(q: Any, units: Sequence[str | None], joints: Sequence[str]) -> Any:
    """A table of poses whose columns of joints all name their unit."""
    if isinstance(q, (str, os.PathLike)):
        return q
    moving = [(name, unit) for name, unit in zip(joints, units, strict=True) if unit is not None]
    # Numbers count the moving joints, or all joints.
    numbered = {f"q{k + 1}": unit for k, unit in enumerate(units) if unit is not None}
    named = numbered | dict(moving) | {f"q{k + 1}": unit for k, (_, unit) in enumerate(moving)}
    renamed: dict[str, Any] = {}
    for name, values in _columns(q):
        written = f"{name}_{named[name]}" if name in named else name
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


def _columns(data: Any) -> Iterator[tuple[Any, Any]]:
    if isinstance(data, Mapping):
        yield from data.items()
    elif isinstance(data, np.ndarray) and data.dtype.names is not None:
        yield from ((name, data[name]) for name in data.dtype.names)
    elif hasattr(data, "columns") and not isinstance(data, np.ndarray) and not hasattr(data, "column_names"):
        yield from ((name, data[name]) for name in data.columns)
    elif hasattr(data, "column_names"):
        yield from zip(data.column_names, data.columns, strict=True)
    elif hasattr(data, "__arrow_c_stream__"):
        import pyarrow

        yield from _columns(pyarrow.table(data))
    else:
        kind = type(data).__name__
        raise TypeError(f"data: a path, a DataFrame or a dict of arrays is needed, not {kind}")


def _split(name: str, values: Any) -> Iterator[tuple[str, Column]]:
    """Its columns: more than one where an array has two dimensions."""
    if getattr(values, "ndim", None) != 2 and not _is_nested(values):
        yield name, _column(name, values)
        return
    array = _plain(f"column {name}", values, "data")
    base, _, unit = name.partition("_")
    suffix = f"_{unit}" if unit else ""
    if base == "xyz" and array.shape[1] == 3:
        parts = ["x", "y", "z"]
    elif base in ("q", "approach"):
        parts = [f"{base}{k + 1}" for k in range(array.shape[1])]
    else:
        message = f"column {name}: shape {array.shape}; q, approach and xyz alone may have two dimensions (xyz three columns)"
        raise InputError(message, file="data", key=f"column {name}")
    for k, part in enumerate(parts):
        yield part + suffix, _column(part + suffix, array[:, k])


def _is_nested(values: Any) -> bool:
    return isinstance(values, (list, tuple)) and bool(values) and isinstance(values[0], (list, tuple, np.ndarray))


def _column(name: str, values: Any) -> Column:
    module = type(values).__module__.partition(".")[0]
    if module == "polars":
        return _of_polars(values)
    if module == "pyarrow":
        values = values.to_pandas()
        module = "pandas"
    if module == "pandas":
        import pandas as pd

        if pd.api.types.is_bool_dtype(values.dtype) or pd.api.types.is_complex_dtype(values.dtype):
            raise _no_numbers(f"column {name}", str(values.dtype), "data")
        if pd.api.types.is_numeric_dtype(values.dtype):
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
        row = int(np.argwhere(mask)[0][0])
        message = f"{key}: row {row} is masked, {int(mask.sum())} in all; leave such rows out, or fill them"
        raise InputError(message, file=file, line=row + 2, key=key)
    array = np.asarray(values)
    if array.dtype.kind in "bc":
        raise _no_numbers(key, str(array.dtype), file)
    return array


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
        return _numbers(values.cast(pl.Float64).to_numpy())
    text = values.cast(pl.String)
    words = text.drop_nulls().unique(maintain_order=True)
    codes = text.cast(pl.Enum(words)).to_physical().cast(pl.Int64).fill_null(-1)
    return _coded(codes.to_numpy(), words.to_list())


def _coded(codes: npt.NDArray[np.integer[Any]], words: list[str]) -> Column:
    """A missing word is an empty cell."""
    missing = codes < 0
    if missing.any():
        codes = np.where(missing, len(words), codes)
        words = [*words, ""]
    return codes.astype(np.int64, copy=False).tobytes(), words
