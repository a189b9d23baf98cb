//! Warm start: state that a fit passes on to the next fit of a similar problem.

use nalgebra::DVector;

use crate::fit::stages::noise_model::NoiseModel;
use crate::fit::{Errors, Identification};
use crate::model::{LinearModel, Model};

/// State reused to start the next fit of the same data, or of most of their rows, with other
/// effects. It contains registered parameters, noise model, and the linear model at the optimum.
#[derive(Debug, Clone)]
pub(crate) struct WarmStart {
    /// Deviations of the registered nominal arm by parameter name; parameters without an entry do
    /// not deviate.
    registered: Vec<(String, f64)>,
    /// Errors of the registered nominal arm.
    pub(super) errors: Errors,
    /// Noise models of positions and orientations; `None` if the next fit starts with the declared
    /// σ.
    pub(super) noise: Option<(NoiseModel, NoiseModel)>,
    /// Jacobian at the optimum, if it was computed.
    pub(super) linear_model: Option<LinearModel>,
}

impl WarmStart {
    /// Sets the linear model (Jacobian) at the optimum.
    pub(crate) fn with_linear_model(self, linear_model: Option<LinearModel>) -> Self {
        Self { linear_model, ..self }
    }

    /// Returns the full parameter vector of the registered nominal arm in the model of the next
    /// fit.
    pub(super) fn registered(&self, model: &Model) -> DVector<f64> {
        let deviation = |name: &String| {
            self.registered.iter().find(|(other, _)| other == name).map_or(0.0, |entry| entry.1)
        };
        let deviations = model.parameters.iter().map(|parameter| deviation(&parameter.name));
        DVector::from_iterator(model.parameters.len(), deviations)
    }
}

impl Identification {
    /// Returns the state from which the next fit starts. It contains the noise model only if
    /// `keep_noise` is true.
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
