//! Every number of the search for what a model lacks, in one place; docs/selection.md has them with
//! the same words.

use std::ops::RangeInclusive;

use crate::fit::IdentifyError;
use crate::problem::HIGHEST_ORDER;

/// What decides which effects are found and what is said of them.
///
/// Parts are parts of 1, criteria are differences of ν ln(squares) + k ln ν + 2 ln(tries), −2 ln of
/// the odds [Schwarz 1978].
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SelectionRules {
    /// Probability that noise alone points to any effect, and that it makes any residual test fail.
    /// One false alarm in a hundred data sets is rare enough to be looked into.
    pub level: f64,
    /// Corrected p above which an effect leaves again: larger than `level`, so that no effect goes
    /// to and fro at the border.
    pub leaving_level: f64,
    /// Criterion by which one explanation must be better than another to be beyond doubt: odds of
    /// 20 to 1 [Kass and Raftery 1995].
    pub beyond_doubt: f64,
    /// Criterion up to which candidates behind the best are its rivals: odds of 150 to 1, very
    /// strong in [Kass and Raftery 1995].
    pub rival: f64,
    /// Corrected p below which an effect whose rivals are of its own family needs no fit before the
    /// next is looked for.
    pub overwhelming: f64,
    /// Standard errors below zero from which on what is never negative is impossible: one in 700
    /// for normal errors.
    pub impossible: f64,
    /// Part of its columns' length that must be new for a candidate to be seen at all; with less,
    /// the fitted parameters take it up within what the linear neighbourhood describes.
    pub absorbed: f64,
    /// Scatter in units of a declared σ below which the residual is rounding and nothing is sought
    /// in it.
    pub rounding: f64,
    /// Work that the fits of one round may take, in poses × parameters² of all of them together:
    /// what it does not pay for is decided in the linear neighbourhood. About 0.1 s for each step
    /// of all fits on one core.
    pub round_work: f64,
    /// Rivals that are fitted at most to decide between them.
    pub rivals: usize,
    /// Candidates, best first, that may fail the cross-validation before a round adds nothing.
    pub validated: usize,
    /// Effects that one round adds at most.
    pub picks: usize,
    /// Rounds after which the search ends whatever is left.
    pub rounds: usize,
    /// Effects that are exchanged for better ones at most, once no round adds any.
    pub exchanges: usize,
    /// Steps of a fit that the work of a round does not pay for; the last fit converges in any
    /// case.
    pub few_steps: u64,
    /// Blocks of the cross-validation: ten-fold, as usual [Hastie, Tibshirani and Friedman 2009,
    /// section 7.10].
    pub blocks: usize,
    /// Poses that a station shift must leave on either side.
    pub least_side: usize,
    /// Times of a station shift that are tried at most.
    pub shift_times: usize,
    /// Coefficients of harmonics from which on they share one prior, whose scale so many can tell.
    pub many_coefficients: usize,
    /// Orders of a joint from which on all up to the highest of them are put in under that prior.
    pub several_orders: usize,
    /// Parts of each joint's range that are left out in turn to find the prior's scale.
    pub range_parts: usize,
    /// Scales of the prior that are tried, as powers of two of the size that the coefficients show;
    /// then half and quarter powers about the best.
    pub prior_scales: RangeInclusive<i32>,
    /// Orders over which the σ of that prior is smoothed: a joint that covers part of its turn
    /// tells no finer.
    pub order_width: f64,
    /// Squares of mean size that count beside those of the coefficients of an order, where these
    /// are few.
    pub common_values: f64,
    /// Part of their rms error to which a correction must take poses that were left out to be worth
    /// stating.
    pub worthwhile: f64,
    /// Entries of a ranking.
    pub ranked: usize,
    /// Entries of a ranking whose look-alikes and cross-validation are worked out.
    pub looked_at: usize,
    /// Largest principal angle \[rad\] at which two effects are look-alikes: 20°.
    pub alike: f64,
    /// Other effects that are fitted in the place of each that is found, or of a function without a
    /// law.
    pub stand_ins: usize,
    /// Poses among which one is sought that tells two look-alikes apart.
    pub telling_poses: usize,
    /// Probability with which an effect of the stated size is found, in `check` and `plan`: 0.8, as
    /// usual [Cohen 1988].
    pub power: f64,
    /// Seconds between poses whose times nobody knows yet.
    pub time_step: f64,
    /// Resamples of the interval of the gain.
    pub resamples: usize,
    /// Draws of whole configurations that tell how often a finding returns.
    pub drawn_again: u64,
    /// Of so many configurations one is left out in each of them.
    pub left_out: usize,
    /// Poses, each of which alone carries an effect, that are left out of the weighing at most.
    pub mainstays: usize,
    /// Odds to another effect from which on it is named as an alternative.
    pub beside: f64,
    /// |r|² of an outlier in units of the others' scatter of a coordinate: ten times that scatter, for what a cause does to single ones of
    /// few poses is mostly less, and a wrong reading mostly more.
    pub gross: f64,
    /// Part of the poses that may be outliers; where more are far off, they are no outliers.
    pub few: f64,
    /// Effects that the loop added beyond which none is taken out again to be weighed.
    pub crowd: usize,
    /// Part of the resamples within that interval.
    pub covered: f64,
    /// Poses up to which evidence leads the choice of effects, weighed on all of them; with more,
    /// rounds find the effects.
    pub led_poses: usize,
    /// Poses, taken evenly, on which hypotheses are weighed against each other where rounds found
    /// the effects; up to so many rounds are not tried.
    pub weighed_poses: usize,
    /// Chance of a family of functions of unknown law, over that of a family of effects: the
    /// catalogue holds what is common.
    pub unknown_law: f64,
    /// Chance that links declared rigid bend, over that of another family of effects: most of what
    /// an arm gives way by is in its joints.
    pub rigid_links: f64,
    /// Chance that a further effect is of a family that is there already: what gives way at one
    /// joint does at others.
    pub of_a_kind: f64,
    /// Probability from which on there are as many hypotheses as an explanation has: what the loop
    /// adds. What is more probable than not: of one model alone that predicts best [Barbieri and
    /// Berger 2004]. What is named as found is for `stated`.
    pub sure: f64,
    /// Probability from which on functions without a law are stated as structure that is left: that
    /// there are as many hypotheses as in their explanation, or that some function is at work at
    /// the part of one of them.
    pub located: f64,
    /// Probability of a law from which on an effect is named as found; below it is a place with a
    /// law such as this one.
    pub stated: f64,
    /// Root mean square displacements that a hypothesis may cause, in units of σ, each as probable
    /// as the others: from a third of σ, which hardly shows, by steps of three to what nobody
    /// overlooks.
    pub displacements: [f64; 6],
    /// Largest plausible value of an effect's parameter, in units of the 1 σ of its prior.
    pub plausible: f64,
    /// Half width of the distribution of ln(true σ / declared σ): mostly to a tenth, but its tails
    /// are those of Cauchy.
    pub trust_declared: f64,
    /// The same of a σ that was estimated from the same residual.
    pub trust_estimated: f64,
    /// Hypotheses that an explanation holds at most.
    pub together: usize,
    /// Explanations with as many hypotheses that are extended by a further one.
    pub extended: usize,
    /// Hypotheses, those that explain most alone or beside the rest of a set, that extend any but
    /// the best of them, which all extend.
    pub extending: usize,
    /// Columns of a hypothesis with another error in every pose up to which it is extended by
    /// further ones: what that costs grows with their cube.
    pub widest: usize,
    /// ln of the odds behind the best explanation from which on larger ones are not looked for.
    pub hopeless: f64,
    /// Lengths over which smooth functions change, as parts of the range that was measured.
    pub smooth_lengths: [f64; 3],
    /// Lengths over which what measures forgets how it erred, as parts of the time that was
    /// measured.
    pub rough_lengths: [f64; 3],
    /// Length over which functions of two covariates change.
    pub surface_length: f64,
    /// The same of the height and phase of what nearly repeats.
    pub slow_length: f64,
    /// Highest order of what nearly repeats in a turn of a joint: as that of harmonics.
    pub near_orders: u32,
    /// Highest order of a wave that is looked for, whole number or not: about the teeth of a
    /// strain-wave gear, twice its ratio.
    pub wave_orders: f64,
    /// ln of the odds to a whole number that is no candidate by itself, or to an order that was
    /// taken before, from which on the order of a wave is another one: 20 to 1.
    pub another_order: f64,
    /// Seed of what is random: blocks, permutations, resamples, telling poses.
    pub seed: u64,
}

