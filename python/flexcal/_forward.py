"""Arms that predict."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from . import _core
from ._tables import asked, configurations, Shape, warn

Array = npt.NDArray[np.float64]
T = TypeVar("T")


class _Bounded(NamedTuple):
    """Uncertainty of predictions."""

    covariance: Array
    bound: Any
    extrapolated: Any


class NoUncertaintyError(AttributeError, ValueError):
    """A prediction of which no uncertainty is known."""


class Levels:
    """Uncertainty of predictions by the level of their bound; the values are read-only."""

    def __init__(self, compute: Callable[[float], _Bounded | None], known: dict[float, _Bounded | None] | None = None) -> None:
        self._compute = compute
        self._known = {} if known is None else known

    def __call__(self, level: float) -> _Bounded | None:
        if level not in self._known:
            found = self._compute(level)
            self._known[level] = None if found is None else _Bounded(*(_frozen(values) for values in found))
        return self._known[level]

    def levels(self) -> list[float]:
        """Levels to keep in a pickle: 95 %, and those that were read."""
        return sorted({0.95, *self._known})


def _frozen(values: T) -> T:
    if isinstance(values, np.ndarray):
        values.flags.writeable = False
    return values


def _prediction(positions: Array, kept: dict[float, _Bounded | None] | None) -> Prediction:
    """A prediction from its pickle."""

    def lost(level: float) -> _Bounded | None:
        shown = ", ".join(f"{level:g}" for level in known)
        raise ValueError(f"level: a pickled prediction keeps the bounds of the levels {shown} alone; predict again for {level:g}")

    if kept is None:
        return Prediction._of(positions, None)
    known = {level: None if found is None else _Bounded(*map(_frozen, found)) for level, found in kept.items()}
    return Prediction._of(positions, Levels(lost, known))


class _Predicts(Protocol):
    def predict(self, poses: _core.Poses) -> bytearray: ...

    def jacobian(self, poses: _core.Poses) -> bytearray: ...


class Prediction(np.ndarray[Any, np.dtype[np.float64]]):
    """Predicted positions, an array of shape (poses, 3) or (3,), measuring frame [m], with their uncertainty.

    The uncertainty is that of measured − predicted: of the parameters, of the remainder, of the noise of a measurement, and of
    what the model is known to miss. It is computed when it is first read. Prediction and uncertainty are read-only.

    Selected poses (``p[0]``, ``p[:3]``, ``p[mask]``), pickles and copies by the module ``copy`` keep their uncertainty; a pickle keeps
    the bounds of 95 % and of the levels that were read before. Coordinates (``p[:, 0]``), ``p.copy()`` and arrays computed from a
    prediction are plain arrays.
    """

    _bounded: Levels | None

    def __array_finalize__(self, source: Any) -> None:
        self._bounded = None

    def __array_wrap__(self, array: Any, context: Any = None, return_scalar: bool = False) -> Any:
        return array[()] if return_scalar else np.asarray(array)

    @classmethod
    def _of(cls, positions: Array, bounded: Levels | None) -> Prediction:
        prediction = positions.view(cls)
        prediction._bounded = bounded
        prediction.flags.writeable = False
        return prediction

    def __getitem__(self, key: Any) -> Any:
        # The bounds are read later, when the caller may have changed a list or an array.
        key = np.array(key) if isinstance(key, (list, np.ndarray)) else key
        part = np.asarray(self)[key]
        bounded = self._bounded
        # Only keys along the poses select whole positions.
        of_poses = isinstance(key, slice) or not isinstance(key, tuple) and np.ndim(key) <= 1
        if bounded is None or self.ndim != 2 or not of_poses or part.ndim > 2:
            return part

        def selected(level: float) -> _Bounded | None:
            whole = bounded(level)
            return None if whole is None else _Bounded(*(values[key] for values in whole))

        return Prediction._of(part, Levels(selected))

    def __iter__(self) -> Iterator[Any]:
        return (self[place] for place in range(len(self)))

    def copy(self, order: Any = "C") -> Array:  # type: ignore[override]
        """The positions as a plain array that can be changed."""
        return np.array(self, order=order, subok=False)

    def __copy__(self) -> Prediction:
        return Prediction._of(np.array(self, subok=False), self._bounded)

    def __deepcopy__(self, memo: dict[int, Any] | None = None) -> Prediction:
        return self.__copy__()

    def __reduce__(self) -> tuple[object, ...]:
        bounded = self._bounded
        kept = None if bounded is None else {level: bounded(level) for level in bounded.levels()}
        return _prediction, (np.array(self, subok=False), kept)

    def _uncertainty(self, level: float = 0.95) -> _Bounded:
        if self._bounded is None:
            raise NoUncertaintyError("arrays computed from a prediction have no uncertainty; read it from the prediction itself")
        bounded = self._bounded(level)
        if bounded is None:
            raise NoUncertaintyError(
                "the rows fitted give no bounds of predictions: fewer than ten configurations, or rows that measure no position"
            )
        return bounded

    @property
    def covariance(self) -> Array:
        """Covariance of measured − predicted, shape (poses, 3, 3) or (3, 3), measuring frame [m²]."""
        return self._uncertainty().covariance

    @property
    def sigma(self) -> Array:
        """1 σ of measured − predicted along each axis, shape (poses, 3) or (3,), measuring frame [m]."""
        return _frozen(np.sqrt(np.diagonal(self.covariance, axis1=-2, axis2=-1)))

    @property
    def bound95(self) -> Any:
        """Length of measured − predicted that is not exceeded with a probability of 95 %, one a pose [m]."""
        return self.bound()

    def bound(self, level: float = 0.95) -> Any:
        """Length of measured − predicted that is not exceeded with probability ``level``, one a pose [m]."""
        return self._uncertainty(level).bound

    @property
    def extrapolated(self) -> Any:
        """True where the pose lies outside of what was measured, one a pose."""
        return self._uncertainty().extrapolated


class Forward:
    """Positions and their derivatives as a function of the configuration."""

    _forward: _Predicts
    _reader: _core.Problem

    def predict(self, q: Any = None, *, q_rad: Any = None, q_deg: Any = None, **columns: Any) -> Array:
        """Positions of the measured point, measuring frame [m].

        Parameters
        ----------
        q
            A table of poses, as for data: a path, a DataFrame or a dict of arrays with their columns and units. Or an array, as
            ``q_rad``.
        q_rad, q_deg
            Configurations instead, shape (poses, joints) or (joints,), [rad] or [°], of joints that slide [m]; joints are those that
            move, or all. Or a table of poses whose columns bear the names of the joints, without a unit; or a Series with these names,
            one configuration.
        columns
            What else is known of the poses, by the names of columns: ``payload_kg``, ``hoist_N``, ``temperature_C``, ``time_s``,
            ``session``, ``target``, ``approach`` …; one value a pose, or one for all.

        Returns
        -------
        Shape (poses, 3), or (3,) for one configuration; NaN where the arm has no equilibrium.

        Raises
        ------
        InputError
            A mistake in the poses; a session or target of which nothing is known.
        """
        poses, shape = self._poses((q, q_rad, q_deg), columns)
        positions = np.frombuffer(self._forward.predict(poses), dtype=np.float64).reshape(-1, 3)
        return positions[0] if shape.single else positions

    def jacobian(self, q: Any = None, *, q_rad: Any = None, q_deg: Any = None, **columns: Any) -> Array:
        """Derivatives of the positions by the configuration, measuring frame [m/rad], of joints that slide [m/m].

        Parameters are those of :meth:`predict`. Loads and effects that follow the configuration are differentiated through; the
        side from which a joint comes stays.

        Returns
        -------
        Shape (poses, 3, joints), or (3, joints) for one configuration; joints that move, or all if an array has columns for
        all of them (0 at fixed ones); NaN where the arm has no equilibrium.
        """
        poses, shape = self._poses((q, q_rad, q_deg), columns)
        units = self._reader.units
        whole = np.frombuffer(self._forward.jacobian(poses), dtype=np.float64).reshape(-1, 3, len(units))
        if not shape.every_joint:
            whole = whole[:, :, [k for k, unit in enumerate(units) if unit is not None]]
        return whole[0] if shape.single else whole

    def _poses(self, given: tuple[Any, Any, Any], columns: dict[str, Any]) -> tuple[_core.Poses, Shape]:
        named = [(name, value) for name, value in zip(("q", "q_rad", "q_deg"), given, strict=True) if value is not None]
        if len(named) != 1:
            raise TypeError("configurations: one of q, q_rad and q_deg is needed")
        ((name, q),) = named
        units: list[str | None] = list(self._reader.units)
        if name == "q_deg":
            units = ["deg" if unit == "rad" else unit for unit in units]
        # The name of the argument states the unit of columns that bear the names of joints alone.
        source, shape = configurations(name, q, units, columns, self._reader.joints)
        poses = asked(self._reader.poses, source)
        warn(poses.warnings, stacklevel=3)
        return poses, shape
