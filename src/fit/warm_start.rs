//! What a fit leaves to the next one, of the same problem with other effects to the same data, or
//! to most of their rows.

use nalgebra::DVector;

use crate::fit::stages::noise_model::NoiseModel;
use crate::fit::{Errors, Identification};
use crate::model::{LinearModel, Model};

/// What the next fit need not find anew.
#[derive(Debug, Clone)]
pub(crate) struct WarmStart {
    /// Deviations from nominal of the registered nominal arm, by name: what is not among them has
    /// none there.
    registered: Vec<(String, f64)>,
    /// The errors of that arm.
    pub(super) errors: Errors,
    /// What the fit made of the σ of positions, and of orientations; `None` where the next one
    /// begins with them as declared.
    pub(super) noise: Option<(NoiseModel, NoiseModel)>,
    /// Derivatives where it ended, if somebody took them.
    pub(super) derivatives: Option<LinearModel>,
}

impl WarmStart {
    /// The same with derivatives where it ended.
    pub(crate) fn with_derivatives(self, derivatives: Option<LinearModel>) -> Self {
        Self { derivatives, ..self }
    }

    /// The full parameter vector of the registered nominal arm in a model of its successor.
    pub(super) fn registered(&self, model: &Model) -> DVector<f64> {
        let deviation = |name: &String| {
            self.registered.iter().find(|(known, _)| known == name).map_or(0.0, |found| found.1)
        };
        let own = model.parameters.iter().map(|parameter| deviation(&parameter.name));
        DVector::from_iterator(model.parameters.len(), own)
    }
}

impl Identification {
    /// What it leaves to the next fit, of a problem with other effects to the same data: what it
    /// made of the σ only if that is `alike`.
    pub(crate) fn predecessor(&self, alike: bool) -> WarmStart {
        let names = self.estimates.iter().map(|estimate| estimate.name.clone());
        let placed =
            names.zip(self.registered_x.iter().copied()).filter(|(_, deviation)| *deviation != 0.0);
        let noise = alike.then_some(self.noise_models);
        WarmStart {
            registered: placed.collect(),
            errors: self.registered,
            noise,
            derivatives: None,
        }
    }
}
