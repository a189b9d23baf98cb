"""Results as tables, arrays, words and, in a notebook, as a page."""

from __future__ import annotations

import json
import pathlib
import tempfile
from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeVar

import numpy as np
import numpy.typing as npt

from . import _html, _plots
from ._forward import _Bounded, Forward, Prediction
from ._restored import Restored, Spec, said
from ._tables import Data, Path, source, table, warn

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from . import _core
    from ._problem import Problem

Array = npt.NDArray[np.float64]
T = TypeVar("T")


class _once(Generic[T]):
    """A property that is computed once and cannot be changed: tables are given as copies, arrays are read-only."""

    def __init__(self, function: Callable[[Any], T]) -> None:
        self._function = function
        self.__doc__ = function.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = f"_once_{name}"

    def __get__(self, result: Any, owner: type | None = None) -> T:
        if result is None:
            return self  # type: ignore[return-value]
        kept = result.__dict__
        if self._name not in kept:
            value = self._function(result)
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
            kept[self._name] = value
        value = kept[self._name]
        copy = getattr(value, "copy", None)
        return copy() if copy is not None and hasattr(value, "columns") else value  # type: ignore[no-any-return]

    def __set__(self, result: Any, value: object) -> None:
        raise AttributeError(f"{self._name.removeprefix('_once_')}: results cannot be changed")