impl SelectionRules {
    /// The rules that commands use.
    pub const DEFAULT: Self = Self {
        level: 0.01,
        leaving_level: 0.05,
        beyond_doubt: 6.0,
        rival: 10.0,
        overwhelming: 1e-12,
        impossible: 3.0,
        absorbed: 1e-4,
        rounding: 1e-3,
        round_work: 1e7,
        rivals: 5,
        validated: 8,
        picks: 100,
        rounds: 24,
        exchanges: 4,
        few_steps: 4,
        blocks: 10,
        least_side: 3,
        shift_times: 200,
        many_coefficients: 20,
        several_orders: 3,
        range_parts: 5,
        prior_scales: -8..=2,
        order_width: 1.5,
        common_values: 4.0,
        worthwhile: 0.95,
        ranked: 20,
        looked_at: 8,
        alike: 0.35,
        stand_ins: 3,
        telling_poses: 400,
        power: 0.8,
        time_step: 60.0,
        resamples: 2000,
        drawn_again: 20,
        left_out: 5,
        mainstays: 3,
        beside: 0.05,
        gross: 100.0,
        few: 0.1,
        crowd: 16,
        covered: 0.95,
        led_poses: 1500,
        weighed_poses: 240,
        unknown_law: 0.25,
        rigid_links: 0.1,
        of_a_kind: 0.25,
        sure: 0.5,
        located: 0.95,
        stated: 0.9,
        displacements: [0.3, 1.0, 3.0, 10.0, 30.0, 100.0],
        plausible: 3.0,
        trust_declared: 0.1,
        trust_estimated: 1.0,
        together: 4,
        extended: 8,
        extending: 80,
        widest: 240,
        hopeless: 12.0,
        smooth_lengths: [0.5, 0.2, 0.08],
        rough_lengths: [0.15, 0.06, 0.025],
        surface_length: 0.4,
        slow_length: 0.5,
        near_orders: 60,
        wave_orders: 320.0,
        another_order: 3.0,
        seed: 20_211_206,
    };

