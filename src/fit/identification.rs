//! Identification: from a problem and its data to estimates, their uncertainty, and findings.

use std::cell::OnceCell;
use std::collections::BTreeSet;
use std::sync::{Arc, OnceLock};
use std::time::Instant;

use nalgebra::{DMatrix, DVector};

use crate::error::TableErrorKind;
use crate::fit::checks::checked_fit::CheckedFit;
use crate::fit::checks::distance_zero::distance_zero;
use crate::fit::checks::finding::{Finding, FindingCode};
use crate::fit::checks::held_fixtures::held_fixture;
use crate::fit::checks::lens::lens_finding;
use crate::fit::checks::misreading::{Explanations, is_of_views, start_of_fit, with_readings};
use crate::fit::checks::outliers::outliers;
use crate::fit::checks::payload_place::payload_finding;
use crate::fit::checks::pose_sufficiency::PoseSufficiency;
use crate::fit::checks::required_columns::check_columns;
use crate::fit::checks::{findings, held_out};
use crate::fit::influential_rows::influential;
use crate::fit::outcome::{Estimate, Identification, enter};
use crate::fit::stages::custom_solver::CustomSolver;
use crate::fit::stages::fitting::{FitEnd, Fitting};
use crate::fit::stages::gauge::in_order;
use crate::fit::stages::noise_model::{MIN_SIGMA, NoiseModel};
use crate::fit::stages::placement::ASSUMED_SIGMA;
use crate::fit::stages::stage::StageError;
use crate::fit::uncertainty::active_constraint::ActiveConstraint;
use crate::fit::uncertainty::covariance::Collected;
use crate::fit::uncertainty::noise::{Noise, assumed_noise, fitted};
use crate::fit::uncertainty::prior_sizes::prior_sizes;
use crate::fit::uncertainty::refuted_priors::refuted_priors;
use crate::fit::uncertainty::second_solution::best_of_two;
use crate::fit::uncertainty::statistics::Statistics;
use crate::fit::warm_start::WarmStart;
use crate::fit::{ErrorSummary, Errors, IdentifyError, Options, Placement, SolverChoice, Strategy};
use crate::least_squares::solver::Termination;
use crate::least_squares::{LinearisationCache, Loss};
use crate::measurement::{Dataset, Measurements, Split};
use crate::model::Model;
use crate::model::parameter::{Parameter, ParameterSite};
use crate::problem::{HeldOut, ParameterRule, Problem, Robust, RobustLoss, pattern};

/// Identifies the free parameters of `problem` from the identification rows of `data`. Held-out
/// rows do not influence the estimates of the arm.
///
/// # Errors
/// Returns an error if problem, data, strategy and solver are not compatible, or if the fit was
/// stopped.
pub fn identify(
    problem: &Problem,
    data: &Dataset,
    options: &Options,
) -> Result<Identification, IdentifyError> {
    let placement = Placement::of(&data.measurements);
    let model = options.strategy.model(Model::new(problem, &placement.bases, &placement.targets)?);
    identify_model(&model, problem, data, options)
}

/// Checks that the data have rows to fit, configurations of the arm, and every column that the
/// problem needs.
fn check_data(
    problem: &Problem,
    measurements: &Measurements,
    split: &Split,
) -> Result<(), IdentifyError> {
    let (found, joints) = (measurements.joints, problem.joints.len());
    if found != joints {
        return Err(IdentifyError::JointCount { found, joints });
    }
    if problem.data.fits_orientation {
        let error = |kind| IdentifyError::from(problem.data.location.clone().error(kind));
        if measurements.orientations.is_none() {
            return Err(error(TableErrorKind::NoOrientation));
        }
        if problem.data.position_sigma.is_none() && !measurements.has_sigma_in_every_row() {
            return Err(error(TableErrorKind::NoPositionSigma));
        }
    }
    check_columns(problem, measurements)?;
    if split.identification.is_empty() { Err(IdentifyError::NoPoses) } else { Ok(()) }
}