class _Result:
    """What all results can do."""

    _core: Any

    def __setattr__(self, name: str, value: object) -> None:
        if not name.startswith("_"):
            raise AttributeError(f"{name}: results cannot be changed")
        super().__setattr__(name, value)

    def __getstate__(self) -> dict[str, Any]:
        return {"said": said(self._core)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._core = Restored(state["said"], None)

    def summary(self) -> str:
        """What the command line prints (``identify`` and ``loop`` with ``-v``), as text."""
        return str(self._core.summary())

    def to_json(self) -> str:
        """The file that the command line writes (``estimate.json``, ``loop.json`` …), to the byte but for the time taken."""
        return self._json

    def to_dict(self) -> dict[str, Any]:
        """The same as a dict; docs/results.md explains every field. SI units, except where a key says otherwise."""
        document: dict[str, Any] = json.loads(self._json)
        return document

    @_once
    def _json(self) -> str:
        return str(self._core.json())

    @_once
    def _document(self) -> dict[str, Any]:
        return self.to_dict()

    def __str__(self) -> str:
        return self.summary()

    def __repr__(self) -> str:
        return f"<flexcal.{type(self).__name__} of {self._document['problem']!r}>"


class _Fit(_Result):
    """A result with a fit and a report."""

    _fit: _core.Identification
    _problem: Problem
    _spec: Spec

    def __getstate__(self) -> dict[str, Any]:
        return {"said": said(self._core), "fit": said(self._fit), "problem": self._problem, "spec": self._spec}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._problem, self._spec = state["problem"], state["spec"]
        self._core = Restored(state["said"], self._spec)
        self._fit = self._fit_of(state["fit"])

    def _fit_of(self, words: dict[str, Any]) -> Any:
        return Restored(words, self._spec)

    @_once
    def parameters(self) -> pd.DataFrame:
        """The free parameters, a row each, by their names; SI.

        Columns: ``unit`` (of the next three), ``nominal``, ``estimate``, ``std_error`` (1 σ, NaN where nothing was learned or a
        bound holds the value), ``at_bound`` (``"lower"``, ``"upper"`` or None), ``shadow_price`` (what that bound costs: a
        dict of ``multiplier``, ``rms_mm`` and ``per``, or None), ``identified`` (0…1, the share that the data gave), ``fitted``.
        """
        return _parameters(json.loads(self._fit.json())["parameters"])

    @_once
    def covariance(self) -> Array:
        """Covariance of the estimates, shape (parameters, parameters), in the order of ``parameters``; SI, entry (i, j) in the
        product of both units. NaN where one of the two has no standard error."""
        n = len(self.parameters)
        return np.frombuffer(self._fit.covariance(), dtype=np.float64).reshape(n, n)

    @_once
    def correlation(self) -> pd.DataFrame:
        """Correlation of the estimates by the names of the parameters, from -1 to 1; NaN where there is no covariance."""
        import pandas as pd

        covariance = self.covariance
        sigma = np.sqrt(np.diag(covariance))
        with np.errstate(invalid="ignore", divide="ignore"):
            values = covariance / np.outer(sigma, sigma)
        names = self.parameters.index
        return pd.DataFrame(values, index=names, columns=names)

    def plot_correlation(self, axes: Axes | None = None) -> Axes:
        """Draws :attr:`correlation` as a map of colours; needs matplotlib. Returns the axes: the given ones, or those of a new
        figure."""
        return _plots.correlation(self.correlation, axes)

    def plot_parameters(self, axes: Axes | None = None) -> Axes:
        """Draws the estimates with their 95 % intervals beside their priors, as a forest plot in units of 1 σ of each prior; needs
        matplotlib. Parameters without a prior or a standard error are left out. Returns the axes."""
        return _plots.forest(self.parameters, self._fit.priors(), axes)

    @_once
    def residuals(self) -> pd.DataFrame:
        """What the fit leaves, a row for each row of the data, in their order.

        Columns: ``file``, ``line`` and what else names the row (``pose``, ``session``, ``target``, ``point``, ``anchor``,
        ``surface``); the commands ``q1_deg`` … (``q1_mm`` of joints that slide); ``predicted_x_mm`` …; ``residual_x_mm`` …: measured − predicted, measuring frame [mm]; where orientation is
        fitted ``predicted_rx_deg`` … and ``residual_rx_deg`` … [°]; where rows measure them ``…_distance_mm``, ``…_offset_mm`` (of a
        surface) and ``…_tilt_x_deg`` …, NaN in rows of another kind; ``whitened``: length of all that is left over 1 σ of each
        part; ``outlier``; ``held_out``.
        """
        return _residuals(self._fit.residuals())

    @_once
    def errors(self) -> pd.DataFrame:
        """Errors before and after, on the rows fitted and on those held out [mm]: mean, root mean square and largest distance."""
        return _errors(self._document)

    @property
    def trusted(self) -> bool:
        """Whether the fit is to be trusted; ``why_not_trusted`` says why not."""
        return self._fit.why_not_trusted is None

    @property
    def why_not_trusted(self) -> str | None:
        """Why the fit is not to be trusted; None if it is."""
        return self._fit.why_not_trusted

    @property
    def cautions(self) -> list[str]:
        """What to ask about the input."""
        return self._fit.cautions

    @property
    def findings(self) -> list[dict[str, Any]]:
        """Findings of the checks of the fit: ``code``, ``severity``, ``numbers``, ``text`` and ``remedy`` of each
        (docs/findings.md explains every code)."""
        return list(json.loads(self._fit.json())["findings"])

    @property
    def problem(self) -> Problem:
        """The problem that was fitted."""
        return self._problem

    @_once
    def _report(self) -> tuple[str, str, dict[str, str]]:
        markdown, page, figures = self._core.report()
        return markdown, page, {name.removesuffix(".svg"): text for name, text in figures}

    @property
    def figures(self) -> dict[str, str]:
        """The figures of the report as SVG, by name (``"held-out-errors"``, ``"effect-1"`` …)."""
        return dict(self._report[2])

    @property
    def markdown(self) -> str:
        """``report.md`` of the command line."""
        return self._report[0]

    @property
    def html(self) -> str:
        """``report.html`` of the command line: a whole page that needs nothing else."""
        return self._report[1]

    def _warn(self, stacklevel: int) -> None:
        reason = self._fit.why_not_trusted
        warn(([] if reason is None else [reason]) + self.cautions, stacklevel + 1)


class Identification(_Fit, Forward):
    """An identified arm."""

    def __init__(self, core: _core.Identification, problem: Problem, spec: Spec) -> None:
        self._core = core
        self._fit = core
        self._problem = problem
        self._spec = spec
        self._forward = core
        self._reader = problem._core

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
        self._forward = self._fit
        self._reader = self._problem._core

    def predict(self, q: Any = None, *, q_rad: Any = None, q_deg: Any = None, **columns: Any) -> Prediction:
        """Positions of the measured point with their uncertainty, measuring frame [m]; corrected where a remainder was fitted.

        Parameters are those of :meth:`Problem.predict`.

        Returns
        -------
        An array of shape (poses, 3), or (3,) for one configuration, with ``covariance``, ``sigma``, ``bound95``, ``bound(level)``
        and ``extrapolated``; NaN where the arm has no equilibrium.
        """
        poses, shape = self._poses((q, q_rad, q_deg), columns)
        positions = np.frombuffer(self._forward.predict(poses), dtype=np.float64).reshape(-1, 3)

        @lru_cache(maxsize=4)
        def bounded(level: float) -> _Bounded | None:
            parts = self._core.predict_bounded(poses, level)
            if parts is None:
                return None
            _, covariance, bound, extrapolated = (np.frombuffer(part, dtype=np.float64) for part in parts)
            all_poses = _Bounded(covariance.reshape(-1, 3, 3), bound, extrapolated > 0.5)
            return _Bounded(*(part[0] for part in all_poses)) if shape.single else all_poses

        return Prediction._of(positions[0] if shape.single else positions, bounded)

    @property
    def remainder(self) -> dict[str, Any] | None:
        """What the remainder is and gains: ``sites``, ``inputs``, ``left_out_without_mm``, ``left_out_mm``,
        ``held_out_without`` … (docs/results.md); None without one."""
        found: dict[str, Any] | None = self.to_dict().get("remainder")
        return found

    def remainder_json(self) -> str | None:
        """``remainder.json`` of the command line, which ``[remainder] file`` of a problem names; None without a remainder."""
        text: str | None = self._core.remainder_json()
        return text

    def watch(self, data: Data, *, drift_days: float = 0.0, false_alarms: float = 0.01) -> dict[str, Any]:
        """Tests new rows, in their order, for a change of the arm since this identification (docs/life.md).

        Parameters
        ----------
        data
            Measurements, as :meth:`Problem.identify` takes them; rows that were fitted are left out.
        drift_days
            Days since the identification; what drifts in them counts as no change.
        false_alarms
            Probability of an alarm at any row if nothing has changed.

        Returns
        -------
        ``watch.json`` of the command line: ``changed``, and ``causes`` with their probabilities and sizes.

        Raises
        ------
        InputError
            No row is new, or the identification has no covariance.
        """
        read = self._problem._read(self._problem._given_data(data))
        verdict: dict[str, Any] = json.loads(self._core.watch(read, drift_days, false_alarms))
        return verdict

    def compensate(
        self, targets: Data, *, frame: Literal["measuring", "base"] = "measuring", level: float = 0.95
    ) -> Compensation:
        """Finds the commands that bring the identified arm to targets, corrected by its remainder.

        Parameters
        ----------
        targets
            A table like measurements: ``x_mm``, ``y_mm``, ``z_mm`` are where the arm should be, ``q1_deg`` … where to start from. Without
            positions the arm is brought to where the nominal arm would have been; with an orientation that is kept too.
        frame
            Frame of the targets: the ``"measuring"`` frame, or that of the arm's ``"base"``.
        level
            Probability with which the bound of an error holds.

        Raises
        ------
        InputError
            A mistake in the targets; a session or target of which nothing is known.
        """
        core = self._core.compensate(source(targets), frame, level)
        warn(core.warnings, stacklevel=2)
        return Compensation(core)

    def export_urdf(self, urdf: Path) -> Export:
        """The URDF that the problem came from, with the origins of its chain as they were identified.

        Raises
        ------
        InputError
            It is the URDF of another arm, or its chain ends where no origin could hold what was identified.
        """
        return Export(self._fit.export_urdf(urdf))

    def _repr_html_(self) -> str:
        return _html.identification(self)


class ClosedLoop(_Fit):
    """The loop from the declared problem to one that leaves nothing to find; ``parameters``, ``covariance`` and ``residuals`` are
    those of the last fit, with everything that was found."""

    def __init__(self, core: _core.ClosedLoop, problem: Problem, spec: Spec) -> None:
        self._core = core
        self._fit = core.after()
        self._problem = problem
        self._spec = spec

    def _fit_of(self, words: dict[str, Any]) -> Any:
        return Restored(words, self._spec.part("after"))

    @property
    def verdict(self) -> str:
        """``"explained"`` (the effects with status ``"found"`` alone leave noise), ``"unexplained"`` (structure is left, or no
        effect is sure) or ``"nothing-found"``."""
        return str(self._document["verdict"])

    @_once
    def effects(self) -> pd.DataFrame:
        """What was found, a row each, in that order.

        Columns: ``effect``, ``status`` (``"found"``, ``"probable"``, ``"located"`` or ``"contradicted"``: what may be claimed),
        ``description``, ``declaration`` (the line for an ``[[effect]]`` of problem.toml), ``p_value``; ``place``, ``depends_on`` and ``law`` with the probability that each
        is claimed with (``place_probability`` …; None and NaN where no evidence was weighed); ``stability``.
        """
        return _effects(self._document["effects"])

    @property
    def remainder(self) -> dict[str, Any] | None:
        """What the remainder beside the effects is and gains; None without one. :attr:`after` predicts with it, and
        ``after.remainder_json()`` is its file."""
        found: dict[str, Any] | None = self.to_dict().get("remainder")
        return found

    @property
    def unexplained(self) -> dict[str, Any] | None:
        """Structure whose law is not known: its place, what it depends on; None if none is left."""
        found: dict[str, Any] | None = self.to_dict()["unexplained"]
        return found

    @_once
    def before(self) -> Identification:
        """The fit of the problem as declared."""
        return Identification(self._core.before(), self._problem, self._spec.part("before"))

    @_once
    def after(self) -> Identification:
        """The fit with everything that was found; it predicts."""
        return Identification(self._core.after(), self.closed_problem, self._spec.part("after"))

    @_once
    def closed_problem(self) -> Problem:
        """The problem with what was found declared: an input like any other."""
        from ._problem import Problem

        return Problem(str(self._core.closed_problem()))

    def _repr_html_(self) -> str:
        return _html.closed_loop(self)


class Trace(_Result):
    """Which effects the residual of a fit points to."""

    def __init__(self, core: _core.Trace, problem: Problem, spec: Spec) -> None:
        self._core = core
        self._identified = Identification(core.fit(), problem, spec.part("fit"))

    def __getstate__(self) -> dict[str, Any]:
        return super().__getstate__() | {"fit": self._identified}

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
        self._identified = state["fit"]

    @property
    def fit(self) -> Identification:
        """The fit of the problem as declared."""
        return self._identified

    @property
    def parameters(self) -> pd.DataFrame:
        """As :attr:`Identification.parameters`, of the problem as declared."""
        return self.fit.parameters

    @property
    def covariance(self) -> Array:
        """As :attr:`Identification.covariance`, of the problem as declared."""
        return self.fit.covariance

    @property
    def residuals(self) -> pd.DataFrame:
        """As :attr:`Identification.residuals`, of the problem as declared."""
        return self.fit.residuals

    @_once
    def ranking(self) -> pd.DataFrame:
        """Candidates, best first: ``effect``, ``description``, ``p_value`` (corrected for the candidates tried) and
        ``expected_gain_mm`` (off the rms error of the poses fitted; none where these are tilts)."""
        import pandas as pd

        names = ["effect", "description", "p_value", "expected_gain_mm"]
        return pd.DataFrame([[entry.get(name) for name in names] for entry in self._document["ranking"]], columns=names)

    def _repr_html_(self) -> str:
        return _html.trace(self)


class Export(_Result):
    """A URDF with the origins of its chain moved, every other byte as it was."""

    def __init__(self, core: _core.Export) -> None:
        self._core = core

    @property
    def text(self) -> str:
        """The whole file."""
        return str(self._core.text)

    def write(self, file: Path) -> None:
        """Writes it: whole, or not at all."""
        file = pathlib.Path(file)
        with tempfile.TemporaryDirectory(dir=file.parent) as folder:
            whole = pathlib.Path(folder) / file.name
            whole.write_bytes(self.text.encode())
            whole.replace(file)

    @_once
    def origins(self) -> pd.DataFrame:
        """The origins that have moved, by their joints: ``x_m`` …, ``roll_rad`` … as written, ``moved_mm``, ``turned_deg``."""
        import pandas as pd

        names = ["x_m", "y_m", "z_m", "roll_rad", "pitch_rad", "yaw_rad", "moved_mm", "turned_deg"]
        entries = self._document["origins"]
        rows = [[*own["xyz_m"], *own["rpy_rad"], own["moved_mm"], own["turned_deg"]] for own in entries]
        return pd.DataFrame(rows, columns=names, index=pd.Index([own["joint"] for own in entries], name="joint"))

    @_once
    def errors(self) -> pd.DataFrame:
        """Errors on the held-out rows [mm]: of the ``whole`` model, and of the ``rigid`` geometry that the file holds."""
        import pandas as pd

        return pd.DataFrame([_error(arm, own) for arm, own in self._document["held_out"].items()]).set_index("arm")

    @property
    def not_held(self) -> list[str]:
        """What a URDF cannot hold of the model: stiffnesses, effects, base and target."""
        return list(self._document["not_held"])

    def _repr_html_(self) -> str:
        return _html.words(self.summary())


class Compensation(_Result):
    """Commands that bring an identified arm to targets."""

    def __init__(self, core: _core.Compensation) -> None:
        self._core = core

    @_once
    def commands(self) -> pd.DataFrame:
        """The commands, a row each, with the columns of ``commands.csv``: what the targets were called, ``q1_deg`` …, how far the arm
        stays from them (``miss_mm``), and the bound of the error."""
        return table(self._core.csv())

    @property
    def reached(self) -> bool:
        """Whether every target is reached."""
        return bool(self._document["reached"] == self._document["targets"])

    def _repr_html_(self) -> str:
        return _html.words(self.summary())


class Simulation(_Result):
    """Measurements of the virtual test rig, and what is true of its arm."""

    def __init__(self, core: _core.Simulation) -> None:
        self._core = core

    @_once
    def measurements(self) -> pd.DataFrame:
        """The table of measurements: data for every call of a :class:`Problem`."""
        return table(self._core.csv())

    @_once
    def truth(self) -> pd.DataFrame:
        """The parameters by their names: ``unit``, ``nominal`` and ``true`` value; SI."""
        return _named(self._document["parameters"])

    @property
    def effects(self) -> list[dict[str, Any]]:
        """The true effects, with their values."""
        return list(self.to_dict()["effects"])

    def summary(self) -> str:
        """The number of poses, and the true effects."""
        names = [str(effect.get("effect", effect)) for effect in self.effects] or ["none"]
        held_out = self._document["held_out"]
        return f"{self._document['poses']} poses, {held_out} of them held out; true effects: {', '.join(names)}"

    def _repr_html_(self) -> str:
        return _html.words(self.summary())


class Comparison(_Fit):
    """All strategies and solvers side by side; ``parameters``, ``covariance`` and ``residuals`` are those of the joint fit."""

    def __init__(self, core: _core.Comparison, problem: Problem, spec: Spec) -> None:
        self._core = core
        self._fit = core.joint()
        self._problem = problem
        self._spec = spec

    def _fit_of(self, words: dict[str, Any]) -> Any:
        return Restored(words, self._spec.part("joint"))

    @_once
    def fits(self) -> pd.DataFrame:
        """The fits, a row each: ``strategy``, ``solver``, mean error on the rows fitted and held out [mm], ``iterations``,
        ``evaluations``, ``seconds``, ``termination``, ``trusted``, ``reduced_chi2``, ``condition_number``."""
        return _compared(self._document["rows"])

    @_once
    def ablations(self) -> pd.DataFrame:
        """Joint fits with parts of the elasticity left out, by ``elasticity``, the part that is kept; columns as of :attr:`fits`."""
        return _compared(self._document["ablations"], "elasticity", "parameters")

    @_once
    def errors(self) -> pd.DataFrame:
        """Errors of the nominal arm and of the joint fit [mm]; see :attr:`Identification.errors`."""
        joint = json.loads(self._fit.json())
        return _errors({"registered": self._document["registered"]} | {part: joint[part] for part in ("identification", "held_out")})

    def _repr_html_(self) -> str:
        return _html.words(self.summary())


class Study(_Result):
    """Results of many fits to simulated measurements whose truth is known."""

    def __init__(self, core: _core.Study) -> None:
        self._core = core

    @_once
    def cells(self) -> pd.DataFrame:
        """A row for each noise, number of poses, strategy and solver, with the columns of ``study.csv``."""
        return table(self._core.csv())

    @_once
    def parameters(self) -> pd.DataFrame:
        """A row for each parameter in each cell, with the columns of ``parameters.csv``: bias, scatter, coverage; SI."""
        return table(self._core.parameters_csv())

    def __repr__(self) -> str:
        return f"<flexcal.Study {self._document['study']!r}>"

    def _repr_html_(self) -> str:
        return _html.words(self.summary())


class Check(_Result):
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

    @_once
    def parameters(self) -> pd.DataFrame:
        """The free parameters by their names, with the standard error to expect; SI."""
        return _named(self._document["parameters"])

    def _repr_html_(self) -> str:
        return _html.words(self.summary())


class Plan(_Result):
    """Poses to measure, and what they promise."""

    def __init__(self, core: _core.Plan) -> None:
        self._core = core

    @_once
    def poses(self) -> pd.DataFrame:
        """The poses, with the columns of measurements but for the positions (``q1_deg`` …): measure them, add ``x_mm``, ``y_mm``,
        ``z_mm``, and identify."""
        return table(self._core.csv())

    @property
    def suffices(self) -> bool:
        """Whether the poses decide every parameter as far as poses can."""
        return bool(self._core.suffices)

    @_once
    def parameters(self) -> pd.DataFrame:
        """The free parameters by their names, with the standard error to expect, planned and at random; SI."""
        return _named(self._document["parameters"])

    def _repr_html_(self) -> str:
        return _html.words(self.summary())


class Next(_Result):
    """Poses to measure next, with the error over the workspace now and after each of them."""

    def __init__(self, core: _core.Next) -> None:
        self._core = core

    @_once
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


def _named(entries: list[dict[str, Any]]) -> pd.DataFrame:
    import pandas as pd

    return pd.json_normalize(entries, sep="_").set_index("name")


def _parameters(entries: list[dict[str, Any]]) -> pd.DataFrame:
    import pandas as pd

    numbers = ["nominal", "estimate", "std_error", "identified"]
    return pd.DataFrame(entries).set_index("name").astype(dict.fromkeys(numbers, np.float64))


def _compared(entries: list[dict[str, Any]], *first: str) -> pd.DataFrame:
    import pandas as pd

    names = [*first, "strategy", "solver"]
    rest = ["iterations", "evaluations", "seconds", "termination", "trusted", "reduced_chi2", "condition_number"]
    rows = [
        [entry[name] for name in names]
        + [entry[part]["mean_mm"]["norm"] for part in ("identification", "held_out")]
        + [entry[name] for name in rest]
        for entry in entries
    ]
    return pd.DataFrame(rows, columns=[*names, "identification_mean_mm", "held_out_mean_mm", *rest])


def _residuals(columns: dict[str, bytearray | tuple[bytearray, list[str]]]) -> pd.DataFrame:
    import pandas as pd

    frame: dict[str, Any] = {}
    for name, values in columns.items():
        if isinstance(values, tuple):
            codes, words = values
            frame[name] = pd.Categorical.from_codes(np.frombuffer(codes, dtype=np.int64), pd.Index(words))
        elif name in ("line", "outlier", "held_out"):
            whole = np.frombuffer(values, dtype=np.int64)
            frame[name] = whole if name == "line" else whole.astype(np.bool_)
        else:
            frame[name] = np.frombuffer(values, dtype=np.float64)
    return pd.DataFrame(frame, copy=False)


def _errors(document: dict[str, Any]) -> pd.DataFrame:
    import pandas as pd

    stages = {"registered": document["registered"]}
    if "before" in document:
        stages |= {"declared": document["before"], "closed": document["after"]}
    else:
        stages["identified"] = document
    rows = []
    for stage, parts in stages.items():
        for part in ("identification", "held_out"):
            rows.append(_error(stage, parts[part]) | {"rows": part})
    return pd.DataFrame(rows).set_index(["arm", "rows"])


def _error(arm: str, own: dict[str, Any]) -> dict[str, Any]:
    return {"arm": arm, "n": own["n"]} | {of: own[of]["norm"] for of in ("mean_mm", "rms_mm", "max_mm")}


def _effects(entries: list[dict[str, Any]]) -> pd.DataFrame:
    import pandas as pd

    claims = ("place", "depends_on", "law")
    names = ["effect", "status", "description", "declaration", "p_value"]
    names += [name for claim in claims for name in (claim, f"{claim}_probability")] + ["stability"]
    rows = []
    for entry in entries:
        row = [entry[name] for name in ("effect", "status", "description", "declaration", "p_value")]
        for claim in claims:
            said = (entry.get("claims") or {}).get(claim) or {}
            row += [said.get("value"), said.get("probability")]
        rows.append([*row, entry.get("stability")])
    return pd.DataFrame(rows, columns=names)
