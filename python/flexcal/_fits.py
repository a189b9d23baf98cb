"""Results with a fit: identification, loop, trace and comparison."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from . import _html, _plots
from ._applied import Compensation, Export
from ._forward import _Bounded, Forward, Levels, Prediction
from ._frames import compared_frame, effects_frame, errors_frame, parameters_frame, residuals_frame
from ._restored import Prior, Restored, Sibling, Spec, said
from ._result import Array, Result, once
from ._tables import Data, Path, asked, region, source, warn
from .errors import InputError

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from . import _core
    from ._problem import Problem


class HeldOutError(NamedTuple):
    """Distances between measured and predicted positions of the rows that judge a fit."""

    rows: str
    """``"held_out"``, or ``"left_out"`` where no row is held out: all rows, each configuration predicted by a fit without it."""
    n: int
    """Number of rows."""
    mean_mm: float
    """Mean distance [mm]."""
    rms_mm: float
    """Root mean square of the distances [mm]."""
    max_mm: float
    """Largest distance [mm]."""


class Fit(Result):
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

    @once
    def parameters(self) -> pd.DataFrame:
        """The free parameters, a row each, by their names; SI.

        Columns: ``unit`` (of the next three), ``nominal``, ``estimate``, ``std_error`` (1 σ, NaN where nothing was learned or a
        bound holds the value), ``at_bound`` (``"lower"``, ``"upper"`` or None), ``shadow_price`` (what that bound costs: a
        dict of ``multiplier``, ``rms_mm`` and ``per``, or None), ``identified`` (0…1, the share that the data gave), ``fitted``.
        """
        return parameters_frame(json.loads(self._fit.json())["parameters"])

    @once
    def covariance(self) -> Array:
        """Covariance of the estimates, shape (parameters, parameters), in the order of ``parameters``; SI, entry (i, j) in the
        product of both units. NaN where one of the two has no standard error."""
        n = len(self.parameters)
        return np.frombuffer(self._fit.covariance(), dtype=np.float64).reshape(n, n)

    @once
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

    @once
    def residuals(self) -> pd.DataFrame:
        """What the fit leaves, a row for each row of the data, in their order.

        Columns: ``file``, ``line`` and what else names the row (``pose``, ``session``, ``target``, ``point``, ``anchor``,
        ``surface``); the commands ``q1_deg`` … (``q1_mm`` of joints that slide); ``predicted_x_mm`` …; ``residual_x_mm`` …: measured − predicted, measuring frame [mm]; where orientation is
        fitted ``predicted_rx_deg`` … and ``residual_rx_deg`` … [°]; where rows measure them ``…_distance_mm``, ``…_offset_mm`` (of a
        surface) and ``…_tilt_x_deg`` …, NaN in rows of another kind; ``whitened``: length of all that is left over 1 σ of each
        part; ``outlier``; ``held_out``.
        """
        return residuals_frame(self._fit.residuals())

    @once
    def errors(self) -> pd.DataFrame:
        """Errors before and after [mm], by ``arm`` and ``rows``: ``n``, ``mean_mm``, ``rms_mm`` and ``max_mm``.

        ``arm`` is ``"registered"`` (the nominal arm, with free base and target fitted) or ``"identified"``; after a loop ``"declared"``
        and ``"closed"`` instead of the latter. ``rows`` is ``"identification"`` or ``"held_out"``; without held-out rows
        ``"left_out"``: all rows, each configuration predicted by a fit without it. :attr:`held_out_error` is the last row by itself.
        """
        return errors_frame(self._document)

    @property
    def held_out_error(self) -> HeldOutError:
        """Error of the arm on the rows that judge the fit: those held out, or without such rows those left out in turn.

        >>> result.held_out_error.mean_mm
        """
        frame = self.errors
        rows, last = str(frame.index[-1][1]), frame.iloc[-1]
        return HeldOutError(rows, int(last["n"]), *(float(last[name]) for name in ("mean_mm", "rms_mm", "max_mm")))

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
        """What to look at although the fit may be trusted: the texts of all findings of severity ``"warning"``, each of which was
        also a :class:`FlexcalWarning`. (``cautions`` of the JSON lack those for which reports have a section of their own.)"""
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

    @once
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


class Identification(Fit, Forward):
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
        warn(self._core.unknown_sides(poses), stacklevel=2)

        def bounded(level: float) -> _Bounded | None:
            parts = self._core.predict_bounded(poses, level)
            if parts is None:
                return None
            warn(filter(None, [self._core.doubted_bounds]), stacklevel=5)
            _, covariance, bound, extrapolated = (np.frombuffer(part, dtype=np.float64) for part in parts)
            all_poses = _Bounded(covariance.reshape(-1, 3, 3), bound, extrapolated > 0.5)
            return _Bounded(*(part[0] for part in all_poses)) if shape.single else all_poses

        return Prediction._of(positions[0] if shape.single else positions, Levels(bounded))

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

        Ask ``changed`` first: the probabilities of ``causes`` are those of each cause given that something has changed.

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
        ``watch.json`` of the command line as a dict: ``changed``; ``causes``, a dict each with ``parameter`` or what else changed, its
        ``probability`` if anything has changed, and its size (docs/schema/watch.schema.json lists every key).

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
            positions the arm is brought to where the nominal arm would have been; with an orientation that is kept too. Of the
            configurations that reach a target the nearest to the start is taken: a start far from its target, of which a
            :class:`FlexcalWarning` tells, may lead to another one than is meant.
        frame
            Frame of the targets: the ``"measuring"`` frame, or that of the arm's ``"base"`` as it was identified.
        level
            Probability with which the bound of an error holds.

        Raises
        ------
        InputError
            A mistake in the targets; a session or target of which nothing is known.
        """
        joints = self._problem.joints
        try:
            core = asked(lambda given: self._core.compensate(given, frame, level), source(targets, joints, "targets"))
        except InputError as error:
            column = (error.key or "").removeprefix("column ")
            if "missing" not in str(error) or not (re.fullmatch(r"q\d+", column) or column in joints):
                raise
            message = (
                f"{error}; targets need a configuration to start from as well, in columns such as q1_deg: of the configurations that reach "
                "a target the nearest to it is taken"
            )
            raise InputError(message, file=error.file, line=error.line, key=error.key) from None
        warn(core.warnings, stacklevel=2)
        return Compensation(core)

    def export_urdf(
        self,
        urdf: Path,
        best_rigid: bool = False,
        *,
        fitted_alone: bool = False,
        workspace_mm: Sequence[float] | None = None,
    ) -> Export:
        """The URDF that the problem came from, with the origins of its chain as they were identified.

        Warns (:class:`FlexcalWarning`) where another geometry has a clearly smaller error on the held-out rows, and where the fit is
        not to be trusted.

        Parameters
        ----------
        urdf
            The URDF that the problem came from; it is not changed.
        best_rigid
            Write the rigid geometry that is nearest to the whole model (stiffnesses, effects, remainder), instead of the identified
            one.
        fitted_alone
            Write the geometry that a rigid model without effects gives, fitted to the same rows. Its base and tool, which
            :meth:`Export.summary` lists, belong to it.
        workspace_mm
            Box x0, x1, y0, y1, z0, z1 of the target in which ``best_rigid`` approximates, frame of the arm's base [mm]; everywhere
            within the limits of the joints by default.

        Raises
        ------
        InputError
            It is the URDF of another arm, or its chain ends where no origin could hold what was identified.
        """
        if best_rigid and fitted_alone:
            raise TypeError("best_rigid and fitted_alone: keep one of the two")
        if workspace_mm is not None and not best_rigid:
            raise TypeError("workspace_mm: has no effect without best_rigid=True")
        box, _ = region(workspace_mm, ())
        core = self._fit.export_urdf(urdf, best_rigid, fitted_alone, box)
        warn(core.warnings, stacklevel=2)
        return Export(core)

    def _repr_html_(self) -> str:
        return _html.identification(self)


