//! What is true on the test bench, as plain data in SI units.

use super::effect::TrueEffect;
use crate::problem::{Fixture, FixtureKind, Observation, PoseRanges};
use crate::quantity::Unit;

/// How the true arm differs from the declared one, and in which poses it is measured: `TRUTH.toml`.
#[derive(Debug, Clone)]
pub struct Truth {
    /// `[parameters]`: true values that are given.
    pub parameters: Vec<Deviation>,
    /// `[random]`: true values that are drawn, except where they are given; a later rule wins.
    pub random: Vec<RandomRule>,
    /// `[[effect]]`: what is at work besides.
    pub effects: Vec<TrueEffect>,
    /// 1 σ of a measured coordinate \[m\].
    pub noise_sigma: f64,
    /// The same of a contact with a point, of a measured distance, and of a contact with a surface
    /// \[m\].
    pub contact_sigmas: [f64; 3],
    /// How many rows measure positions, the first ones, where there are points, anchors or surfaces
    /// to measure against.
    pub positions: usize,
    /// Frames whose tilts are measured, one after the other behind the fixtures: 0 is the arm's
    /// base, i that of joint i.
    pub tilts: Vec<usize>,
    /// 1 σ of a measured tilt \[rad\].
    pub tilt_sigma: f64,
    /// 1 σ of a measured orientation about each axis, where orientations are measured \[rad\].
    pub orientation_sigma: Option<f64>,
    /// `[poses]`: ranges; where there is no payload, hoist or temperature there is no column.
    pub poses: PoseRanges,
    /// `[poses]`: range of the time from one pose to the next \[s\].
    pub time_step: (f64, f64),
    /// `[poses]`: which rows are held out.
    pub held_out: HeldOutRows,
    /// Segments per beam.
    pub segments: usize,
}

/// The true value of one parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Deviation {
    /// Name as in the problem file: `joint2.alpha`.
    pub name: String,
    /// Added to the nominal value \[rad\] or \[m\]; multiple of the nominal for a stiffness or
    /// rigidity.
    pub value: f64,
}

/// A spread for the parameters that a pattern matches.
#[derive(Debug, Clone, PartialEq)]
pub struct RandomRule {
    /// Name with `*` for any run of characters.
    pub pattern: String,
    /// 1 σ of angles \[rad\].
    pub angle: Option<f64>,
    /// 1 σ of lengths \[m\].
    pub length: Option<f64>,
    /// 1 σ of ln(value / nominal) of stiffnesses and rigidities.
    pub relative: Option<f64>,
}

/// How many rows are held out, chosen at random.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum HeldOutRows {
    /// This part of them; at least one, and never all.
    Share(f64),
    /// All but this many.
    AllBut(usize),
}

impl Truth {
    /// Whether something depends on the poses before.
    pub(super) fn has_memory(&self) -> bool {
        self.effects.iter().filter_map(TrueEffect::parts).any(|(effect, _)| effect.has_memory())
    }

    /// What rows measure: first the positions, then one fixture or tilted frame after the other;
    /// positions alone where there are none.
    pub(super) fn observations(&self, fixtures: &[Fixture], rows: usize) -> Vec<Observation> {
        let of = |(index, kind): (usize, FixtureKind)| match kind {
            FixtureKind::Point => Observation::Point(index),
            FixtureKind::Anchor => Observation::Distance(index),
            FixtureKind::Plane | FixtureKind::Sphere => Observation::Surface(index),
        };
        let fixtures = fixtures.iter().map(|own| own.kind).enumerate().map(of);
        let all: Vec<Observation> =
            fixtures.chain(self.tilts.iter().map(|&frame| Observation::Tilt(frame))).collect();
        let of_row = |row: usize| match row.checked_sub(self.positions) {
            Some(place) if !all.is_empty() => all[place % all.len()],
            _ => Observation::Position,
        };
        (0..rows).map(of_row).collect()
    }

    /// How many rows measure one target before the next one has its turn: with fixtures all that
    /// there is to measure, so that each target meets each of them, else one.
    pub(super) fn rows_per_target(&self, fixtures: &[Fixture]) -> usize {
        if fixtures.is_empty() { 1 } else { fixtures.len() + self.tilts.len() }
    }

    /// 1 σ of what a row measures \[m\], of a tilt \[rad\].
    pub(super) fn sigma_of(&self, observation: Observation) -> f64 {
        let [point, distance, surface] = self.contact_sigmas;
        match observation {
            Observation::Point(_) => point,
            Observation::Distance(_) => distance,
            Observation::Surface(_) => surface,
            Observation::Tilt(_) => self.tilt_sigma,
            _ => self.noise_sigma,
        }
    }
}

impl RandomRule {
    /// 1 σ of a parameter of that unit.
    pub(super) fn sigma(&self, unit: Unit) -> Option<f64> {
        match unit {
            Unit::Angle => self.angle,
            Unit::Length => self.length,
            _ => self.relative,
        }
    }
}

impl HeldOutRows {
    /// How many of `rows` rows are held out.
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
