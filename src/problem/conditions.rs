//! Under which conditions a pose is measured, and from which ranges poses are drawn.

use super::past::{Past, PastOf};
use super::{Effect, Problem};

/// What the controller and the test bench set for one pose.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PoseConditions {
    /// Configuration q, shape = (joints) \[rad\] or \[m\]; fixed joints ignore theirs.
    pub configuration: Vec<f64>,
    /// Payload \[kg\]; `None`: as the problem declares.
    pub payload: Option<f64>,
    /// Hoist force \[N\]; `None`: as the problem declares.
    pub hoist: Option<f64>,
    /// Temperature [°C]; `None`: the reference.
    pub temperature: Option<f64>,
    /// Time \[s\].
    pub time: f64,
    /// Time since the first pose \[s\].
    pub elapsed: f64,
    /// Direction from which each joint came, shape = (joints), −1, 0 or +1; `None`: not known.
    pub approach: Option<Vec<f64>>,
    /// Values of the problem's own covariates, in their order and units; empty: not known.
    pub covariates: Vec<f64>,
    /// What was before.
    pub past: Past,
}

/// The same of a pose whose numbers are kept elsewhere, in a table for instance: fits hold one for
/// each pose.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PoseView<'a> {
    /// Configuration q, shape = (joints) \[rad\] or \[m\]; fixed joints ignore theirs.
    pub configuration: &'a [f64],
    /// Payload \[kg\]; `None`: as the problem declares.
    pub payload: Option<&'a f64>,
    /// Hoist force \[N\]; `None`: as the problem declares.
    pub hoist: Option<&'a f64>,
    /// Temperature [°C]; `None`: the reference.
    pub temperature: Option<&'a f64>,
    /// Time \[s\].
    pub time: f64,
    /// Time since the first pose \[s\].
    pub elapsed: f64,
    /// Direction from which each joint came, shape = (joints), −1, 0 or +1; `None`: not known.
    pub approach: Option<&'a [f64]>,
    /// Values of the problem's own covariates, in their order and units; empty: not known.
    pub covariates: &'a [f64],
    /// What was before.
    pub past: PastOf<'a>,
    /// Strain of the beam of each joint without load, shape = (joints): elongation, then curvatures
    /// about y and z [1/m]; `None`: none. Most poses have none: a thin reference keeps them small.
    pub strains: Option<&'a Vec<[f64; 3]>>,
}

impl<'a> PoseView<'a> {
    /// A configuration, shape = (joints) \[rad\] or \[m\], of which nothing else is known.
    pub fn of(configuration: &'a [f64]) -> Self {
        Self { configuration, ..Self::default() }
    }
}

impl PoseView<'_> {
    /// The same with numbers of its own, without strains.
    pub fn to_owned(&self) -> PoseConditions {
        PoseConditions {
            configuration: self.configuration.to_vec(),
            payload: self.payload.copied(),
            hoist: self.hoist.copied(),
            temperature: self.temperature.copied(),
            time: self.time,
            elapsed: self.elapsed,
            approach: self.approach.map(<[f64]>::to_vec),
            covariates: self.covariates.to_vec(),
            past: self.past.read().to_owned(),
        }
    }
}

impl PoseConditions {
    /// Enters the pose into the past of the next one. Temperatures and sides are those of all poses
    /// or of none.
    pub(crate) fn enter(&self, past: &mut Past) {
        past.times.push(self.time);
        past.temperatures.extend(self.temperature);
        past.configurations.extend(&self.configuration);
        past.approaches.extend(self.approach.iter().flatten());
    }

    /// The same for who only reads them.
    pub fn view(&self) -> PoseView<'_> {
        PoseView {
            configuration: &self.configuration,
            payload: self.payload.as_ref(),
            hoist: self.hoist.as_ref(),
            temperature: self.temperature.as_ref(),
            time: self.time,
            elapsed: self.elapsed,
            approach: self.approach.as_deref(),
            covariates: &self.covariates,
            past: PastOf::from(&self.past),
            strains: None,
        }
    }
}

/// From where poses are drawn: ranges evenly, each quantity by itself.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PoseRanges {
    /// Range of each joint, shape = (joints) \[rad\] or \[m\]; not used at fixed joints.
    pub joints: Vec<(f64, f64)>,
    /// Payloads to choose from \[kg\]; empty: as the problem declares.
    pub payloads: Vec<f64>,
    /// Range of the hoist's force \[N\]; `None`: as the problem declares.
    pub hoist: Option<(f64, f64)>,
    /// Range of the temperature [°C]; `None`: not known.
    pub temperature: Option<(f64, f64)>,
    /// Whether each joint comes from a side that is chosen; otherwise nobody knows from where.
    pub approach: bool,
    /// Range of each of the problem's own covariates, in its unit; empty: not known.
    pub covariates: Vec<(f64, f64)>,
}

impl PoseRanges {
    /// The same without temperatures, sides and covariates on which no declared effect depends:
    /// they need not be set.
    #[must_use]
    pub fn that_matter(self, problem: &Problem) -> Self {
        let declared =
            |matters: fn(&Effect) -> bool| problem.effects.iter().any(|own| matters(&own.effect));
        let (thermal, sided) = (declared(Effect::is_thermal), declared(Effect::has_sides));
        let covariates = if declared(|effect| effect.covariate().is_some()) {
            self.covariates
        } else {
            Vec::new()
        };
        Self {
            temperature: self.temperature.filter(|_| thermal),
            approach: self.approach && sided,
            covariates,
            ..self
        }
    }
}