class ClosedLoop(Fit):
    """The loop from the declared problem to one that leaves nothing to find; ``parameters``, ``covariance`` and ``residuals`` are
    those of the last fit, with everything that was found."""

    def __init__(self, core: _core.ClosedLoop, problem: Problem, spec: Spec) -> None:
        self._core = core
        self._fit = core.after()
        self._problem = problem
        self._spec = spec

    def _fit_of(self, words: dict[str, Any]) -> Any:
        return Restored(words, self._spec.part("after"))

    def summary(self) -> str:
        """What the command line prints with ``-v``, and what may be done if structure is left."""
        said = super().summary()
        if self.verdict != "unexplained":
            return said
        return (
            f"{said}\nNext: trace() of the closed_problem ranks candidates for what is left; a law can be declared by hand ([[effect]] law), or "
            "identify(remainder=True) corrects it without a law. after.trusted does not mean that all is explained.\n"
        )

    @property
    def verdict(self) -> str:
        """``"explained"`` (the effects with status ``"found"`` alone leave noise), ``"unexplained"`` (structure is left, or no
        effect is sure) or ``"nothing-found"``."""
        return str(self._document["verdict"])

    @once
    def effects(self) -> pd.DataFrame:
        """What was found, a row each, in that order.

        Columns: ``effect``, ``status`` (``"found"``, ``"probable"``, ``"located"`` or ``"contradicted"``: what may be claimed),
        ``description``, ``declaration`` (the line for an ``[[effect]]`` of problem.toml), ``p_value``; ``place``, ``depends_on`` and ``law`` with the probability that each
        is claimed with (``place_probability`` …; None and NaN where no evidence was weighed); ``stability``.
        """
        return effects_frame(self._document["effects"])

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

    @once
    def before(self) -> Identification:
        """The fit of the problem as declared."""
        return Identification(self._core.before(), self._problem, self._spec.part("before"))

    @once
    def after(self) -> Identification:
        """The fit with everything that was found; it predicts."""
        return Identification(self._core.after(), self.closed_problem, self._spec.part("after"))

    @once
    def closed_problem(self) -> Problem:
        """The problem with what was found declared: an input like any other."""
        from ._problem import Problem

        return Problem(str(self._core.closed_problem()))

    def _repr_html_(self) -> str:
        return _html.closed_loop(self)