/// Identifies as [`identify`] does, but with a model that the caller has derived from the problem,
/// for example by [`Strategy::model`].
///
/// # Errors
/// Returns an error if problem, data, strategy and solver are not compatible, or if the fit was
/// stopped.
pub fn identify_model(
    model: &Model,
    problem: &Problem,
    data: &Dataset,
    options: &Options,
) -> Result<Identification, IdentifyError> {
    let Dataset { measurements, split } = data;
    let mut found = fit_rows(model, problem, (measurements, split), options)?;
    let is_far_off = |found: &Identification| {
        found.findings.iter().any(|of| of.code == FindingCode::NominalFarOff)
    };
    if is_of_views(measurements) && !found.termination.converged() && is_far_off(&found) {
        // Further fits would not lead to the images either.
        return Ok(found);
    }
    // A robust loss already limits the influence of single rows.
    if options.influential_rows && !options.provisional && problem.robust.is_none() {
        let warm_start = Some(Arc::new(found.warm_start(true)));
        let provisional = Options { warm_start, ..provisional_options(&found, options) };
        let without = |rows: &[usize]| {
            let left_out: BTreeSet<usize> = rows.iter().copied().collect();
            let rows = split.identification.iter().copied();
            let kept = rows.filter(|row| !left_out.contains(row)).collect();
            let split = Split { identification: kept, held_out: split.held_out.clone() };
            fit_rows(model, problem, (measurements, &split), &provisional).ok()
        };
        let rows = (measurements, split.identification.as_slice());
        if let Some(influential) = influential(&found, rows, without) {
            found.state_influential_rows(influential, measurements.leading());
        }
    }
    if !options.provisional && options.earlier.is_none() {
        let provisional = provisional_options(&found, options);
        let fit = |problem: &Problem| identify(problem, data, &provisional);
        // Wrong intrinsics bend the arm, so that they are the reason of other findings.
        let lens = lens_finding(problem, data, &found, fit);
        let zero = distance_zero(problem, data, &found, |of| identify(problem, of, &provisional));
        let held = zero.is_none().then(|| held_fixture(problem, measurements, &found, fit));
        found.findings.splice(0..0, lens.into_iter().chain(zero));
        found.findings.extend(held.flatten());
        if options.influential_rows {
            found.findings.extend(payload_finding(problem, data, &found, fit));
        }
    }
    Ok(found)
}

/// Returns the options of a provisional fit that starts at the values that a fit found.
fn provisional_options(found: &Identification, options: &Options) -> Options {
    let values = found.estimates.iter().map(|estimate| (estimate.name.clone(), estimate.estimate));
    let start = values.collect();
    Options { progress: None, provisional: true, start, ..options.clone() }
}

