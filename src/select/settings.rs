//! Constants of the search that users do not set, in one place.
//! [`SelectionRules`](super::SelectionRules) contains those that users may set.

// The following constants are prior probabilities.

/// Prior weight of a family of functions without a law, relative to a family of effects. The
/// catalogue contains most causes.
pub(super) const PRIOR_OF_FUNCTIONS: f64 = 0.25;
/// Prior weight of the bending of links that are declared rigid, relative to another family of
/// effects. Most of an arm's compliance is in its joints.
pub(super) const PRIOR_OF_RIGID_LINKS: f64 = 0.1;
/// Prior weight of an error of scale or of squareness of the instrument, relative to another family
/// of effects. Instruments are calibrated against lengths, arms are not.
pub(super) const PRIOR_OF_INSTRUMENT_SCALE: f64 = 0.1;
/// Prior probability that the next effect of a set belongs to a family that the set already
/// contains: an effect of one joint often occurs at others.
pub(super) const PRIOR_OF_SAME_FAMILY: f64 = 0.25;
/// Trial root mean square displacements of the target by a hypothesis, in units of σ, equally
/// probable a priori. They range from hardly visible to obvious, in factors of about three.
pub(super) const DISPLACEMENTS: [f64; 6] = [0.3, 1.0, 3.0, 10.0, 30.0, 100.0];
/// Largest plausible value of an effect's parameter, as a multiple of the 1 σ of its prior.
pub(super) const MAX_PLAUSIBLE: f64 = 3.0;
/// Half-width of the Cauchy prior on ln(true σ / declared σ): a declared σ is mostly right to a
/// tenth.
pub(super) const SPREAD_OF_DECLARED_NOISE: f64 = 0.1;
/// Half-width of the Cauchy prior on ln(true σ / estimated σ), for a σ that was estimated from the
/// same residual.
pub(super) const SPREAD_OF_ESTIMATED_NOISE: f64 = 1.0;

// The following constants concern functions without a law.

/// Lengths over which smooth functions change, as fractions of the measured range of the covariate.
pub(super) const SMOOTH_LENGTHS: [f64; 3] = [0.5, 0.2, 0.08];
/// Correlation lengths of an error that wanders in time, as fractions of the measured duration.
pub(super) const ROUGH_LENGTHS: [f64; 3] = [0.15, 0.06, 0.025];
/// Length over which functions of two covariates change, as a fraction of their measured ranges.
pub(super) const SURFACE_LENGTH: f64 = 0.4;
/// Length over which amplitude and phase of a nearly periodic error change, as a fraction of the
/// measured range.
pub(super) const SLOW_LENGTH: f64 = 0.5;
/// Highest order of a nearly periodic error [cycles per revolution]: that of the harmonics in the
/// catalogue.
pub(super) const MAX_NEAR_ORDER: u32 = 60;
/// Trial highest orders of periodic errors with many orders, up to the highest order of a harmonic
/// in the catalogue.
pub(super) const GEAR_ORDERS: [u32; 4] = [12, 20, 30, 60];

// The following constants concern searched arguments.

/// Minimum number of poses before and after a station shift.
pub(super) const MIN_POSES_BESIDE_SHIFT: usize = 3;
/// Maximum number of trial times of a station shift.
pub(super) const MAX_SHIFT_TIMES: usize = 200;
/// Highest order of a wave [cycles per revolution], integer or not. It is about the number of teeth
/// of a strain-wave gear, twice its ratio.
pub(super) const MAX_WAVE_ORDER: f64 = 320.0;
/// ln of the odds (20 to 1) over the listed values at which another value of an argument (order or
/// time) becomes a hypothesis.
pub(super) const LN_ODDS_OF_ANOTHER_ARGUMENT: f64 = 3.0;

// The following constants concern the beam search over sets of hypotheses.

/// Smallest probability of a set in which searched arguments are refined: 1 %.
pub(super) const MIN_REVISED_PROBABILITY: f64 = 0.01;
/// Maximum number of sets, the most probable ones, in which searched arguments are refined.
pub(super) const MAX_REVISED_SETS: usize = 6;
/// Maximum number of hypotheses by which one search extends a set.
pub(super) const MAX_EFFECTS: usize = 4;
/// Number of sets of equal size that are extended by one more hypothesis (beam width).
pub(super) const BEAM_WIDTH: usize = 8;
/// Maximum number of hypotheses by which the sets of one size other than the best one are extended.
pub(super) const MAX_EXTENDING: usize = 80;
/// Largest number of columns of a hypothesis with free values per pose at which a set that contains
/// it is extended, because the work grows with the cube of that number.
pub(super) const MAX_WIDE_COLUMNS: usize = 240;
/// Largest ln odds of the best set over a set that is still extended or evaluated.
pub(super) const LOG_ODDS_CUTOFF: f64 = 12.0;
/// Largest number of added effects at which the loop removes them from the fit and evaluates them
/// again.
pub(super) const MAX_RECONSIDERED: usize = 16;
/// Maximum number of rival sets that are fitted, in addition to the best replacements of each
/// member.
pub(super) const MAX_RIVALS: usize = 5;
/// Maximum number of effects that are fitted as replacements of each found effect, or of a function
/// without a law.
pub(super) const MAX_STAND_INS: usize = 3;

