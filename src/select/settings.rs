//! Numbers that shape the search and that users do not set, one place for each subject.
//! [`SelectionRules`](super::SelectionRules) has those that users may set.

// Prior probabilities.

/// Prior weight of a family of functions without a law, relative to a family of effects: the
/// catalogue holds what is common.
pub(super) const PRIOR_OF_FUNCTIONS: f64 = 0.25;
/// Prior weight of the bending of links that are declared rigid, relative to another family of
/// effects: most of what an arm gives way by is in its joints.
pub(super) const PRIOR_OF_RIGID_LINKS: f64 = 0.1;
/// Prior probability that a further effect is of a family that the set holds already: what gives way
/// at one joint does at others.
pub(super) const PRIOR_OF_SAME_FAMILY: f64 = 0.25;
/// Root mean square displacements that a hypothesis may cause, in units of σ, equally probable: from
/// a third of σ, which hardly shows, in steps of three to what nobody overlooks.
pub(super) const DISPLACEMENTS: [f64; 6] = [0.3, 1.0, 3.0, 10.0, 30.0, 100.0];
/// Largest plausible value of an effect's parameter, in units of the 1 σ of its prior.
pub(super) const MAX_PLAUSIBLE: f64 = 3.0;
/// Half width of the Cauchy distribution of ln(true σ / declared σ): mostly right to a tenth.
pub(super) const SPREAD_OF_DECLARED_NOISE: f64 = 0.1;
/// Half width of that distribution for a σ that was estimated from the same residual.
pub(super) const SPREAD_OF_ESTIMATED_NOISE: f64 = 1.0;

// Functions without a law.

/// Lengths over which smooth functions change, as parts of the measured range.
pub(super) const SMOOTH_LENGTHS: [f64; 3] = [0.5, 0.2, 0.08];
/// Correlation lengths of an error that wanders in time, as parts of the measured time.
pub(super) const ROUGH_LENGTHS: [f64; 3] = [0.15, 0.06, 0.025];
/// Length over which functions of two covariates change, as a part of the measured range.
pub(super) const SURFACE_LENGTH: f64 = 0.4;
/// Length over which height and phase of a nearly periodic error change, as a part of the measured
/// range.
pub(super) const SLOW_LENGTH: f64 = 0.5;
/// Highest order, in cycles a turn of the joint, of a nearly periodic error: that of the harmonics.
pub(super) const MAX_NEAR_ORDER: u32 = 60;
/// Highest orders of the periodic errors with many orders that are tried: some cycles a turn, and
/// the highest order of a harmonic in the catalogue.
pub(super) const GEAR_ORDERS: [u32; 4] = [12, 20, 30, 60];

// Searched arguments.

/// Poses that a station shift must leave on either side.
pub(super) const MIN_POSES_BESIDE_SHIFT: usize = 3;
/// Times of a station shift that are tried at most.
pub(super) const MAX_SHIFT_TIMES: usize = 200;
/// Highest order of a wave, whole number or not: about the teeth of a strain-wave gear, twice its
/// ratio.
pub(super) const MAX_WAVE_ORDER: f64 = 320.0;
/// Log odds from which on another order or time is a hypothesis beside one that is known: 20 to 1.
pub(super) const LN_ODDS_OF_ANOTHER_ARGUMENT: f64 = 3.0;

// Beam search over sets of hypotheses.

/// Minimum probability of a set in which searched arguments are revised: one to a hundred.
pub(super) const MIN_REVISED_PROBABILITY: f64 = 0.01;
/// Sets in which searched arguments are revised at most, the most probable ones.
pub(super) const MAX_REVISED_SETS: usize = 6;
/// Hypotheses by which one search extends a set at most.
pub(super) const MAX_EFFECTS: usize = 4;
/// Sets of equally many hypotheses that are extended by a further one.
pub(super) const BEAM_WIDTH: usize = 8;
/// Hypotheses that extend a set other than the best one, those that explain most in its place.
pub(super) const MAX_EXTENDING: usize = 80;
/// Columns of a hypothesis with one value for each pose above which a set with it is not extended:
/// the work grows with their cube.
pub(super) const MAX_WIDE_COLUMNS: usize = 240;
/// Log odds behind the best set beyond which larger sets are not searched.
pub(super) const LOG_ODDS_CUTOFF: f64 = 12.0;
/// Added effects above which none is taken out of the fit and evaluated again.
pub(super) const MAX_RECONSIDERED: usize = 16;
/// Rival sets that are fitted, beside the best hypotheses in the place of each member.
pub(super) const MAX_RIVALS: usize = 5;
/// Other effects that are fitted in the place of each effect that is found, or of a function without
/// a law.
pub(super) const MAX_STAND_INS: usize = 3;

// Rows that do not take part.

/// Poses, each of which alone supports an effect, that are left out of the evidence at most.
pub(super) const MAX_SINGLE_POSES: usize = 3;
/// Squared distance |r|² from which on a pose is an outlier, in units of the scatter of a coordinate
/// of the others, squared: ten times the scatter. An effect moves single poses of few by less, a
/// wrong reading by more.
pub(super) const OUTLIER_DISTANCE: f64 = 100.0;
/// Part of the poses that may be outliers; where more are far off, none is one.
pub(super) const MAX_OUTLIER_SHARE: f64 = 0.1;

// Ranking and what is stated of an effect.

/// Part of its columns' length that must be new for a candidate to be observable; the fitted
/// parameters take up less within what the linear neighbourhood describes.
pub(super) const MIN_NEW_LENGTH: f64 = 1e-4;
/// Standard errors below zero from which on a parameter that is never negative is impossible: one in
/// 700 for normal errors.
pub(super) const MAX_NEGATIVE_ERRORS: f64 = 3.0;
/// Entries of a ranking.
pub(super) const MAX_RANKED: usize = 20;
/// Entries of a ranking whose confounded effects and cross-validation are computed.
pub(super) const MAX_COMPARED: usize = 8;
/// Largest principal angle between two confounded effects \[rad\]: 20°.
pub(super) const CONFOUNDED_ANGLE: f64 = 0.35;
/// Poses among which one is sought that separates two confounded effects.
pub(super) const MAX_SEPARATING_POSES: usize = 400;
/// Blocks of the cross-validation: ten-fold, as usual [Hastie, Tibshirani and Friedman 2009, section
/// 7.10].
pub(super) const CROSS_VALIDATION_BLOCKS: usize = 10;
/// Part of their root mean square error to which a correction must take poses that were left out to
/// be worth stating.
pub(super) const MAX_CORRECTED_ERROR: f64 = 0.95;
/// Smallest odds to an effect from which on another one is stated as an alternative.
pub(super) const MIN_ALTERNATIVE_ODDS: f64 = 0.05;
/// Random subsets of the configurations that show how often a finding returns.
pub(super) const SUBSETS: u64 = 20;
/// One configuration of so many is left out of each of these subsets.
pub(super) const SUBSET_PARTS: usize = 5;
/// Resamples of the bootstrap interval of the gain.
pub(super) const RESAMPLES: usize = 2000;
/// Level of that interval.
pub(super) const INTERVAL_LEVEL: f64 = 0.95;

// Plans.

/// Probability with which an effect of the stated size is found, in `check` and `plan`: 0.8, as
/// usual [Cohen 1988].
pub(super) const POWER: f64 = 0.8;
/// Time between poses whose times are not known yet \[s\].
pub(super) const ASSUMED_TIME_STEP: f64 = 60.0;
