//! Conditions under which poses are measured, and the ranges from which poses are drawn.

use super::past::{LazyPast, Past};
use super::{Effect, Problem};

/// Configuration and test conditions of one pose.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PoseConditions {
    /// Configuration q, shape = (joints) \[rad\] or \[m\]; values of fixed joints are ignored.
    pub configuration: Vec<f64>,
    /// Payload \[kg\]; `None` for the payload that the problem declares.
    pub payload: Option<f64>,
    /// Hoist force \[N\]; `None` for the force that the problem declares.
    pub hoist: Option<f64>,
    /// Temperature [°C]; `None` for the reference temperature.
    pub temperature: Option<f64>,
    /// Time of the measurement \[s\].
    pub time: f64,
    /// Time since the first pose \[s\].
    pub elapsed: f64,
    /// Direction from which each joint approached, shape = (joints), −1, 0 or +1; `None` if
    /// unknown.
    pub approach: Option<Vec<f64>>,
    /// Values of the declared covariates in their order and units; empty if unknown.
    pub covariates: Vec<f64>,
    /// Earlier poses of the session.
    pub past: Past,
}

/// Borrowed form of [`PoseConditions`]. Its numbers are stored elsewhere, for example in the
/// columns of a table; a fit holds one view per pose.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PoseView<'a> {
    /// Configuration q, shape = (joints) \[rad\] or \[m\]; values of fixed joints are ignored.
    pub configuration: &'a [f64],
    /// Payload \[kg\]; `None` for the payload that the problem declares.
    pub payload: Option<&'a f64>,
    /// Hoist force \[N\]; `None` for the force that the problem declares.
    pub hoist: Option<&'a f64>,
    /// Temperature [°C]; `None` for the reference temperature.
    pub temperature: Option<&'a f64>,
    /// Time of the measurement \[s\].
    pub time: f64,
    /// Time since the first pose \[s\].
    pub elapsed: f64,
    /// Direction from which each joint approached, shape = (joints), −1, 0 or +1; `None` if
    /// unknown.
    pub approach: Option<&'a [f64]>,
    /// Values of the declared covariates in their order and units; empty if unknown.
    pub covariates: &'a [f64],
    /// Earlier poses of the session.
    pub past: LazyPast<'a>,
    /// Strains and small motions of each joint, shape = (joints); `None` for none. A thin reference
    /// keeps the views small, because most poses have none.
    pub offsets: Option<&'a Vec<JointOffsets>>,
}

/// Offsets that effects add to a joint in one pose besides its coordinate: strains and small
/// motions.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointOffsets {
    /// Stress-free strain of the joint's beam: elongation, then curvatures about y and z [1/m].
    pub strain: [f64; 3],
    /// Small motion before the joint turns, then behind it: translation \[m\] and rotation vector
    /// \[rad\] each.
    pub motion: [f64; 12],
}

impl<'a> PoseView<'a> {
    /// Returns a view of a configuration, shape = (joints) \[rad\] or \[m\], without any other
    /// condition.
    pub fn from_configuration(configuration: &'a [f64]) -> Self {
        Self { configuration, ..Self::default() }
    }
}

impl PoseView<'_> {
    /// Returns the small motions of a joint with index `joint`; `None` if effects add no offsets in
    /// this pose.
    #[inline]
    pub(crate) fn motion(&self, joint: usize) -> Option<&[f64; 12]> {
        Some(&self.offsets?.get(joint)?.motion)
    }

    /// Returns a copy that owns its numbers; strains and motions are left out.
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
    /// Appends this pose to `past`, the earlier poses of the next one. Either all poses of a past
    /// have a temperature or none has; the same holds for approach directions.
    pub(crate) fn append_to(&self, past: &mut Past) {
        past.times.push(self.time);
        past.temperatures.extend(self.temperature);
        past.configurations.extend(&self.configuration);
        past.approaches.extend(self.approach.iter().flatten());
    }

    /// Returns a view that borrows these conditions.
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
            past: LazyPast::from(&self.past),
            offsets: None,
        }
    }
}

/// Ranges of configurations and conditions from which poses are drawn uniformly and independently.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PoseRanges {
    /// Range of each joint, shape = (joints) \[rad\] or \[m\]; ranges of fixed joints are ignored.
    pub joints: Vec<(f64, f64)>,
    /// Payloads to choose from \[kg\]; empty for the payload that the problem declares.
    pub payloads: Vec<f64>,
    /// Range of the hoist force \[N\]; `None` for the force that the problem declares.
    pub hoist: Option<(f64, f64)>,
    /// Range of the temperature [°C]; `None` if unknown.
    pub temperature: Option<(f64, f64)>,
    /// True if an approach direction is drawn for each joint; otherwise directions are unknown.
    pub approach: bool,
    /// Range of each declared covariate in its unit; empty if unknown.
    pub covariates: Vec<(f64, f64)>,
}

impl PoseRanges {
    /// Returns these ranges without the temperatures, approach directions and covariates on which
    /// no declared effect depends, because these conditions need not be varied.
    #[must_use]
    #[doc(hidden)]
    pub fn relevant_to(self, problem: &Problem) -> Self {
        let declared = |matters: fn(&Effect) -> bool| {
            problem.effects.iter().any(|declared| matters(&declared.effect))
        };
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
