//! The paper's own procedure on the problem at hand, as a row to compare with.

use std::time::Instant;

use nalgebra::Vector3;

use super::{ErrorSummary, Errors};
use crate::least_squares::solver::Termination;
use crate::measurement::Dataset;
use crate::paper::{self, EndPoint, Form, Measured};
use crate::problem::{PoseView, Problem};

/// What the paper's closed forms and its iteration make of the data.
#[derive(Debug, Clone, PartialEq)]
pub struct Baseline {
    /// As printed, or without the misprints.
    pub form: Form,
    /// Errors of the identified arm, predicted by the same closed forms.
    pub errors: Errors,
    /// Steps of the iteration of eq. 45.
    pub iterations: u64,
    /// Evaluations of its residual.
    pub evaluations: u64,
    /// Time taken \[s\].
    pub seconds: f64,
    /// Why the iteration stopped.
    pub termination: Termination,
}

impl Baseline {
    /// Name beside the strategies.
    pub fn strategy(&self) -> &'static str {
        match self.form {
            Form::Corrected => "paper",
            Form::Printed => "paper-as-printed",
        }
    }
}

/// Stiffness, then geometry, in one sweep, from the identification rows [Chen2021, eq. 1-45].
///
/// `None` where the procedure does not apply: it knows base and target, so that there are no sessions or targets, and it
/// needs as many equations as it has geometric parameters.
pub(super) fn baseline(problem: &Problem, data: &Dataset, form: Form) -> Option<Baseline> {
    let Dataset { measurements: data, split } = data;
    if data.session.names.len() > 1 || data.target.is_some() {
        return None;
    }
    let clock = Instant::now();
    let poses = |rows: &[usize]| -> Vec<Measured> {
        let value = |column: &Option<Vec<f64>>, row: usize| column.as_ref().map(|values| values[row]);
        rows.iter()
            .map(|&row| Measured {
                setup: PoseView {
                    configuration: data.configuration(row),
                    payload: value(&data.payload, row),
                    hoist: value(&data.hoist, row),
                    ..PoseView::default()
                },
                position: data.positions[row],
            })
            .collect()
    };
    let options = paper::Options::from(form);
    let found = paper::identify(problem, &poses(&split.identification), &options).ok()?;
    let summary = |rows: &[usize]| {
        let errors: Vec<Vector3<f64>> = poses(rows)
            .iter()
            .map(|pose| {
                let end = EndPoint::new(problem, &found.parameters, &pose.setup, &options.reading);
                pose.position - end.position(&found.parameters)
            })
            .collect();
        ErrorSummary::of(&errors)
    };
    Some(Baseline {
        form,
        errors: Errors { identification: summary(&split.identification), held_out: summary(&split.held_out) },
        iterations: found.iteration.iterations,
        evaluations: found.iteration.evaluations(),
        seconds: clock.elapsed().as_secs_f64(),
        termination: found.iteration.termination,
    })
}
