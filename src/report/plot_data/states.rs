//! States of the arm on its way from nominal to best, and their errors pose by pose.

use nalgebra::{DVector, Vector3};

use super::model_of;
use crate::identify::{Identification, IdentifyError, Placement};
use crate::measurement::{Dataset, Measurements, Split};
use crate::model::Model;
use crate::problem::Problem;

/// What has been done for the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stand {
    /// Nothing but to find where base and target are, where these are free.
    Registered,
    /// Geometry identified, elasticity left out of the model.
    GeometryOnly,
    /// Geometry and elasticity identified.
    Elastic,
    /// Identified, where there is nothing to say on elasticity.
    Identified,
    /// Identified with the effects that the loop found.
    Closed,
}

/// The errors of one state.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Which.
    pub stand: Stand,
    /// Errors measured − predicted of the held-out poses, measuring frame [m].
    pub errors: Vec<Vector3<f64>>,
}

/// An arm that predicts.
#[derive(Debug, Clone)]
pub(super) struct Arm {
    pub model: Model,
    /// Full parameter vector.
    pub x: DVector<f64>,
}

impl Arm {
    /// As identified.
    pub fn of(problem: &Problem, sight: &Sight, found: &Identification) -> Result<Self, IdentifyError> {
        Ok(Self { model: model_of(problem, &sight.placement)?, x: found.x.clone() })
    }
}

/// The measurements that a picture is made from.
pub(super) struct Sight<'a> {
    pub measurements: &'a Measurements,
    pub split: &'a Split,
    pub placement: Placement,
}

impl<'a> Sight<'a> {
    pub fn new(data: &'a Dataset) -> Self {
        let Dataset { measurements, split } = data;
        Self { measurements, split, placement: Placement::of(measurements) }
    }

    /// Residuals of some rows, measuring frame [m].
    pub fn errors(&self, arm: &Arm, rows: &[usize]) -> Vec<Vector3<f64>> {
        self.placement.position_errors(&arm.model, &arm.x, self.measurements, rows)
    }

    /// Errors of an arm on the held-out poses.
    pub fn state(&self, stand: Stand, arm: &Arm) -> State {
        State { stand, errors: self.errors(arm, &self.split.held_out) }
    }

    /// The nominal arm, with bases and targets fitted where they are free.
    pub fn registered(&self, fitted: &Arm, found: &Identification) -> State {
        self.state(Stand::Registered, &Arm { model: fitted.model.clone(), x: found.registered_x.clone() })
    }
}

/// Whether stiffnesses or rigidities are free.
pub(super) fn is_elastic(model: &Model) -> bool {
    model.parameters.iter().any(|parameter| parameter.slot.is_elastic())
}
