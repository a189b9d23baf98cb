//! Errors that prevent a design.

use nalgebra::Vector3;

use super::workspace::Workspace;
use crate::error::{InputError, InputErrorKind, Location};
use crate::problem::{Joint, JointKind, Problem};

/// Lines of a problem file that make the geometry of an arm and its base free parameters.
const FREE: &str = "write [parameters] with lines such as \"joint*.alpha\" = { sigma_deg = 1.0 }, \"joint*.a\" = { sigma_mm = 5.0 }, \
                    \"joint*.theta\" = { sigma_deg = 1.0 }, \"joint*.d\" = { sigma_mm = 5.0 }, \"base.*\" = { free = true }";

/// Error that prevents a plan or a forecast.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DesignError {
    /// Problem and poses do not match.
    #[error("{0}")]
    Input(#[from] InputError),
    /// A joint has no limits.
    #[error("{0}")]
    NoRange(#[source] InputError),
    /// No pose was requested, or a table has none.
    #[error("no pose to plan or to check")]
    NoPoses,
    /// There are fewer candidates with an equilibrium than poses requested.
    #[error("{poses} poses: there are only {candidates} candidates")]
    TooFewCandidates {
        /// Number of poses requested.
        poses: usize,
        /// Number of candidates with an equilibrium.
        candidates: usize,
    },
    /// Both effects of a pair are the same.
    #[error("both effects are the same: {effect}")]
    SameEffect {
        /// Description of the effect.
        effect: String,
    },
    /// The problem already declares an effect.
    #[error("the problem declares this effect already: {effect}")]
    DeclaredEffect {
        /// Description of the effect.
        effect: String,
    },
    /// An effect depends on time, so that the choice of poses cannot show it.
    #[error("the effect depends on the time of measurement, not on the poses: {effect}")]
    FollowsTime {
        /// Description of the effect.
        effect: String,
    },
    /// No pose distinguishes two effects.
    #[error(
        "for this arm they are one cause with two names, which no pose tells apart (the angle \
         between them is 0.0° at random poses), so that no pose is planned: {}; {}", .effects[0],
        .effects[1]
    )]
    CausesAlike {
        /// Descriptions of the effects.
        effects: [String; 2],
    },
    /// The nominal arm has no equilibrium in any pose.
    #[error(
        "the nominal arm has no equilibrium under its loads in any pose; check stiffnesses and \
         masses"
    )]
    NoEquilibrium,
    /// Every candidate of a table is measured and fitted already.
    #[error(
        "all candidates are measured and fitted already; give a table with others, or none to \
         draw them from the ranges of the joints"
    )]
    AllMeasured,
    /// The target of the nominal arm is in no candidate inside the region.
    #[error("in no pose is the target inside the region{}", of_size(*.millimetres))]
    NothingInRegion {
        /// Largest side of the box \[mm\]; `None` without a box.
        millimetres: Option<f64>,
    },
    /// No candidate shows a point of a marker to a camera.
    #[error(
        "no candidate shows a point of a marker to a camera; widen the ranges of the joints, or \
         check where cameras and markers are"
    )]
    NothingInView,
    /// The criterion weighs predicted positions, but cameras measure.
    #[error("the criterion I weighs positions of the target; with cameras choose S, A, D or E")]
    NoPositions,
    /// The measurements of these poses depend on no free parameter.
    #[error(
        "no free parameter moves the target in any pose; check lengths, ranges and their units"
    )]
    NothingSeen,
}

/// Length \[mm\] below which the largest side of a box was probably given in metres by mistake.
const MIN_PLAUSIBLE_SIDE_MM: f64 = 10.0;

/// Returns the remedy for a region without poses, given the largest side of its box \[mm\].
fn of_size(millimetres: Option<f64>) -> String {
    match millimetres {
        Some(side) if side < MIN_PLAUSIBLE_SIDE_MM => format!(
            ", whose longest side is {side:.3} mm: if its numbers are metres, multiply them by 1000"
        ),
        _ => "; check --workspace-mm, --keep-out-mm and the ranges of the joints (coordinates are those \
             of the arm's base, in millimetres)"
            .to_owned(),
    }
}

impl DesignError {
    /// Returns the error of a region that the target reaches in no pose.
    pub(super) fn nothing_in(region: &Workspace) -> Self {
        let side = |[from, to]: [Vector3<f64>; 2]| (to - from).amax() * 1e3;
        Self::NothingInRegion { millimetres: region.corners.map(side) }
    }

    /// Returns the error of a joint without a limit at `end`, which is `min` or `max`.
    pub(super) fn no_range(joint: &Joint, end: &str) -> Self {
        let unit = if joint.kind == JointKind::Prismatic { "mm" } else { "deg" };
        let key = format!("{}.{end}_{unit}", joint.location.key.as_deref().unwrap_or("joint"));
        let write = format!("min_{unit} and max_{unit} of every moving joint");
        let location = joint.location.clone().with_key(key);
        Self::NoRange(location.error(InputErrorKind::MissingKey { write, near: None }))
    }

    /// Returns the error of a problem that does not declare the noise σ of a measured position.
    pub(super) fn no_sigma(problem: &Problem) -> Self {
        let sigma = "the expected 1 σ of a coordinate (or give the poses a column sigma_mm)";
        let write = if problem.fixtures.is_empty() {
            sigma.to_owned()
        } else {
            format!(
                "--candidates FILE.csv, a table with a column point, anchor or surface that says what each pose touches or measures \
                 against; for poses whose positions are measured, {sigma}"
            )
        };
        let location = problem.data.location.clone().with_key("data.position_sigma_mm");
        location.error(InputErrorKind::MissingKey { write, near: None }).into()
    }

    /// Returns the error of a problem without a free parameter.
    pub(super) fn nothing_free(problem: &Problem) -> Self {
        let location = Location::file(&problem.data.location.file).with_key("parameters");
        location.error(InputErrorKind::NothingFree { write: FREE }).into()
    }
}
