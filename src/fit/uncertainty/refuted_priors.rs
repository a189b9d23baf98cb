//! Rules of `[parameters]` whose σ the data refute.
//!
//! A prior that is far too narrow keeps its parameters near nominal, and the misfit is attributed
//! to the noise. The fit then assumes a noise σ far above the declared one. For each rule the
//! evidence of wider prior σ is computed, linearised about the fit. With the deviations z of the
//! unknowns from nominal, whitened residuals r = R z + c, priors z ∼ N(0, K⁻¹), and the noise
//! variance s² relative to the declared one,
//!
//! −2 ln L(s², K) = m ln s² + ln|A| − ln|K| + (‖r₀‖² − bᵀA⁻¹b / s²) / s²,  A = RᵀR / s² + K
//!
//! with b = Rᵀc, the squared whitened residual ‖r₀‖² of the nominal arm, and m measured coordinates
//! [Bishop 2006, §3.5].

use nalgebra::{DMatrix, DVector};

use crate::fit::stages::noise_model::by_chance;
use crate::fit::stages::stage::Stage;
use crate::least_squares::Loss;

/// Trial factors by which the σ of a rule is multiplied.
const TRIAL_FACTORS: [f64; 8] = [3.0, 10.0, 30.0, 100.0, 300.0, 1e3, 3e3, 1e4];
/// Largest ratio of the noise variance with a wider prior to that with the declared one, at which
/// the prior explains the misfit.
const MAX_VARIANCE_RATIO: f64 = 0.25;
/// Largest noise variance with wider priors, relative to the declared one, at which priors explain
/// the misfit.
const MAX_VARIANCE: f64 = 1000.0;
/// Multiple of the critical value of 2 ln of the likelihood ratio (probability 0.001) above which a
/// prior is refuted.
const REJECTION_FACTOR: f64 = 10.0;
/// Smallest ratio of the noise variance that the fit assumed to the declared one, at which priors
/// are tested.
const MIN_NOISE_FACTOR: f64 = 4.0;
/// Number of trial noise variances at which the evidence is compared.
const TRIAL_VARIANCES: u32 = 24;
/// Largest number of unknowns for which priors are tested, because the work grows with its cube.
const MAX_UNKNOWNS: usize = 150;
/// Prior precision given to unknowns without a prior, relative to the information of the data about
/// them.
const FLAT_PRIOR_PRECISION: f64 = 1e-12;

/// Rule of `[parameters]` whose declared σ the data refute.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::fit) struct RefutedPrior {
    /// Pattern of the rule, as in the problem file.
    pub rule: String,
    /// Trial factor on the declared σ of the rule with the largest evidence.
    pub factor: f64,
    /// Ratio of the noise σ with all refuted priors widened to that with the declared priors.
    pub sigma_ratio: f64,
}

/// Finds the rules whose σ the data refute, the one whose widening raises the evidence most first.
///
/// `stage` has all unknowns and identification rows with their declared noise σ, and `at` is the
/// full parameter vector of the fit. `held` marks unknowns that rest on bounds. `rules` holds the
/// pattern of the rule of each unknown with a prior. `noise_factor` is the ratio of the noise
/// variance that the fit assumed to the declared one.
pub(in crate::fit) fn refuted_priors(
    stage: &Stage,
    at: &DVector<f64>,
    held: &[bool],
    rules: &[Option<String>],
    noise_factor: f64,
) -> Vec<RefutedPrior> {
    if noise_factor < MIN_NOISE_FACTOR || stage.unknowns.len() > MAX_UNKNOWNS {
        return Vec::new();
    }
    let mut names: Vec<&String> = rules.iter().flatten().collect();
    names.sort();
    names.dedup();
    let evidence = Evidence::of(stage, at, held, 4.0 * noise_factor);
    let sigmas = stage.prior_sigmas();
    let widened = |factors: &[f64]| -> Vec<Option<f64>> {
        let factor = |j: usize| {
            let place = names.iter().position(|name| rules[j].as_ref() == Some(name));
            place.map_or(1.0, |place| factors[place])
        };
        sigmas.iter().enumerate().map(|(j, sigma)| Some(sigma.as_ref()? * factor(j))).collect()
    };
    let mut factors = vec![1.0; names.len()];
    let Some(declared) = evidence.best(&widened(&factors)) else { return Vec::new() };
    // Widening all rules together gives the smallest noise variance. If even that is too large, no
    // selection of rules explains the misfit.
    let widest =
        evidence.best(&widened(&vec![TRIAL_FACTORS[TRIAL_FACTORS.len() - 1]; names.len()]));
    if widest.is_none_or(|best| best.variance > MAX_VARIANCE_RATIO * declared.variance) {
        return Vec::new();
    }
    let mut best = declared;
    let declared_deviance = declared.deviance;
    let mut order = Vec::new();
    // Each pass widens the rule with the largest gain.
    loop {
        let open = (0..names.len()).filter(|place| factors[*place] <= 1.0);
        let trial = |(place, factor): (usize, f64)| {
            let mut trial = factors.clone();
            trial[place] = factor;
            Some((place, factor, evidence.best(&widened(&trial))?))
        };
        let trials = open.flat_map(|place| TRIAL_FACTORS.map(|factor| (place, factor)));
        let next = trials.filter_map(trial).min_by(|a, b| a.2.deviance.total_cmp(&b.2.deviance));
        let Some((place, factor, found)) = next else { break };
        if best.deviance - found.deviance < REJECTION_FACTOR * by_chance() {
            break;
        }
        factors[place] = factor;
        best = found;
        order.push(place);
    }
    // Narrow rules of several kinds can hide each other: one wide rule alone gains little while the
    // others still hold.
    if order.is_empty() {
        let together = |factor: f64| {
            let trial = vec![factor; names.len()];
            let found = evidence.best(&widened(&trial))?;
            Some((trial, found))
        };
        let widest = TRIAL_FACTORS.into_iter().filter_map(together);
        let widest = widest.min_by(|a, b| a.1.deviance.total_cmp(&b.1.deviance));
        if let Some((trial, found)) = widest
            && best.deviance - found.deviance >= REJECTION_FACTOR * by_chance()
        {
            (factors, best) = (trial, found);
            order = (0..names.len()).collect();
        }
        // Each pass gives the σ of the rule with the smallest loss back to the declared one.
        while order.len() > 1 {
            let narrowed = |&place: &usize| {
                let mut trial = factors.clone();
                trial[place] = 1.0;
                Some((place, evidence.best(&widened(&trial))?))
            };
            let next = order.iter().filter_map(narrowed);
            let Some((place, found)) = next.min_by(|a, b| a.1.deviance.total_cmp(&b.1.deviance))
            else {
                break;
            };
            let is_refuted = declared_deviance - found.deviance >= REJECTION_FACTOR * by_chance();
            if found.deviance - best.deviance > by_chance() || !is_refuted {
                break;
            }
            (factors[place], best) = (1.0, found);
            order.retain(|open| *open != place);
        }
    }
    let ratio = best.variance / declared.variance;
    if ratio > MAX_VARIANCE_RATIO || best.variance > MAX_VARIANCE {
        return Vec::new();
    }
    let refuted = |place: usize| RefutedPrior {
        rule: names[place].clone(),
        factor: factors[place],
        sigma_ratio: ratio.sqrt(),
    };
    order.into_iter().map(refuted).collect()
}

