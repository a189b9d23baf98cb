//! Poses as joints and beams take them, with all that adds to their commands.

use super::driven::{Driven, Place};
use super::series::Series;
use crate::model::parameter::{Parameter, Waves};
use crate::problem::PoseView;

/// Poses with what drives them added, one at a time.
#[derive(Debug, Clone, Default)]
pub(super) struct Commands {
    series: Vec<Series>,
    /// What is in none of these.
    others: Vec<Driven>,
    configuration: Vec<f64>,
    strains: Vec<[f64; 3]>,
}

impl Commands {
    /// Of what is known to drive and the free parameters at the full parameter vector `x`.
    pub fn new(known: &[Driven], parameters: &[Parameter], x: &[f64]) -> Self {
        let mut others = Driven::all(known, parameters, x);
        let series = Series::take(&mut others);
        Self { series, others, ..Self::default() }
    }

    /// The pose as the joints and beams take it.
    #[inline]
    pub fn apply<'b>(&'b mut self, setup: &PoseView<'b>) -> PoseView<'b> {
        if self.others.is_empty() && self.series.is_empty() {
            return *setup;
        }
        self.configuration.clear();
        self.configuration.extend_from_slice(setup.configuration);
        self.strains.clear();
        let mut waves = Waves::default();
        let others = self.others.iter().map(|own| (own.place, own.value * waves.value(own.driver, setup)));
        let series = self.series.iter().map(|own| (own.place, own.value(setup.configuration)));
        for (place, added) in others.chain(series) {
            match place {
                Place::Joint(joint) => self.configuration[joint] += added,
                Place::Strain { joint, which } => {
                    self.strains.resize(self.configuration.len(), [0.0; 3]);
                    self.strains[joint][which] += added;
                }
            }
        }
        PoseView {
            configuration: &self.configuration,
            strains: (!self.strains.is_empty()).then_some(&self.strains),
            ..*setup
        }
    }
}