def estimate(arm: Path | Identification | ClosedLoop, name: str) -> Sibling:
    """What the extension module takes as an estimate: a file, or the name and the text of one in memory."""
    earlier = earlier_estimate(arm, name)
    return earlier if isinstance(earlier, str) else earlier[:2]


def earlier_estimate(arm: Path | Identification | ClosedLoop, name: str) -> Prior:
    """What the extension module takes as a prior: a file, or the name and the text of an estimate in memory and the text of its remainder."""
    if isinstance(arm, ClosedLoop):
        arm = arm.after
    if isinstance(arm, Identification):
        return name, arm.to_json(), arm.remainder_json()
    if not isinstance(arm, (str, os.PathLike)):
        raise TypeError(f"an identification, a loop or the path of an estimate.json is needed, not {type(arm).__name__}")
    return os.fspath(arm)


class Trace(Result):
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

    @once
    def ranking(self) -> pd.DataFrame:
        """Candidates, best first: ``effect``, ``description``, ``p_value`` (corrected for the candidates tried) and
        ``expected_gain_mm`` (off the rms error of the poses fitted; none where these are tilts)."""
        import pandas as pd

        names = ["effect", "description", "p_value", "expected_gain_mm"]
        return pd.DataFrame([[entry.get(name) for name in names] for entry in self._document["ranking"]], columns=names)

    def _repr_html_(self) -> str:
        return _html.trace(self)


class Comparison(Fit):
    """All strategies and solvers side by side; ``parameters``, ``covariance`` and ``residuals`` are those of the joint fit."""

    def __init__(self, core: _core.Comparison, problem: Problem, spec: Spec) -> None:
        self._core = core
        self._fit = core.joint()
        self._problem = problem
        self._spec = spec

    def _fit_of(self, words: dict[str, Any]) -> Any:
        return Restored(words, self._spec.part("joint"))

    @once
    def fits(self) -> pd.DataFrame:
        """The fits, a row each: ``strategy``, ``solver``, mean error on the rows fitted and held out [mm] (``identification_mean_mm``,
        ``held_out_mean_mm``; ``left_out_mean_mm`` where no row is held out), ``iterations``, ``evaluations``, ``seconds``, ``termination``, ``trusted``, ``reduced_chi2``, ``condition_number``."""
        return compared_frame(self._document["rows"])

    @once
    def ablations(self) -> pd.DataFrame:
        """Joint fits with parts of the elasticity left out, by ``elasticity``, the part that is kept; columns as of :attr:`fits`."""
        return compared_frame(self._document["ablations"], "elasticity", "parameters")

    @once
    def errors(self) -> pd.DataFrame:
        """Errors of the nominal arm and of the joint fit [mm]; see :attr:`Identification.errors`."""
        joint = json.loads(self._fit.json())
        parts = ("identification", "held_out", "left_out")
        return errors_frame({"registered": self._document["registered"]} | {part: joint[part] for part in parts if part in joint})

    def _repr_html_(self) -> str:
        return _html.words(self.summary())