/// Fits the identification rows of a split and checks the result.
#[expect(clippy::too_many_lines, reason = "one result, listed field by field")]
fn fit_rows(
    model: &Model,
    problem: &Problem,
    (measurements, split): (&Measurements, &Split),
    options: &Options,
) -> Result<Identification, IdentifyError> {
    let clock = Instant::now();
    let cache = if options.provisional {
        LinearisationCache::provisional()
    } else {
        LinearisationCache::default()
    };
    check_data(problem, measurements, split)?;
    let placement = Placement::of(measurements);
    let (strategy, solver) = (options.strategy, options.solver.decide(model));
    let custom_solver = options.custom_solver.as_deref();
    let custom_keeps =
        custom_solver.is_some_and(CustomSolver::keeps_bounds) && model.constraints.is_empty();
    let is_custom = solver == SolverChoice::Custom;
    if is_custom && custom_solver.is_none() {
        return Err(IdentifyError::NoCustomSolver);
    }
    if !(solver.keeps(model) || is_custom && custom_keeps) {
        return Err(IdentifyError::BoundsIgnored { solver: solver.as_str() });
    }
    let (declared, has_declared_noise) =
        (problem.data.position_sigma, measurements.has_declared_noise(problem));
    let mut fitting = Fitting {
        model,
        measurements,
        split,
        placement: &placement,
        held_out_only: placement.held_out_only(model, measurements, split),
        strategy,
        solver,
        custom_solver,
        loss: problem.robust.map_or(Loss::Squares, loss),
        progress: options.progress.as_ref(),
        stop: options.stop.as_ref(),
        max_steps: options.max_steps,
        to_be_judged: false,
        sigma: declared.unwrap_or(ASSUMED_SIGMA),
        turn_sigma: problem.data.orientation_sigma.filter(|_| problem.data.fits_orientation),
        noise_model: NoiseModel::DECLARED,
        turn_noise_model: NoiseModel::DECLARED,
        cache: &cache,
        linear_model: options
            .warm_start
            .as_ref()
            .and_then(|warm_start| warm_start.linear_model.as_ref()),
        earlier: options.earlier.as_deref(),
    };
    if let Some(error) = fitting.unpredictable() {
        let error = problem.with_cause_of_overload(error, measurements.largest_payload(problem));
        return Err(with_readings(&fitting, problem, error).into());
    }
    let unknowns = fitted_parameters(&fitting)?;
    let (start, registered) =
        prepared(&mut fitting, options.warm_start.as_deref(), has_declared_noise)?;
    let begin = start_of_fit(&mut fitting, options.begin(model, &start))?;
    let enough = PoseSufficiency::new(&fitting, problem, &unknowns, &start);
    // A few new rows cannot distinguish a larger noise from a change since the earlier data.
    let judged = options.earlier.is_none() && enough.judges_noise(unknowns.len());
    let asked = !options.provisional;
    let first = fitted(&mut fitting, &begin, (has_declared_noise, judged))?;
    let ((mut end, statistics, noise), second) = if asked {
        best_of_two(&mut fitting, first, (has_declared_noise, judged))?
    } else {
        (first, None)
    };
    let errors = fitting.position_errors(&split.identification, &end.x);
    let outliers = outliers(&statistics.lengths, &split.identification, &errors, measurements);
    // The triangle is computed before other rows are fitted, while the cache still holds the first
    // linearisation of this fit.
    let whitened_triangle =
        if asked { fitting.whole().data_triangle(&start) } else { DMatrix::zeros(0, 0) };
    let (estimates, covariance, not_converged) = estimated(&fitting, &mut end, &statistics, noise)?;
    let (mut fitted, whole) = (fitting.errors(&end.x), fitting.whole());
    let mut registered = registered;
    let left_out = if problem.data.held_out == Some(HeldOut::Nothing) {
        let configurations = measurements.configurations(problem).0;
        let at = |x: &DVector<f64>, unknowns: &[usize], errors: &mut Errors| {
            let left_out = fitting.left_out_errors(x, unknowns, &configurations);
            let rows = split.identification.iter().copied();
            errors.held_out = ErrorSummary::of_rows(measurements, rows, &left_out);
            errors.is_left_out = true;
            left_out
        };
        at(&start, &fitting.placements(), &mut registered);
        let free = whole.unknowns.iter().zip(&end.at_bound).filter(|(_, bound)| bound.is_none());
        at(&end.x, &free.map(|(&k, _)| k).collect::<Vec<usize>>(), &mut fitted)
    } else {
        Vec::new()
    };
    let order = whole.model_order();
    let (noise_factor, sigma_taken) = assumed_noise(&whole, measurements.leading());
    let told = options.earlier.is_none()
        && asked
        && noise != Noise::Unknown
        && end.termination.converged();
    let values: Vec<f64> = whole.unknowns.iter().map(|&k| end.x[k]).collect();
    let sizes = || prior_sizes(&unknowns, &values, &statistics.covariance);
    let prior_sizes = if told { sizes() } else { Vec::new() };
    let spreads = fitting.spreads(&problem.fixtures, &start, &end.x);
    let held_out = || held_out::rows(&fitting, &end.x, &whole.unknowns, &statistics.covariance);
    let held_out_rows = if asked { held_out() } else { Vec::new() };
    let held_out_outliers = held_out::outliers(&held_out_rows);
    let (findings, misread) = if asked {
        let held: Vec<bool> = end.at_bound.iter().map(Option::is_some).collect();
        let refuted_priors = match (noise, fitting.loss) {
            (Noise::Declared, Loss::Squares) if options.earlier.is_none() => refuted_priors(
                &fitting.with_declared_noise().whole(),
                &end.x,
                &held,
                &rules(problem, &unknowns),
                noise_factor,
            ),
            _ => Vec::new(),
        };
        let checked = CheckedFit {
            fitting: &fitting,
            problem,
            registered_x: &start,
            end: &end,
            registered: &registered,
            fitted: &fitted,
            outliers: &outliers,
            held_out_outliers: &held_out_outliers,
            whole: &whole,
            triangle: &whitened_triangle,
            has_declared_noise,
            noise,
            noise_factor,
            sigma_taken,
            covariance: &statistics.covariance,
            statistics: &statistics,
            has_further_fits: options.influential_rows,
            second: second.as_ref(),
            refuted_priors: &refuted_priors,
            poses: &enough,
            not_converged: not_converged.as_ref(),
            prior_sizes: &prior_sizes,
            spreads: &spreads,
            // A fit that starts from another fit of the same table does not search misreadings
            // again.
            explanations: if options.start.is_empty() {
                OnceCell::new()
            } else {
                OnceCell::from(Explanations::default())
            },
        };
        let findings = findings(&checked);
        let is_misread = findings.iter().any(|finding| finding.code == FindingCode::Misread);
        let explanations = checked.explanations.get().filter(|_| is_misread);
        let misread = explanations.and_then(|explanations| explanations.effect(fitting.sigma));
        (findings, misread)
    } else {
        (not_converged.into_iter().collect(), None)
    };
    let columns = if asked { order.clone() } else { Vec::new() };
    Ok(Identification {
        provisional: options.provisional,
        misread,
        findings,
        poses: enough.poses,
        several_targets: enough.several_targets,
        strategy,
        solver,
        solver_reason: options.solver.reason(model),
        termination: end.termination,
        iterations: end.iterations,
        evaluations: end.evaluations,
        alternation: end.alternation,
        noise,
        registered,
        fitted,
        left_out,
        reduced_chi2: statistics.reduced_chi2.filter(|_| has_declared_noise),
        chance: statistics.chance.filter(|_| has_declared_noise),
        noise_factor,
        sigma_taken,
        sigma_scale: fitting.noise_model.scale.min(1.0),
        noise_models: (fitting.noise_model, fitting.turn_noise_model),
        kinds: fitting.errors_by_kind(&start, &end.x),
        spreads,
        weak: in_order(&end.gauge.weak, &order),
        orientation: fitting.orientation(&start, &end.x),
        coordinates: whole.count(),
        whitened_triangle: (whitened_triangle, columns, OnceLock::new()),
        estimates,
        covariance: covariance.finish(),
        prior_sizes,
        unknowns: order.iter().map(|&place| unknowns[place].name.clone()).collect(),
        active_constraints: ActiveConstraint::all(
            &statistics.constraints,
            &statistics.prices.constraints,
            model,
        ),
        outliers,
        held_out_outliers,
        held_out_rows,
        influential_rows: None,
        x: end.x,
        registered_x: start,
        registered_parts: registered_parts(model),
        prior: None,
        fitted_rows: if asked {
            split.identification.iter().map(|&row| measurements.row_digest(row)).collect()
        } else {
            Vec::new()
        },
        start_times: measurements.start_times(),
        has_approach: measurements.approach.is_some(),
        sigma: fitting.sigma,
        seconds: clock.elapsed().as_secs_f64(),
    })
}

