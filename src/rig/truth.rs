//! Truth of a simulation, as plain data in SI units.

use std::collections::BTreeMap;

use super::effect::TrueEffect;
use crate::observation::{Observation, kinds};
use crate::problem::{Fixture, PoseRanges};
use crate::quantity::Unit;

/// Description of a true arm (`TRUTH.toml`): how it differs from the declared one, and the poses in
/// which it is measured.
#[derive(Debug, Clone)]
pub struct Truth {
    /// True values that the file states, `[parameters]`.
    #[doc(hidden)]
    pub parameters: Vec<Deviation>,
    /// Rules for random true values, `[random]`. A stated value takes precedence over them, and a
    /// later rule over an earlier one.
    #[doc(hidden)]
    pub random: Vec<RandomRule>,
    /// Effects on the true arm, `[[effect]]`.
    #[doc(hidden)]
    pub effects: Vec<TrueEffect>,
    /// Standard deviation of the noise of a measured coordinate \[m\].
    pub noise_sigma: f64,
    /// Standard deviations of the noise of other kinds of rows, by the name of the kind: \[m\],
    /// \[rad\] or pixels.
    pub kind_sigmas: BTreeMap<&'static str, f64>,
    /// Number of rows at the start that measure positions; the rows after them measure fixtures,
    /// tilts and images in turn, if there are any.
    pub positions: usize,
    /// Frames whose tilts are measured in turn, after the fixtures: 0 is the base of the arm, i the
    /// frame of joint i.
    pub tilts: Vec<usize>,
    /// Standard deviation of a measured orientation about each axis \[rad\], if orientations are
    /// measured.
    pub orientation_sigma: Option<f64>,
    /// Ranges of the poses, `[poses]`. A payload, hoist force or temperature without a range has no
    /// column in the measurements.
    pub poses: PoseRanges,
    /// Range of the time between poses \[s\], `[poses]`.
    pub time_step: (f64, f64),
    /// Selection of held-out rows, `[poses]`.
    #[doc(hidden)]
    pub held_out: HeldOutRows,
    /// Number of segments per beam.
    pub segments: usize,
}

/// True value of one parameter, as a deviation.
#[derive(Debug, Clone, PartialEq)]
pub struct Deviation {
    /// Name as in the problem file, for example `joint2.alpha`.
    pub name: String,
    /// Deviation from the nominal value: difference \[rad\] or \[m\], or factor for a stiffness or
    /// rigidity.
    pub value: f64,
}

/// Standard deviations of the parameters that a pattern matches.
#[derive(Debug, Clone, PartialEq)]
pub struct RandomRule {
    /// Name pattern in which `*` matches any run of characters.
    pub pattern: String,
    /// Standard deviation of angles \[rad\].
    pub angle: Option<f64>,
    /// Standard deviation of lengths \[m\].
    pub length: Option<f64>,
    /// Standard deviation of ln(value / nominal) for stiffnesses and rigidities.
    pub relative: Option<f64>,
}

/// Rule for the number of held-out rows, which are chosen at random.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum HeldOutRows {
    /// Share of the rows, rounded to at least one row and fewer than all.
    Share(f64),
    /// Number of rows that are not held out; all others are.
    AllBut(usize),
}

/// Largest usual noise of a measured position \[m\].
const MAX_USUAL_NOISE: f64 = 0.01;

impl Truth {
    /// Returns a warning if the noise of positions is so large that it is probably in millimetres under
    /// a key in metres.
    pub(crate) fn large_noise(&self) -> Option<String> {
        (self.noise_sigma > MAX_USUAL_NOISE).then(|| {
            format!(
                "noise of {} mm a coordinate is large for an instrument; if {sigma} mm are meant, write \
                 position_sigma_mm = {sigma}",
                self.noise_sigma * 1e3,
                sigma = self.noise_sigma
            )
        })
    }

    /// Returns true if an effect depends on earlier poses.
    pub(super) fn has_memory(&self) -> bool {
        self.effects
            .iter()
            .filter_map(TrueEffect::catalogued)
            .any(|(effect, _)| effect.has_memory())
    }

    /// Returns the quantity that each of `rows` rows measures: positions first, then fixtures,
    /// tilted frames and images in turn. Without them, all rows measure positions.
    pub(super) fn observations(&self, fixtures: &[Fixture], rows: usize) -> Vec<Observation> {
        let round = self.measured_in_turn(fixtures);
        let of_row = |row: usize| match row.checked_sub(self.positions) {
            Some(number) if !round.is_empty() => round[number % round.len()],
            _ => Observation::Position,
        };
        (0..rows).map(of_row).collect()
    }

    /// Returns what the rows after the positions measure in turn: fixtures, tilted frames and
    /// images. One entry, the first point of the first camera and marker, represents all images of
    /// a pose.
    fn measured_in_turn(&self, fixtures: &[Fixture]) -> Vec<Observation> {
        let observation = |(index, fixture): (usize, &Fixture)| {
            let mut kinds = kinds().filter(|kind| kind.references().count() == 1);
            let kind = kinds.find(|kind| kind.field(fixture.kind.word()).is_some())?;
            Observation::new(kind, &[index])
        };
        let touched = fixtures.iter().enumerate().filter_map(observation);
        let first = |word: &str| {
            let place = fixtures.iter().position(|fixture| fixture.kind.word() == word)?;
            u32::try_from(place).ok()
        };
        let images = first("camera").zip(first("marker"));
        let images = images.map(|(camera, marker)| Observation::Pixel(camera, marker, 0));
        touched
            .chain(self.tilts.iter().map(|&frame| Observation::Tilt(frame)))
            .chain(images)
            .collect()
    }

    /// Returns the number of successive rows with one target. With fixtures, there is one row for
    /// each fixture and tilted frame, so that each target is measured against all of them.
    /// Otherwise there is one row.
    pub(super) fn rows_per_target(&self, fixtures: &[Fixture]) -> usize {
        if fixtures.is_empty() { 1 } else { self.measured_in_turn(fixtures).len().max(1) }
    }

    /// Returns the standard deviation of the noise of a measurement \[m\]; \[rad\] for a tilt.
    pub(super) fn sigma_of(&self, observation: Observation) -> f64 {
        self.kind_sigmas.get(observation.kind()).copied().unwrap_or(self.noise_sigma)
    }

    /// Returns the truth with `sigma` \[m\] as standard deviation of the noise of all positions,
    /// contacts and distances.
    pub(crate) fn with_noise(&self, sigma: f64) -> Self {
        let mut truth = Self { noise_sigma: sigma, ..self.clone() };
        for kind in kinds().filter(|kind| kind.unit == Unit::Length) {
            truth.kind_sigmas.remove(kind.name);
        }
        truth
    }
}

impl RandomRule {
    /// Returns the standard deviation that the rule gives a parameter with this unit; `None` if it
    /// gives none.
    pub(super) fn sigma(&self, unit: Unit) -> Option<f64> {
        match unit {
            Unit::Angle => self.angle,
            Unit::Length => self.length,
            _ => self.relative,
        }
    }
}

impl HeldOutRows {
    /// Returns the number of held-out rows among `rows` rows.
    pub(super) fn count(self, rows: usize) -> usize {
        match self {
            Self::AllBut(kept) => rows.saturating_sub(kept),
            Self::Share(share) if share > 0.0 && rows > 1 => {
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "a part of a count"
                )]
                let count = (share * rows as f64).round() as usize;
                count.clamp(1, rows - 1)
            }
            Self::Share(_) => 0,
        }
    }
}
