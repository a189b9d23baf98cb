//! Warm start: state that a fit passes on to the next fit of a similar problem.

use nalgebra::DVector;

use crate::fit::stages::noise_model::NoiseModel;
use crate::fit::{Errors, Identification};
use crate::model::{LinearModel, Model};

/// State of a fit from which the next fit starts: registered parameters, noise models, and the
/// linear model at the optimum. The next fit is of the same data, or of most of their rows, with
/// other effects.
#[derive(Debug, Clone)]
pub(crate) struct WarmStart {
    /// Names and deviations from nominal of the parameters that registration changed, mostly those
    /// of bases and targets; all other deviations are 0.
    registered: Vec<(String, f64)>,
    /// Errors of the registered nominal arm.
    pub(super) errors: Errors,
    /// Noise models of positions and of orientations with which the next fit starts; `None` if it
    /// starts with the declared σ.
    pub(super) noise: Option<(NoiseModel, NoiseModel)>,
    /// Jacobian and residual at the optimum of the fit; `None` if they were not computed.
    pub(super) linear_model: Option<LinearModel>,
}

impl WarmStart {
    /// Returns the state with this linear model (Jacobian and residual at the optimum).
    pub(crate) fn with_linear_model(self, linear_model: Option<LinearModel>) -> Self {
        Self { linear_model, ..self }
    }

    /// Returns the full parameter vector of the registered nominal arm in `model`, the model of the
    /// next fit.
    pub(super) fn registered(&self, model: &Model) -> DVector<f64> {
        let deviation = |name: &String| {
            self.registered.iter().find(|(other, _)| other == name).map_or(0.0, |entry| entry.1)
        };
        let deviations = model.parameters.iter().map(|parameter| deviation(&parameter.name));
        DVector::from_iterator(model.parameters.len(), deviations)
    }
}

impl Identification {
    /// Returns the state from which the next fit starts, without a linear model. It contains the
    /// noise models that this fit assumed only if `keep_noise` is true.
    pub(crate) fn warm_start(&self, keep_noise: bool) -> WarmStart {
        let names = self.estimates.iter().map(|estimate| estimate.name.clone());
        let deviations = names.zip(self.registered_x.iter().copied());
        WarmStart {
            registered: deviations.filter(|(_, deviation)| *deviation != 0.0).collect(),
            errors: self.registered,
            noise: keep_noise.then_some(self.noise_models),
            linear_model: None,
        }
    }
}