/// Returns the names of the parts that registration fits, because some of their parameters are
/// free.
fn registered_parts(model: &Model) -> Vec<&'static str> {
    let placed = || model.parameters.iter().map(|parameter| parameter.site);
    let has = |is_part: fn(ParameterSite) -> bool| {
        placed().any(|site| site.is_placement() && is_part(site))
    };
    let parts = [
        ("base", has(|site| matches!(site, ParameterSite::Base { .. }))),
        ("tool", has(|site| matches!(site, ParameterSite::Target { .. }))),
        ("fixtures", has(|site| matches!(site, ParameterSite::Fixture { .. }))),
    ];
    parts.into_iter().filter(|(_, is_free)| *is_free).map(|(part, _)| part).collect()
}

/// Returns the full parameter vector of the registered nominal arm and its errors. Also sets the σ
/// and the noise models with which the fit starts. Without a declared σ, it is the scatter of these
/// errors; the noise models are those of the warm start, if it contains any.
fn prepared(
    fitting: &mut Fitting,
    warm_start: Option<&WarmStart>,
    has_declared_noise: bool,
) -> Result<(DVector<f64>, Errors), StageError> {
    let (start, registered) = match warm_start {
        Some(warm_start) => (warm_start.registered(fitting.model), warm_start.errors),
        None => fitting.registered().map(|start| (start.clone(), fitting.errors(&start)))?,
    };
    if !has_declared_noise {
        let scatter =
            registered.identification.rms.norm / fitting.measurements.leading().expected_norm();
        fitting.sigma = scatter.max(MIN_SIGMA);
    }
    if let Some(noise) = warm_start.and_then(|warm_start| warm_start.noise) {
        (fitting.noise_model, fitting.turn_noise_model) = noise;
    }
    Ok((start, registered))
}