// The following constants concern rows that are left out.

/// Maximum number of poses, each of which alone supports an effect, that are left out of the
/// evidence, in tables of few poses.
const MIN_SINGLE_POSES: usize = 3;
/// Number of poses for each one that is left out for this reason; gross errors are rarer.
const POSES_PER_SINGLE: usize = 10;

/// Returns the maximum number of the evidence's `poses` that are left out because each alone
/// supports an effect.
pub(super) fn max_single_poses(poses: usize) -> usize {
    (poses / POSES_PER_SINGLE).max(MIN_SINGLE_POSES)
}

/// Smallest squared distance |r|² of an outlier, in units of the variance of the other rows'
/// coordinates: ten standard deviations. Effects displace single poses by less, wrong readings by
/// more.
pub(super) const OUTLIER_SQUARED_DISTANCE: f64 = 100.0;
/// Prior probability that a row has a gross error.
pub(super) const PRIOR_OF_GROSS_ERROR: f64 = 0.01;
/// ln of the odds (100 to 1) over gross errors at which effects explain the rows that stand out.
pub(super) const LN_ODDS_OF_COMMON_CAUSE: f64 = 4.6;
/// Largest fraction of the poses that can be outliers; if more have large residuals, none is an
/// outlier.
pub(super) const MAX_OUTLIER_SHARE: f64 = 0.1;

// The following constants concern the ranking and the claims about effects.

/// Smallest fraction of the length of a candidate's column, outside the span of the fitted
/// parameters' columns, at which the candidate is detectable. The linear neighbourhood is not more
/// accurate.
pub(super) const MIN_NEW_LENGTH: f64 = 1e-4;
/// Number of standard errors below zero at which a parameter that cannot be negative is rejected:
/// one in 700 for normal errors.
pub(super) const MAX_NEGATIVE_ERRORS: f64 = 3.0;
/// Maximum number of entries of a ranking.
pub(super) const MAX_RANKED: usize = 20;
/// Number of entries of a ranking for which confounded effects and cross-validation are computed.
pub(super) const MAX_COMPARED: usize = 8;
/// Largest principal angle between two confounded effects \[rad\]: 20°.
pub(super) const CONFOUNDED_ANGLE: f64 = 0.35;
/// Maximum number of poses among which one that distinguishes two confounded effects is sought.
pub(super) const MAX_SEPARATING_POSES: usize = 400;
/// Number of blocks of the cross-validation: ten-fold, as usual [Hastie, Tibshirani and Friedman
/// 2009, section 7.10].
pub(super) const CROSS_VALIDATION_BLOCKS: usize = 10;
/// Largest ratio of the root mean square errors of left-out poses, with and without a correction,
/// at which the correction is reported.
pub(super) const MAX_CORRECTED_ERROR: f64 = 0.95;
/// Smallest odds of another effect over a found one at which it is reported as an alternative.
pub(super) const MIN_ALTERNATIVE_ODDS: f64 = 0.05;
/// Maximum number of alternatives of a probable effect that are fitted in its place.
pub(super) const MAX_FITTED_ALTERNATIVES: usize = 2;
/// Number of random subsets of the configurations by which the stability of a finding is measured.
pub(super) const SUBSETS: u64 = 20;
/// Smallest fraction of these subsets in which an effect must be found for its stated probability
/// to be that on all rows. With a smaller fraction, the mean over the subsets is stated.
pub(super) const MIN_SHARE_OF_SUBSETS: f64 = 0.75;
/// Each random subset leaves out one in this many configurations.
pub(super) const SUBSET_PARTS: usize = 5;
/// Number of resamples of the bootstrap interval of the gain.
pub(super) const RESAMPLES: usize = 2000;
/// Probability that the bootstrap interval of the gain covers the gain.
pub(super) const INTERVAL_LEVEL: f64 = 0.95;

// The following constants concern plans of measurements.

/// Probability that an effect of the stated size is found, in `check` and `plan`: 0.8, as usual
/// [Cohen 1988].
pub(super) const POWER: f64 = 0.8;
/// Assumed time between poses without recorded times \[s\].
pub(super) const ASSUMED_TIME_STEP: f64 = 60.0;
