"""Results that need no measurements, or choose which to make: check, plan, next poses, simulation and study."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from . import _html
from ._frames import named_frame
from ._result import Result, once
from ._tables import table

if TYPE_CHECKING:
    import pandas as pd

    from . import _core


class Simulation(Result):
    """Measurements of the virtual test rig, and what is true of its arm."""

    def __init__(self, core: _core.Simulation) -> None:
        self._core = core

    @once
    def measurements(self) -> pd.DataFrame:
        """The table of measurements: data for every call of a :class:`Problem`. It has no column ``split`` where the problem chooses
        the held-out rows otherwise than by a column (docs/problem.md)."""
        measured, unused = table(self._core.csv()), self._core.unused_split
        return measured if unused is None else measured.drop(columns=unused)

    @once
    def truth(self) -> pd.DataFrame:
        """The parameters by their names: ``unit``, ``nominal`` and ``true`` value; SI."""
        return named_frame(self._document["parameters"])

    @property
    def effects(self) -> list[dict[str, Any]]:
        """The true effects, with their values."""
        return list(self.to_dict()["effects"])

    def summary(self) -> str:
        """The number of poses, and the true effects."""
        names = [str(effect.get("effect", effect)) for effect in self.effects] or ["none"]
        held_out = f", {self._document['held_out']} of them held out" if self._core.unused_split is None else ""
        return f"{self._document['poses']} poses{held_out}; true effects: {', '.join(names)}"

    def _repr_html_(self) -> str:
        return _html.words(self.summary())


class Study(Result):
    """Results of many fits to simulated measurements whose truth is known."""

    def __init__(self, core: _core.Study) -> None:
        self._core = core

    @once
    def cells(self) -> pd.DataFrame:
        """A row for each noise, number of poses, strategy and solver, with the columns of ``study.csv``."""
        return table(self._core.csv())

    @once
    def parameters(self) -> pd.DataFrame:
        """A row for each parameter in each cell, with the columns of ``parameters.csv``: bias, scatter, coverage; SI."""
        return table(self._core.parameters_csv())

    def __repr__(self) -> str:
        return f"<flexcal.Study {self._document['study']!r}>"

    def _repr_html_(self) -> str:
        return _html.words(self.summary())


class Check(Result):
    """What measurements in some poses will tell."""

    def __init__(self, core: _core.Check) -> None:
        self._core = core

    @property
    def suffices(self) -> bool:
        """Whether the poses suffice; ``why_not_sufficient`` says why not."""
        return self._core.why_not_sufficient is None

    @property
    def why_not_sufficient(self) -> str | None:
        """Why the poses do not suffice; None if they do."""
        reason: str | None = self._core.why_not_sufficient
        return reason

    @once
    def parameters(self) -> pd.DataFrame:
        """The free parameters by their names, with the standard error to expect; SI."""
        return named_frame(self._document["parameters"])

    def _repr_html_(self) -> str:
        return _html.words(self.summary())


class Plan(Result):
    """Poses to measure, and what they promise."""

    def __init__(self, core: _core.Plan) -> None:
        self._core = core

    @once
    def poses(self) -> pd.DataFrame:
        """The poses, with the columns of measurements but for the positions (``q1_deg`` …): measure them, add ``x_mm``, ``y_mm``,
        ``z_mm``, and identify."""
        return table(self._core.csv())

    @property
    def suffices(self) -> bool:
        """Whether the poses decide every parameter as far as poses can."""
        return bool(self._core.suffices)

    @once
    def parameters(self) -> pd.DataFrame:
        """The free parameters by their names, with the standard error to expect, planned and at random; SI."""
        return named_frame(self._document["parameters"])

    def _repr_html_(self) -> str:
        return _html.words(self.summary())


class Next(Result):
    """Poses to measure next, with the error over the workspace now and after each of them."""

    def __init__(self, core: _core.Next) -> None:
        self._core = core

    @once
    def poses(self) -> pd.DataFrame:
        """The poses in the order of measurement, with the columns of measurements but for the positions."""
        return table(self._core.csv())

    @property
    def enough(self) -> bool:
        """Whether the bound over the workspace is below the tolerance."""
        return bool(self._document["stop"] == "enough")

    @property
    def stop(self) -> str | None:
        """Why fewer poses are named than asked for; None if there is no reason."""
        reason: str | None = self._document["stop"]
        return reason

    @property
    def bound_mm(self) -> float | None:
        """Length that errors in the workspace do not exceed now; None with fewer than ten measured configurations."""
        now = self._document["now"]
        return None if now is None else float(now["bound_mm"])

    def _repr_html_(self) -> str:
        return _html.words(self.summary())
