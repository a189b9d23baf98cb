//! Identification by the procedure of \[Chen2021\], one row of the comparison of strategies.

use std::time::Instant;

use nalgebra::Vector3;

use crate::fit::compare::procedure::{PaperTableEntry, Procedure, paper_name};
use crate::fit::{ErrorSummary, Errors};
use crate::least_squares::solver::Termination;
use crate::measurement::{Dataset, Measurements};
use crate::paper::{self, EndPoint, Form, Mdh, Measured, StiffnessStage};
use crate::problem::{Joint, Problem};

/// Result of an identification by the paper's closed forms and iteration from the identification
/// rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Baseline {
    /// Form of the paper's misprinted equations: as printed, or corrected.
    pub form: Form,
    /// Source of the stiffness in the procedure.
    pub stage: StiffnessStage,
    /// Table 2 of the paper: α, a, θ, d, β of each joint.
    pub geometry: Vec<[PaperTableEntry; 5]>,
    /// Errors of the identified arm, predicted by the paper's closed forms.
    pub errors: Errors,
    /// Errors measured − predicted of the held-out poses, measuring frame \[m\].
    pub held_out: Vec<Vector3<f64>>,
    /// Number of steps of the iteration of the geometry [Chen2021, eq. 45].
    pub iterations: u64,
    /// Number of evaluations of the residual in the iteration.
    pub evaluations: u64,
    /// Duration of the whole procedure and of its predictions \[s\].
    pub seconds: f64,
    /// Reason why the iteration stopped.
    pub termination: Termination,
}

impl Baseline {
    /// Returns the name by which lists of strategies show the procedure.
    pub fn name(&self) -> String {
        paper_name(self.form, self.stage)
    }

    /// Returns the result in the form of the paper's tables; `rigid` is the result of the procedure
    /// that ignores elasticity, or `None` if the arm is rigid.
    pub(in crate::fit) fn procedure(&self, rigid: Option<&Self>) -> Procedure {
        let ignoring = rigid.map(|rigid| rigid.held_out.clone());
        let paper = Some((self.form, self.stage));
        let geometry = (1..).zip(self.geometry.iter().copied()).collect();
        Procedure { paper, geometry, after: self.held_out.clone(), ignoring }
    }
}

/// Runs every form of the paper's procedure [Chen2021, eq. 1-45] that the identification rows
/// allow. The first ignores elasticity. The others have corrected or printed equations, each with
/// declared stiffness, stiffness from positions, or stiffness from load differences.
///
/// Returns an empty list if the procedure does not apply. The procedure needs one session and
/// target, one chain of joints in DH form without mimic joints, and at least as many equations as
/// geometric parameters. For an arm without elasticity, the list has the rigid form alone.
pub(in crate::fit) fn baselines(problem: &Problem, data: &Dataset) -> Vec<Baseline> {
    let Dataset { measurements, .. } = data;
    let is_unsupported = |joint: &Joint| joint.placement.is_some() || joint.mimic.is_some();
    let is_one =
        measurements.session.names.len() < 2 && measurements.target.is_none() && problem.is_chain();
    if !is_one || problem.joints.iter().any(is_unsupported) {
        return Vec::new();
    }
    let rigid = (Form::Corrected, StiffnessStage::Rigid);
    let elastic = [Form::Corrected, Form::Printed].into_iter().flat_map(|form| {
        let stages =
            StiffnessStage::EACH.into_iter().filter(|&stage| stage != StiffnessStage::Rigid);
        stages.map(move |stage| (form, stage))
    });
    let elastic = elastic.filter(|_| problem.is_elastic());
    std::iter::once(rigid)
        .chain(elastic)
        .filter_map(|(form, stage)| baseline(problem, data, form, stage))
        .collect()
}

/// Returns `rows` as measured poses for the paper's procedure.
fn poses<'a>(data: &'a Measurements, rows: &[usize]) -> Vec<Measured<'a>> {
    let starts = data.session_starts();
    rows.iter()
        .map(|&row| Measured { setup: data.setup(row, &starts), position: data.positions[row] })
        .collect()
}

/// Runs one form of the paper's procedure; `None` if the identification rows do not allow it.
fn baseline(
    problem: &Problem,
    data: &Dataset,
    form: Form,
    stage: StiffnessStage,
) -> Option<Baseline> {
    let Dataset { measurements, split } = data;
    let clock = Instant::now();
    let options = paper::Options::new(form, stage);
    let found =
        paper::identify(problem, &poses(measurements, &split.identification), &options).ok()?;
    let errors = |rows: &[usize]| -> Vec<Vector3<f64>> {
        let error = |pose: &Measured| {
            let end = EndPoint::new(problem, &found.parameters, &pose.setup, &options.reading);
            pose.position - end.position(&found.parameters)
        };
        poses(measurements, rows).iter().map(error).collect()
    };
    let held_out = errors(&split.held_out);
    let joints = problem.joints.iter().zip(&found.parameters.geometry).enumerate();
    let geometry = joints.map(|(joint, (declared, identified))| {
        let (mut nominal, mut identified) = (Mdh::nominal(declared), *identified);
        let (nominal, identified) =
            (nominal.fields_mut().map(|v| *v), identified.fields_mut().map(|v| *v));
        std::array::from_fn(|field| PaperTableEntry {
            nominal: nominal[field],
            identified: identified[field],
            seen: Some(found.identified_share[5 * joint + field]),
        })
    });
    Some(Baseline {
        form,
        stage,
        geometry: geometry.collect(),
        errors: Errors {
            identification: ErrorSummary::of(&errors(&split.identification)),
            held_out: ErrorSummary::of(&held_out),
            is_left_out: false,
        },
        held_out,
        iterations: found.iteration.iterations,
        evaluations: found.iteration.evaluations(),
        seconds: clock.elapsed().as_secs_f64(),
        termination: found.iteration.termination,
    })
}