/// Returns the parameters that the strategy varies.
///
/// # Errors
/// Returns an error if the strategy varies only bases and targets.
fn fitted_parameters<'a>(fitting: &Fitting<'a>) -> Result<Vec<&'a Parameter>, IdentifyError> {
    let unknowns: Vec<&Parameter> = fitting.whole().parameters().collect();
    if fitting.strategy != Strategy::Joint
        && unknowns.iter().all(|parameter| parameter.site.is_placement())
    {
        return Err(IdentifyError::NothingToFit { strategy: fitting.strategy.as_str() });
    }
    Ok(unknowns)
}

/// Returns the estimates of all parameters, their covariance, and a finding if the fit did not
/// converge. Bases and targets that only held-out rows use are first fitted to those rows with the
/// arm's parameters fixed, and `end` is updated.
fn estimated(
    fitting: &Fitting,
    end: &mut FitEnd,
    statistics: &Statistics,
    noise: Noise,
) -> Result<(Vec<Estimate>, Collected, Option<Finding>), StageError> {
    let (model, time_measured) = (fitting.model, fitting.measurements.time_measured);
    let mut estimates: Vec<Estimate> =
        model.parameters.iter().map(|p| Estimate::unfitted(p, time_measured)).collect();
    let mut covariance = Collected::new(estimates.len());
    enter((&mut estimates, &mut covariance), &fitting.whole(), end, statistics);
    let mut not_converged =
        (!end.termination.converged()).then(|| not_converged_finding(end.termination));
    if let Some(stage) = fitting.held_out_stage() {
        let placed: FitEnd = stage.run(&end.x)?.into();
        end.iterations += placed.iterations;
        end.evaluations += placed.evaluations;
        let statistics = Statistics::new(
            &stage,
            &placed,
            (noise == Noise::Declared).then_some(fitting.noise_model),
        )?;
        enter((&mut estimates, &mut covariance), &stage, &placed, &statistics);
        let held_out = (!placed.termination.converged()).then(|| {
            let reason = placed.termination;
            let text = format!("the bases of held-out sessions: {reason}");
            Finding::new(FindingCode::HeldOutNotConverged, [reason.as_str().into()], text)
        });
        not_converged = not_converged.or(held_out);
        end.x = placed.x;
    }
    if noise == Noise::Unknown {
        for estimate in &mut estimates {
            estimate.std_error = None;
        }
    }
    Ok((estimates, covariance, not_converged))
}

/// Returns, for each unknown, the pattern of the rule of `[parameters]` that declares its prior;
/// `None` if the unknown has no prior.
fn rules(problem: &Problem, unknowns: &[&Parameter]) -> Vec<Option<String>> {
    let rule = |parameter: &&Parameter| {
        parameter.sigma?;
        let name = &parameter.name;
        let plain = name.find('[').zip(name.find(']'));
        let plain = plain
            .map_or_else(|| name.clone(), |(from, to)| [&name[..from], &name[to + 1..]].concat());
        let is_of = |rule: &&ParameterRule| {
            pattern::matches(&rule.pattern, name) || pattern::matches(&rule.pattern, &plain)
        };
        Some(problem.parameters.iter().rev().find(is_of)?.pattern.clone())
    };
    unknowns.iter().map(rule).collect()
}

/// Creates the finding that a fit ended for a `reason` other than convergence.
fn not_converged_finding(reason: Termination) -> Finding {
    let text = reason.to_string();
    let finding = Finding::new(FindingCode::NotConverged, [reason.as_str().into()], text);
    let remedy = match reason {
        Termination::DomainEdge => "units, signs of joints, sessions, or the columns are wrong",
        _ => "",
    };
    finding.with_remedy(remedy.to_owned())
}

/// Returns the loss that the section `[robust]` declares. Defaults of its threshold and slope are
/// those for the three coordinates of a position.
fn loss(robust: Robust) -> Loss {
    match robust.loss {
        RobustLoss::Huber => {
            Loss::Huber { threshold: robust.threshold.unwrap_or(Loss::HUBER_POSITION) }
        }
        RobustLoss::L1 => Loss::L1 {
            slope: Loss::L1_POSITION,
            smoothing: robust.threshold.unwrap_or(Loss::L1_SMOOTHING),
        },
    }
}
