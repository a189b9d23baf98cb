"""Problems, and what can be done with them."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from . import _core
from ._designs import Check, Next, Plan, Simulation, Study
from ._fits import ClosedLoop, Comparison, Identification, Trace, earlier_estimate
from ._forward import Forward
from ._least_squares import LeastSquares
from ._progress import Told, told
from ._restored import Spec
from ._sections import HeldOut, toml_held_out, toml_number, toml_point, with_keys
from ._tables import Data, Path, Source, asked, count, region, source, warn
from .errors import InputError

Strategy: TypeAlias = Literal["joint", "sequential", "sequential-one-sweep", "geometry-only", "stiffness-only", "rigid"]
Solver: TypeAlias = Literal[
    "auto",
    "levenberg-marquardt",
    "gauss-newton",
    "pseudo-inverse",
    "bounded",
    "interior-point",
    "reflective",
    "clamped",
]
Criterion: TypeAlias = Literal["S", "A", "D", "E", "I"]
Purpose: TypeAlias = Literal["accuracy", "causes", "both"]

MOST_POSES = 10_000
"""Poses that a check or a plan takes at most, as on the command line."""
MOST_SEED = 2**64 - 1
MOST_SIMULATED = 1_000_000
"""Poses that a simulation takes at most, as on the command line."""

TEXT = "<text>"
"""What messages call a problem in memory."""

FILL_IN = {
    "target_m": "fill in target_m: where the measured point sits in the frame of the tip, roughly; now its origin",
    "position_sigma_mm": "fill in position_sigma_mm: 1 σ of a coordinate that your instrument measures; now 0.05",
    "held_out": "held_out: now 30 % of the poses are held out to judge the fit",
}
"""What a problem from a URDF leaves to its user, by its keys."""


class Problem(Forward):
    """An arm as declared, what is free of it, and where its measurements are.

    As a forward model (:meth:`predict`, :meth:`jacobian`) it is the nominal arm.

    Parameters
    ----------
    problem
        A problem.toml, the folder that holds one, or its text (anything with a line break is text; the data files that a text
        names are looked for in the current folder).

    Raises
    ------
    InputError
        The first mistake found, with file, line and key.
    """

    def __init__(self, problem: str | os.PathLike[str]) -> None:
        if isinstance(problem, str) and "\n" in problem:
            self._hold(_core.Problem.parse(problem, TEXT))
        else:
            self._hold(_core.Problem.read(problem))

    @classmethod
    def from_urdf(
        cls,
        path: Path,
        base: str | None = None,
        tip: str | None = None,
        *,
        position_sigma_mm: float | None = None,
        held_out: HeldOut | None = None,
        target_m: Sequence[float] | None = None,
        payload_kg: float | None = None,
        payload_at_m: Sequence[float] | None = None,
        reference_temperature_C: float | None = None,
    ) -> Problem:
        """The chain between two links of a URDF, as ``flexcal init`` writes it (docs/urdf.md).

        ``[parameters]`` frees what measured positions tell apart. Joints keep their names, and columns of data may go by them.
        ``notes`` also name what is left to fill in.

        Parameters
        ----------
        path
            The URDF; a xacro has to be expanded first.
        base
            Link from which the chain goes; the root, if it is not named.
        tip
            Link at its end; the only leaf, if it is not named.
        position_sigma_mm
            1 σ of a coordinate that your instrument measures; a guess, if it is not given.
        held_out
            Rows that judge and are not fitted: ``"none"``, their fraction, or the name of a session.
        target_m
            Where the measured point sits in the frame of the tip, roughly; its origin, if it is not given.
        payload_kg, payload_at_m
            Mass that the hand carries in all rows, and its centre in the frame of the tip.
        reference_temperature_C
            Temperature at which the arm has its nominal size: effects of a column ``temperature_C`` are sought about it.

        Raises
        ------
        InputError
            The first mistake in the URDF, with its line; a link that it lacks; several leaves to choose from.
        """
        text = os.fspath(path)
        if "\n" in text or text.lstrip().startswith("<"):
            start = text.strip().partition("\n")[0][:40]
            raise InputError(f"path: the path of a URDF is needed, not its text ({start} …); write the text to a file first", key="path")
        core = _core.Problem.from_urdf(path, base, tip, TEXT)
        given: dict[str, str] = {}
        tool: dict[str, str] = {}
        if target_m is not None:
            tool["target_m"] = toml_point("target_m", target_m)
        if payload_kg is not None:
            tool["payload_kg"] = toml_number("payload_kg", payload_kg, zero=True)
        if payload_at_m is not None:
            tool["payload_at_m"] = toml_point("payload_at_m", payload_at_m)
        if reference_temperature_C is not None:
            given["reference_temperature_C"] = repr(float(reference_temperature_C))
        if position_sigma_mm is not None:
            given["position_sigma_mm"] = toml_number("position_sigma_mm", position_sigma_mm)
        if held_out is not None:
            given["held_out"] = toml_held_out(held_out)
        notes = [*core.notes, *(note for key, note in FILL_IN.items() if key not in given | tool)]
        return _parsed(with_keys(with_keys(core.text, "data", given), "tool", tool), TEXT, notes)

    def _hold(self, core: _core.Problem) -> None:
        self._core = core
        self._forward = core
        self._reader = core
        self._functions: dict[Strategy, LeastSquares] = {}

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> object:
            hint = ""
            if name in ("calibrate", "fit", "estimate", "solve"):
                hint = "; write identify()"
            elif not name.startswith("_") and hasattr(Identification, name):
                hint = f"; identify the arm first: problem.identify().{name}"
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}{hint}")

    @property
    def notes(self) -> list[str]:
        """What to know of a problem that was made from a URDF (angles that were taken as right ones …), and what is to be filled in."""
        return self._core.notes

    @property
    def name(self) -> str:
        """Its name."""
        return self._core.name

    @property
    def title(self) -> str:
        """One line for people."""
        return self._core.title

    @property
    def text(self) -> str:
        """The problem file."""
        return self._core.text

    @property
    def files(self) -> list[Path]:
        """Measurement files that it names."""
        return list(self._core.files)

    @property
    def joints(self) -> list[str]:
        """Names of the joints, from the base outwards, fixed ones as well."""
        return self._core.joints

    @property
    def units(self) -> list[Literal["rad", "m"] | None]:
        """Unit of each joint's command, from the base outwards; None at fixed joints."""
        return self._core.units

    def __repr__(self) -> str:
        return f"<flexcal.Problem {self.name!r}>"

    def __reduce__(self) -> tuple[object, ...]:
        return _parsed, (self._core.text, str(self._core.file), self._core.notes)

    def identify(
        self,
        data: Data | None = None,
        strategy: Strategy = "joint",
        solver: Solver = "auto",
        *,
        remainder: bool = False,
        prior: Path | Identification | ClosedLoop | None = None,
        drift_days: float = 0.0,
        held_out: HeldOut | None = None,
        progress: Told = False,
    ) -> Identification:
        """Fits the free parameters to the rows that are not held out.

        Parameters
        ----------
        data
            Measurements instead of those that the problem names: a path or several, a DataFrame, or a dict of arrays, with the
            columns of files (``q1_deg`` … or ``q1_rad`` …, ``x_mm``, ``y_mm``, ``z_mm``, ``split`` …).
        strategy
            Which parameters are fitted together.
        solver
            ``"auto"`` keeps bounds and constraints where there are any.
        remainder
            Correct predictions by what no law explains, if poses left out gain by it (docs/accuracy.md). A remainder that the
            problem declares corrects them anyway.
        prior
            Earlier identification of the same arm (of a loop its last fit), or its ``estimate.json``: its posterior is the prior, and rows that were fitted
            there are left out; or the ``PRIOR.toml`` of :func:`flexcal.fleet` (docs/life.md).
        drift_days
            Days since the earlier identification, by whose drift the prior is widened.
        held_out
            Rows that judge and are not fitted, instead of those that the problem says: ``"none"``, as for the last fit of all
            rows, their fraction, or the name of a session. The result's ``problem`` says so.
        progress
            A function that is called with a :class:`Progress` at every step, or True for a line on standard error.

        Raises
        ------
        InputError
            A mistake in the measurements; problem, data, strategy and solver do not fit each other.
        """
        if held_out is not None:
            text = with_keys(self._core.text, "data", {"held_out": toml_held_out(held_out)})
            return _parsed(text, str(self._core.file), self._core.notes).identify(
                data, strategy, solver, remainder=remainder, prior=prior, drift_days=drift_days, progress=progress
            )
        given = self._given_data(data)
        read = self._read(given)
        with told(progress) as step:
            earlier = None if prior is None else earlier_estimate(prior, "estimate.json")
            core = self._core.identify(read, strategy, solver, remainder, earlier, drift_days, step)
        spec = Spec("identify", self, given, strategy, solver, remainder, prior=earlier, drift_days=drift_days)
        result = Identification(core, self, spec)
        result._warn(stacklevel=2)
        return result

    def loop(self, data: Data | None = None, *, progress: Told = False) -> ClosedLoop:
        """Finds the effects that the problem lacks and adds them, until nothing is left to find; held-out rows only judge.

        Parameters are those of :meth:`identify`.
        """
        given = self._given_data(data)
        read = self._read(given)
        with told(progress) as step:
            result = ClosedLoop(self._core.close(read, step), self, Spec("loop", self, given))
        result._warn(stacklevel=2)
        return result

    def trace(self, data: Data | None = None, *, progress: Told = False) -> Trace:
        """Ranks the effects that the residual points to; changes nothing. Parameters are those of :meth:`identify`."""
        given = self._given_data(data)
        read = self._read(given)
        with told(progress) as step:
            result = Trace(self._core.trace(read, step), self, Spec("trace", self, given))
        result.fit._warn(stacklevel=2)
        return result

    def compare(self, data: Data | None = None, *, paper: bool = False, progress: Told = False) -> Comparison:
        """Fits with every strategy and solver, and without parts of the elasticity.

        Parameters
        ----------
        data, progress
            As for :meth:`identify`.
        paper
            Include the procedure of Chen et al. (2021); always included for the paper's arm.
        """
        given = self._given_data(data)
        read = self._read(given)
        with told(progress) as step:
            core = self._core.compare(read, paper, step)
        result = Comparison(core, self, Spec("compare", self, given, paper=paper))
        result._warn(stacklevel=2)
        return result

    def least_squares(self, data: Data | None = None, strategy: Strategy = "joint") -> LeastSquares:
        """Residuals and their Jacobian by parameters as functions of arrays, for a solver of one's own.

        Parameters
        ----------
        data
            As for :meth:`identify`; it is read once.
        strategy
            Which parameters vary.
        """
        given = self._given_data(data)
        return LeastSquares(self._core.least_squares(self._read(given), strategy), self, given, strategy)

    def residuals(self, x: npt.ArrayLike, strategy: Strategy = "joint") -> npt.NDArray[np.float64]:
        """Whitened residuals of the problem's own data at the deviations ``x`` of the unknowns, shape (residuals,).

        Names, units and order of ``x`` are those of ``least_squares().unknowns``; :meth:`least_squares` takes other data. The data are
        read with the first call.
        """
        return self._function(strategy).residuals(x)

    def jacobian_by_parameters(self, x: npt.ArrayLike, strategy: Strategy = "joint") -> npt.NDArray[np.float64]:
        """Derivatives of :meth:`residuals` by ``x``, shape (residuals, unknowns). (:meth:`jacobian` differentiates positions by the
        configuration.)"""
        return self._function(strategy).jacobian(x)

    def _function(self, strategy: Strategy) -> LeastSquares:
        if strategy not in self._functions:
            self._functions[strategy] = self.least_squares(None, strategy)
        return self._functions[strategy]

    def simulate(self, truth: Path, poses: int | None = None, *, data: Data | None = None, seed: int = 1) -> Simulation:
        """Measures a true arm on the virtual test rig (docs/truth.md).

        Parameters
        ----------
        truth
            A TRUTH.toml, or the folder that holds one: how the true arm deviates from the problem, and where poses lie (within the
            limits of the joints, if it does not say).
        poses
            Number of random poses.
        data
            A table of poses to measure instead, such as ``plan.poses``; positions in it do not count.
        seed
            Of every random number.
        """
        if (poses is None) == (data is None):
            raise TypeError("poses or data: one of the two is needed")
        number = 0 if poses is None else count("poses", poses, 1, MOST_SIMULATED)
        seed = count("seed", seed, 0, MOST_SEED)
        return Simulation(_core.simulated(self._core, truth, number, self._given(data), seed))

    def check(
        self,
        data: Data | None = None,
        *,
        poses: int | None = None,
        candidates: Data | None = None,
        truth: Path | None = None,
        seed: int = 1,
    ) -> Check:
        """Says what measurements in some poses will tell, before anyone makes them.

        Parameters
        ----------
        data
            Measurements whose poses are judged; those of the problem, if nothing else is given. Positions are not needed.
        poses
            Number of poses to draw: of the candidates, or else within the limits of the joints.
        candidates
            A table of poses, with the columns of measurements; judged as a whole without ``poses``.
        truth
            A TRUTH.toml whose ``[poses]`` say where poses may lie, instead of the limits of the joints.
        seed
            Of every random number.
        """
        poses = None if poses is None else count("poses", poses, 1, MOST_POSES)
        seed = count("seed", seed, 0, MOST_SEED)
        if data is not None and candidates is not None:
            raise TypeError("data and candidates both name poses; keep one of the two")
        table = self._given(candidates)
        measured = None
        if table is None and poses is None:
            if data is None and str(self._core.file) == TEXT and not all(map(os.path.exists, self.files)):
                raise InputError("poses: nothing to judge; pass poses=, candidates= or data=", key="poses")
            measured = self._poses_of(source(data, self.joints) if data is not None else self.files)
        elif data is not None:
            raise TypeError("data name the poses; leave out their number")
        return Check(_core.check(self._core, measured, table, poses, truth, seed))

    def plan(
        self,
        poses: int,
        data: Data | None = None,
        *,
        candidates: Data | None = None,
        criterion: Criterion = "S",
        separate: tuple[str, str] | None = None,
        workspace_mm: Sequence[float] | None = None,
        keep_out_mm: Sequence[Sequence[float]] = (),
        truth: Path | None = None,
        seed: int = 1,
    ) -> Plan:
        """Chooses the poses that identify best.

        Parameters
        ----------
        poses
            Number of poses to measure.
        data
            Measurements that are there already: the plan completes them.
        candidates
            A table of poses to take; otherwise they are sought within the limits of the joints.
        criterion
            What to make small: the geometric mean of the standard errors (``"S"``), the mean variance (``"A"``), the volume of the
            confidence ellipsoid (``"D"``), the largest variance of any combination (``"E"``) or the mean variance of predicted
            positions (``"I"``).
        separate
            Two effects to tell apart, each as a problem declares it: ``"gear-ratio = { joint = 3 }"``.
        workspace_mm
            Box x0, x1, y0, y1, z0, z1 in which the nominal target stays, frame of the arm's base [mm].
        keep_out_mm
            Planes nx, ny, nz, d that the nominal target stays beyond: n·p ≥ d for a normal n, frame of the arm's base [mm].
        truth
            A TRUTH.toml whose ``[poses]`` say where poses may lie, instead of the limits of the joints.
        seed
            Of every random number.
        """
        poses, seed = count("poses", poses, 1, MOST_POSES), count("seed", seed, 0, MOST_SEED)
        given, table = self._given(data), self._given(candidates)
        inside = region(workspace_mm, keep_out_mm)
        return Plan(_core.plan(self._core, poses, given, table, criterion, separate, inside, truth, seed))

    def next(
        self,
        poses: int = 5,
        data: Data | None = None,
        *,
        pool: Data | None = None,
        purpose: Purpose = "accuracy",
        explanations: Path | None = None,
        tolerance_mm: float | None = None,
        level: float = 0.95,
        remainder: bool = False,
        workspace_mm: Sequence[float] | None = None,
        keep_out_mm: Sequence[Sequence[float]] = (),
        truth: Path | None = None,
        seed: int = 1,
    ) -> Next:
        """Chooses the poses to measure next, or says that there are enough (docs/next.md).

        Parameters
        ----------
        poses
            Number of poses to choose.
        data
            Measured poses instead of those of the files that the problem names.
        pool
            A table of poses to choose from; predictions are judged there. Otherwise poses lie within the limits of the joints.
        purpose
            ``"accuracy"`` lowers the error of predictions, ``"causes"`` tells the effects of ``explanations`` apart.
        explanations
            The loop.json with the effects to tell apart.
        tolerance_mm
            Poses are enough when errors stay below it with the probability ``level``.
        level
            Probability with which errors stay below the bound.
        remainder
            Judge predictions with a remainder, as ``identify(remainder=True)`` makes them.
        workspace_mm
            Box x0, x1, y0, y1, z0, z1 in which the nominal target stays, frame of the arm's base [mm].
        keep_out_mm
            Planes nx, ny, nz, d that the nominal target stays beyond: n·p ≥ d for a normal n, frame of the arm's base [mm].
        truth
            A TRUTH.toml whose ``[poses]`` say where poses may lie, instead of the limits of the joints.
        seed
            Seed of all random numbers.
        """
        poses, seed = count("poses", poses, 1, MOST_POSES), count("seed", seed, 0, MOST_SEED)
        read, table = self._read(self._given_data(data)), self._given(pool)
        inside = region(workspace_mm, keep_out_mm)
        core = _core.next(
            self._core, read, poses, table, purpose, explanations, tolerance_mm, level, remainder, inside, truth, seed
        )
        return Next(core)

    def _given_data(self, data: Data | None) -> Source:
        if data is not None:
            return source(data, self.joints)
        missing = [file for file in self.files if not os.path.exists(file)]
        if missing and str(self._core.file) == TEXT:
            message = (
                f"no such file: {os.fspath(missing[0])}, which [data] of this problem in memory names; pass data=, or work in the "
                "folder of that file"
            )
            raise InputError(message, file=TEXT, key="data.files")
        return self.files

    def _read(self, given: Source) -> _core.Data:
        read = asked(self._core.data, given)
        warn(read.warnings, stacklevel=3)
        return read

    def _given(self, data: Data | None) -> _core.Poses | None:
        return None if data is None else self._poses_of(source(data, self.joints))

    def _poses_of(self, table: Source) -> _core.Poses:
        poses = asked(self._core.poses, table)
        warn(poses.warnings, stacklevel=4)
        return poses


def study(
    study: Path, folder: Path | None = None, *, progress: Callable[[int, int], object] | None = None
) -> Study:
    """Runs a STUDY.toml: many fits to simulated measurements whose truth is known (docs/study.md). Studies of misprints are for the command
    line.

    Parameters
    ----------
    study
        A STUDY.toml, or the folder that holds one.
    folder
        Where finished parts are kept, so that an interrupted study goes on where it stopped; nowhere by default.
    progress
        A function that is called after each fit with the number of fits done and of those to do.

    Raises
    ------
    InputError
        A mistake in the study or in the files that it names.
    """
    step = None if progress is None else (lambda done, fits, _poses, _cost: progress(done, fits))
    if folder is not None:
        return Study(_core.studied(study, folder, step))
    with tempfile.TemporaryDirectory() as kept:
        return Study(_core.studied(study, kept, step))


def _parsed(text: str, file: str, notes: list[str]) -> Problem:
    """A problem from its pickle."""
    problem = Problem.__new__(Problem)
    problem._hold(_core.Problem.parse(text, file, notes))
    return problem