/// Noise variance, relative to the declared one, with the largest evidence under given priors, and
/// the deviance −2 ln L there.
#[derive(Debug, Clone, Copy)]
struct Best {
    variance: f64,
    deviance: f64,
}

/// Linearised data from which the evidence of priors and noise variances is computed.
struct Evidence {
    /// Information RᵀR of the data on the free unknowns, shape = (free, free).
    information: DMatrix<f64>,
    /// Vector Rᵀc of the data for the free unknowns: triangular factor R times the projected
    /// residual c.
    vector: DVector<f64>,
    /// Sum ‖r₀‖² of the squared whitened residuals of the nominal arm.
    squares: f64,
    /// Number m of measured coordinates.
    coordinates: f64,
    /// Indices of the free unknowns.
    free: Vec<usize>,
    /// Largest noise variance that is tried, as a multiple of the declared one.
    max_variance: f64,
}

impl Evidence {
    /// Linearises the data of a stage about the full parameter vector `at`.
    fn of(stage: &Stage, at: &DVector<f64>, held: &[bool], max_variance: f64) -> Self {
        let data = stage.linearised(at, Loss::Squares);
        let free: Vec<usize> = (0..held.len()).filter(|&j| !held[j]).collect();
        let mut x = stage.unknowns_in(at);
        (0..held.len()).filter(|&j| held[j]).for_each(|j| x[j] = 0.0);
        let columns = data.triangle.select_columns(&free);
        let at_nominal = &data.projected - &data.triangle * x;
        let unexplained = 2.0 * data.cost - data.projected.norm_squared();
        Self {
            information: columns.tr_mul(&columns),
            vector: columns.tr_mul(&at_nominal),
            squares: unexplained.max(0.0) + at_nominal.norm_squared(),
            coordinates: stage.count() as f64,
            free,
            max_variance,
        }
    }

    /// Returns the noise variance with the largest evidence for priors with these σ. The variance
    /// is relative to the declared one, and at least 1. `None` if no trial variance has an
    /// evidence.
    fn best(&self, sigmas: &[Option<f64>]) -> Option<Best> {
        let step = self.max_variance.ln() / f64::from(TRIAL_VARIANCES - 1);
        let variances = (0..TRIAL_VARIANCES).map(|k| (f64::from(k) * step).exp());
        let of = |variance| Some(Best { variance, deviance: self.deviance(sigmas, variance)? });
        variances.filter_map(of).min_by(|a, b| a.deviance.total_cmp(&b.deviance))
    }

    /// Returns −2 ln L for priors with these σ and a noise variance relative to the declared one;
    /// `None` if the matrix A is singular.
    fn deviance(&self, sigmas: &[Option<f64>], variance: f64) -> Option<f64> {
        let n = self.free.len();
        let precision = |i: usize| match sigmas[self.free[i]] {
            Some(sigma) => sigma.powi(-2),
            None => (FLAT_PRIOR_PRECISION * self.information[(i, i)]).max(f64::MIN_POSITIVE),
        };
        let mut matrix = &self.information / variance;
        (0..n).for_each(|i| matrix[(i, i)] += precision(i));
        let scale: Vec<f64> = (0..n).map(|i| matrix[(i, i)].sqrt().recip()).collect();
        let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * scale[i] * scale[j]);
        let factor = scaled.cholesky()?;
        let right = DVector::from_fn(n, |i, _| self.vector[i] * scale[i]);
        let explained = right.dot(&factor.solve(&right)) / variance;
        let log_matrix: f64 =
            (0..n).map(|i| 2.0 * (factor.l_dirty()[(i, i)].ln() - scale[i].ln())).sum();
        let log_priors: f64 =
            (0..n).filter_map(|i| sigmas[self.free[i]]).map(|sigma| -2.0 * sigma.ln()).sum();
        Some(
            self.coordinates * variance.ln() + log_matrix - log_priors
                + (self.squares - explained) / variance,
        )
    }
}
