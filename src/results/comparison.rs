//! Result of the command `compare`: compare.json.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::Serialize;

use super::summary::{Errors, Summary};
use crate::fit::{
    self, Baseline, Comparison, ErrorSummary, Identification, PaperTableEntry, SolverChoice,
};
use crate::model::Ablation;
use crate::problem::Problem;

/// Strategies, solvers and ablations, compared on the same held-out rows.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ComparisonResult {
    pub problem: String,
    /// Errors of the nominal arm, with base and tool fitted if they are free.
    pub registered: Errors,
    /// Results of every strategy with every solver; the paper's procedures last.
    pub rows: Vec<ComparedFit>,
    /// Fits of the joint strategy with parts of the elasticity left out.
    pub ablations: Vec<AblatedFit>,
    /// Results in the form of the tables of Chen et al. (2021).
    pub procedures: Vec<Procedure>,
}

/// Fit of one strategy with one solver, or of one procedure of the paper.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ComparedFit {
    pub strategy: String,
    pub solver: &'static str,
    #[serde(flatten)]
    pub errors: Errors,
    pub iterations: u64,
    /// Evaluations of the residual, with or without derivatives.
    pub evaluations: u64,
    pub seconds: f64,
    pub termination: &'static str,
    pub trusted: bool,
    pub reduced_chi2: Option<f64>,
    pub condition_number: Option<f64>,
}

/// Fit with part of the elasticity left out.
#[derive(Debug, Serialize, JsonSchema)]
pub struct AblatedFit {
    /// Part of the elasticity that is kept.
    pub elasticity: &'static str,
    /// Number of fitted parameters.
    pub parameters: usize,
    #[serde(flatten)]
    pub fit: ComparedFit,
}

/// Tables 2 and 3 and figure 13 of Chen et al. (2021) for one procedure.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Procedure {
    pub procedure: String,
    pub table_2: Vec<JointGeometry>,
    pub table_3: HeldOutErrors,
    pub figure_13: PoseErrors,
}

/// DH parameters of one joint, numbered from 1.
#[derive(Debug, Serialize, JsonSchema)]
pub struct JointGeometry {
    pub joint: usize,
    pub alpha_deg: GeometryValue,
    pub a_mm: GeometryValue,
    pub theta_deg: GeometryValue,
    pub d_mm: GeometryValue,
    pub beta_deg: GeometryValue,
}

/// Nominal and identified value of a DH parameter, in ° or mm as its key states.
#[derive(Debug, Serialize, JsonSchema)]
pub struct GeometryValue {
    pub nominal: f64,
    pub identified: f64,
    pub change: f64,
    /// Identified share, 0 to 1: part of the value that the data determine; null if the value was
    /// not identified.
    pub seen: Option<f64>,
}

/// Errors of the held-out poses, before and after identification.
#[derive(Debug, Serialize, JsonSchema)]
pub struct HeldOutErrors {
    /// True if base and tool of the nominal arm had to be fitted first.
    pub before_registered: bool,
    /// Errors of the nominal rigid arm.
    pub before: Summary,
    pub after: Summary,
    pub ignoring_elasticity: Option<Summary>,
}

/// Error measured − predicted of each held-out pose: x, y, z.
#[derive(Debug, Serialize, JsonSchema)]
pub struct PoseErrors {
    pub before_mm: Vec<[f64; 3]>,
    pub after_mm: Vec<[f64; 3]>,
    pub ignoring_elasticity_mm: Option<Vec<[f64; 3]>>,
}

impl ComparisonResult {
    /// Collects the result of a comparison.
    pub fn new(problem: &Problem, comparison: &Comparison) -> Self {
        let paper = comparison.paper.iter().map(ComparedFit::from);
        let ablation = |(part, found): &(Ablation, Identification)| AblatedFit {
            elasticity: part.as_str(),
            parameters: found.unknowns.len(),
            fit: found.into(),
        };
        let result = |procedure: &fit::Procedure| Procedure::new(&comparison.before, procedure);
        Self {
            problem: problem.name.clone(),
            registered: Errors::of(&comparison.joint.registered),
            rows: comparison.strategies.iter().map(ComparedFit::from).chain(paper).collect(),
            ablations: comparison.ablations.iter().map(ablation).collect(),
            procedures: comparison.procedures.iter().map(result).collect(),
        }
    }
}

impl From<&Identification> for ComparedFit {
    fn from(found: &Identification) -> Self {
        Self {
            strategy: found.strategy.as_str().to_owned(),
            solver: found.solver.as_str(),
            errors: Errors::of(&found.fitted),
            iterations: found.iterations,
            evaluations: found.evaluations,
            seconds: found.seconds,
            termination: found.termination.as_str(),
            trusted: found.is_trusted(),
            reduced_chi2: found.reduced_chi2,
            condition_number: Some(found.identifiability().condition_number()),
        }
    }
}

impl From<&Baseline> for ComparedFit {
    fn from(baseline: &Baseline) -> Self {
        Self {
            strategy: baseline.name(),
            solver: SolverChoice::PseudoInverse.as_str(),
            errors: Errors::of(&baseline.errors),
            iterations: baseline.iterations,
            evaluations: baseline.evaluations,
            seconds: baseline.seconds,
            termination: baseline.termination.as_str(),
            trusted: baseline.termination.converged(),
            reduced_chi2: None,
            condition_number: None,
        }
    }
}

impl Procedure {
    fn new(before: &fit::ErrorsBefore, procedure: &fit::Procedure) -> Self {
        let value = |entry: &PaperTableEntry, to: fn(f64) -> f64| GeometryValue {
            nominal: to(entry.nominal),
            identified: to(entry.identified),
            change: to(entry.identified - entry.nominal),
            seen: entry.seen,
        };
        let deg: fn(f64) -> f64 = f64::to_degrees;
        let mm: fn(f64) -> f64 = |length| length * 1e3;
        let joint =
            |(joint, [alpha, a, theta, d, beta]): &(usize, [PaperTableEntry; 5])| JointGeometry {
                joint: *joint,
                alpha_deg: value(alpha, deg),
                a_mm: value(a, mm),
                theta_deg: value(theta, deg),
                d_mm: value(d, mm),
                beta_deg: value(beta, deg),
            };
        let summary = |errors: &[Vector3<f64>]| Summary::of(&ErrorSummary::of(errors));
        let by_pose = |errors: &[Vector3<f64>]| -> Vec<[f64; 3]> {
            errors.iter().map(|error| (error * 1e3).into()).collect()
        };
        Self {
            procedure: procedure.name(),
            table_2: procedure.geometry.iter().map(joint).collect(),
            table_3: HeldOutErrors {
                before_registered: before.registered,
                before: summary(&before.errors),
                after: summary(&procedure.after),
                ignoring_elasticity: procedure.ignoring.as_deref().map(summary),
            },
            figure_13: PoseErrors {
                before_mm: by_pose(&before.errors),
                after_mm: by_pose(&procedure.after),
                ignoring_elasticity_mm: procedure.ignoring.as_deref().map(by_pose),
            },
        }
    }
}