    /// Whether every number makes sense: the first that does not is an error.
    ///
    /// # Errors
    /// A probability or part that is none, a length or number that is not above zero, an empty
    /// range.
    #[doc(hidden)]
    pub fn check(&self) -> Result<(), IdentifyError> {
        let part = |value: f64| value > 0.0 && value < 1.0;
        let size = |value: f64| value > 0.0 && value.is_finite();
        let rules = [
            ("level", part(self.level)),
            ("leaving_level", part(self.leaving_level) && self.leaving_level >= self.level),
            ("beyond_doubt", size(self.beyond_doubt)),
            ("rival", size(self.rival)),
            ("overwhelming", part(self.overwhelming)),
            ("impossible", size(self.impossible)),
            ("absorbed", part(self.absorbed)),
            ("rounding", part(self.rounding)),
            ("round_work", size(self.round_work)),
            ("blocks", self.blocks >= 2),
            ("least_side", self.least_side >= 1),
            ("range_parts", self.range_parts >= 2),
            (
                "prior_scales",
                !self.prior_scales.is_empty()
                    && self.prior_scales.clone().all(|power| power.abs() < 1000),
            ),
            ("order_width", size(self.order_width)),
            ("common_values", size(self.common_values)),
            ("worthwhile", part(self.worthwhile)),
            ("alike", size(self.alike)),
            ("telling_poses", self.telling_poses >= 1),
            ("power", part(self.power)),
            ("time_step", size(self.time_step)),
            ("resamples", (1..=10_000_000).contains(&self.resamples)),
            ("covered", part(self.covered)),
            ("led_poses", self.led_poses >= self.weighed_poses),
            ("weighed_poses", self.weighed_poses >= 1),
            ("unknown_law", size(self.unknown_law)),
            ("rigid_links", size(self.rigid_links)),
            ("of_a_kind", part(self.of_a_kind)),
            ("sure", part(self.sure)),
            ("located", part(self.located)),
            ("stated", part(self.stated)),
            ("drawn_again", self.drawn_again >= 1),
            ("left_out", self.left_out >= 1),
            ("beside", part(self.beside)),
            ("gross", size(self.gross)),
            ("few", part(self.few)),
            ("displacements", self.displacements.iter().all(|&size_of| size(size_of))),
            ("plausible", size(self.plausible)),
            ("trust_declared", size(self.trust_declared)),
            ("trust_estimated", size(self.trust_estimated)),
            ("together", self.together >= 1),
            ("extended", self.extended >= 1),
            ("extending", self.extending >= 1),
            ("widest", self.widest >= 1),
            ("hopeless", size(self.hopeless)),
            ("smooth_lengths", self.smooth_lengths.iter().all(|&length| size(length))),
            ("rough_lengths", self.rough_lengths.iter().all(|&length| size(length))),
            ("surface_length", size(self.surface_length)),
            ("slow_length", size(self.slow_length)),
            ("wave_orders", size(self.wave_orders) && self.wave_orders <= HIGHEST_ORDER),
            ("another_order", size(self.another_order)),
        ];
        rules
            .into_iter()
            .find(|(_, holds)| !holds)
            .map_or(Ok(()), |(rule, _)| Err(IdentifyError::Rule { rule }))
    }
}

impl Default for SelectionRules {
    fn default() -> Self {
        Self::DEFAULT
    }
}
