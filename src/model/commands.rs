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
        let others = self
            .others
            .iter()
            .map(|own| (own.place, own.value * waves.value(own.regressor, setup)));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::parameter::Regressor;

    #[test]
    fn waves_other_drivers_and_strains_add_up() {
        let strain = Place::Strain { joint: 1, which: 2 };
        let waves = (1..=20).flat_map(|order| {
            let value = 1e-3 / f64::from(order);
            [
                (Place::Joint(0), Regressor::Sine(1, order), value),
                (strain, Regressor::Cosine(0, order), -value),
            ]
        });
        let others = [
            (Place::Joint(0), Regressor::Warming { reference: 20.0 }, 1e-4),
            (Place::Joint(1), Regressor::Command(0), 0.5),
            (Place::Strain { joint: 0, which: 0 }, Regressor::Elapsed, 1e-6),
        ];
        let known: Vec<Driven> = waves
            .chain(others)
            .map(|(place, regressor, value)| Driven { place, regressor, value })
            .collect();
        let mut commands = Commands::new(&known, &[], &[]);
        assert!(commands.series.len() == 2 && commands.others.len() == 3);
        // A pose with strains of the last one would show it.
        for configuration in [[0.3, -1.2], [0.9, 0.4]] {
            let pose = PoseView {
                temperature: Some(&31.0),
                elapsed: 7.0,
                ..PoseView::from_configuration(&configuration)
            };
            let (mut joints, mut strains) = (configuration, [[0.0; 3]; 2]);
            for Driven { place, regressor, value } in &known {
                match *place {
                    Place::Joint(joint) => joints[joint] += value * regressor.value(&pose),
                    Place::Strain { joint, which } => {
                        strains[joint][which] += value * regressor.value(&pose)
                    }
                }
            }
            let found = commands.apply(&pose);
            let near = |a: &[f64], b: &[f64]| {
                a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-14)
            };
            assert!(
                near(found.configuration, &joints)
                    && near(found.strains.unwrap().as_flattened(), strains.as_flattened())
            );
        }
    }
}
