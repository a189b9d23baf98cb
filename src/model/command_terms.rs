//! Sum of the terms that add to joint coordinates, strains and small motions, and its application
//! to poses.

use super::command_term::{CommandTerm, TermSite};
use super::harmonic_sum::HarmonicSum;
use crate::mechanics::Arm;
use crate::model::parameter::{Parameter, ParameterSite, Regressor, Waves};
use crate::problem::{JointOffsets, PoseView};

/// Sum of the terms that add to joint coordinates, strains and small motions, evaluated for one
/// pose at a time.
#[derive(Debug, Clone, Default)]
pub(super) struct CommandTerms {
    series: Vec<HarmonicSum>,
    /// Terms that are evaluated one by one, because no [`HarmonicSum`] contains them.
    others: Vec<CommandTerm>,
    /// Times of exposures \[s\], which move all joints: index of the camera, true for a time per row of
    /// the image, and the time.
    exposures: Vec<(usize, bool, f64)>,
    configuration: Vec<f64>,
    offsets: Vec<JointOffsets>,
}

impl CommandTerms {
    /// Creates the sum of the fixed terms and of the free parameters of `arm` at the full parameter
    /// vector `x`.
    pub fn new(fixed: &[CommandTerm], arm: &Arm<f64>, parameters: &[Parameter], x: &[f64]) -> Self {
        let mut others = CommandTerm::fixed_and_free(fixed, arm, parameters, x);
        let series = HarmonicSum::take_from(&mut others);
        let exposure = |(parameter, &time): (&Parameter, &f64)| match parameter.site {
            ParameterSite::Exposure { camera, by_row } => Some((camera, by_row, time)),
            _ => None,
        };
        let exposures = parameters.iter().zip(x).filter_map(exposure).collect();
        Self { series, others, exposures, ..Self::default() }
    }

    /// Returns the pose with all terms added to its configuration, strains and motions.
    #[inline]
    pub fn apply<'b>(&'b mut self, setup: &PoseView<'b>) -> PoseView<'b> {
        if self.others.is_empty() && self.series.is_empty() && self.exposures.is_empty() {
            return *setup;
        }
        self.configuration.clear();
        self.configuration.extend_from_slice(setup.configuration);
        self.offsets.clear();
        for &(camera, by_row, time) in &self.exposures {
            for (joint, coordinate) in self.configuration.iter_mut().enumerate() {
                *coordinate += time * Regressor::Exposure { camera, joint, by_row }.value(setup);
            }
        }
        let mut waves = Waves::default();
        let others = self
            .others
            .iter()
            .map(|term| (term.site, term.value * waves.value(&term.regressor, setup)));
        let series = self.series.iter().map(|sum| (sum.site, sum.value(setup.configuration)));
        for (site, added) in others.chain(series) {
            match site {
                TermSite::Joint(joint) => self.configuration[joint] += added,
                TermSite::Strain { joint, which } => {
                    self.offsets.resize(self.configuration.len(), JointOffsets::default());
                    self.offsets[joint].strain[which] += added;
                }
                TermSite::Motion { joint, which } => {
                    self.offsets.resize(self.configuration.len(), JointOffsets::default());
                    self.offsets[joint].motion[which] += added;
                }
            }
        }
        PoseView {
            configuration: &self.configuration,
            offsets: (!self.offsets.is_empty()).then_some(&self.offsets),
            ..*setup
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::Problem;

    #[test]
    fn waves_other_drivers_and_strains_add_up() {
        let text = "name = 'arm'\njoint = [{}, {}]\n[data]\nreference_temperature_C = 20\n";
        let problem = Problem::parse(text, "problem.toml".as_ref()).unwrap();
        let formula = |text: &str| Regressor::parse(text, &problem).unwrap();
        let strain = TermSite::Strain { joint: 1, which: 2 };
        let waves = (1..=20).flat_map(|order| {
            let value = 1e-3 / f64::from(order);
            [
                (TermSite::Joint(0), Regressor::Sine(1, order), value),
                (strain, Regressor::Cosine(0, order), -value),
            ]
        });
        let others = [
            (TermSite::Joint(0), formula("T"), 1e-4),
            (TermSite::Joint(1), formula("q1"), 0.5),
            (TermSite::Strain { joint: 0, which: 0 }, formula("t"), 1e-6),
        ];
        let terms: Vec<CommandTerm> = waves
            .chain(others)
            .map(|(site, regressor, value)| CommandTerm { site, regressor, value })
            .collect();
        let mut commands = CommandTerms::new(&terms, &Arm::nominal(&problem), &[], &[]);
        assert!(commands.series.len() == 2 && commands.others.len() == 3);
        // The two poses show whether strains of one pose remain in the next.
        for configuration in [[0.3, -1.2], [0.9, 0.4]] {
            let pose = PoseView {
                temperature: Some(&31.0),
                elapsed: 7.0,
                ..PoseView::from_configuration(&configuration)
            };
            let (mut joints, mut strains) = (configuration, [[0.0; 3]; 2]);
            for CommandTerm { site, regressor, value } in &terms {
                match *site {
                    TermSite::Joint(joint) => joints[joint] += value * regressor.value(&pose),
                    TermSite::Strain { joint, which } => {
                        strains[joint][which] += value * regressor.value(&pose);
                    }
                    TermSite::Motion { .. } => {}
                }
            }
            let found = commands.apply(&pose);
            let found_strains: Vec<[f64; 3]> =
                found.offsets.unwrap().iter().map(|offsets| offsets.strain).collect();
            let near = |a: &[f64], b: &[f64]| {
                a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-14)
            };
            assert!(
                near(found.configuration, &joints)
                    && near(found_strains.as_flattened(), strains.as_flattened())
            );
        }
    }
}
