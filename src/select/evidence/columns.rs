//! Columns of the hypotheses: derivatives of every whitened residual by their coefficients.

use crate::select::settings::{SLOW_LENGTH, SMOOTH_LENGTHS, SURFACE_LENGTH};
use nalgebra::{DMatrix, DVector};

use super::block::Design;
use super::candidate::{Candidate, scaled_to_equal_length};
use super::families::{Families, OtherHypotheses, ln_family, share};
use super::functions::{
    SampledCovariate, are_combined, expand, merge, products_of, scaled_functions,
};
use super::hypothesis::Hypothesis;
use super::marginal::Coefficients;
use super::sites::{acts_along_axes, geometry_sites};
use crate::laws::Quantity;
use crate::model::Pose;
use crate::model::effect::Term;
use crate::model::parameter::{JointField, ParameterSite};
use crate::problem::{Effect, JointKind, Observation, Problem};
use crate::residual_tests::Covariate;
use crate::select::neighbourhood::{Linearised, tries};

/// Largest displacement of the target by noise, in units of σ, between touches of the same point.
const MAX_NOISE_DISPLACEMENT: f64 = 3.0;
/// Number of candidate indices ([`Candidate::variant`]) reserved for the functions of each load.
const VARIANTS_PER_LOAD: usize = 4;
/// Command error \[rad\] or \[m\], caused by 1 σ of a contact, above which the contact does not
/// determine the command.
const MIN_UNDETERMINED_COMMAND: f64 = 0.02;

/// Builder of all hypotheses about a residual, with their columns.
pub(super) struct Columns<'a, 'l> {
    pub problem: &'a Problem,
    pub linearised: &'a Linearised<'l>,
    /// Two flags: directions of approach are recorded; times are recorded.
    pub coverage: (bool, bool),
    /// True if the harmonics of all joints may have a common prior.
    pub admits_common_prior: bool,
    /// Number of poses on which evidence is evaluated, the first ones. At the other poses,
    /// functions are only predicted.
    pub evidence_poses: usize,
    /// Only hypotheses whose functions are built; `None` builds all.
    only: Option<&'a [Hypothesis]>,
    /// Candidates built so far; their prior probabilities are set last.
    pub candidates: Vec<Candidate>,
    /// For each candidate, its family and its prior weight relative to the others of the family.
    shares: Vec<(String, f64)>,
    /// Effects that displace no pose.
    unseen: Vec<Effect>,
    /// Covariates on which the functions depend.
    pub covariates: Vec<SampledCovariate>,
}

impl<'a, 'l> Columns<'a, 'l> {
    /// Builds the candidates: effects with their columns, and functions without a law; if `only` is
    /// given, only the functions of these hypotheses.
    ///
    /// Returns the candidates, the covariates of the functions, ln of the prior probability of one
    /// family of effects, and the properties of all hypotheses on which the prior of one depends.
    pub fn all(
        problem: &'a Problem,
        linearised: &'a Linearised<'l>,
        (coverage, admits_common_prior, evidence_poses): ((bool, bool), bool, usize),
        effects: &[(Effect, DMatrix<f64>)],
        only: Option<&'a [Hypothesis]>,
    ) -> (Vec<Candidate>, Vec<SampledCovariate>, f64, OtherHypotheses) {
        let measured = (coverage, admits_common_prior, evidence_poses);
        let mut new_columns = Self::new(problem, linearised, measured, only);
        new_columns.add_effects(effects);
        new_columns.add_functions();
        new_columns.into_candidates()
    }

    /// Builds the functions of the hypotheses `only`, with the prior probabilities that they have
    /// among `families`.
    pub fn functions(
        problem: &'a Problem,
        linearised: &'a Linearised<'l>,
        measured: ((bool, bool), bool, usize),
        (only, families): (&'a [Hypothesis], &Families),
    ) -> Vec<Candidate> {
        let mut new_columns = Self::new(problem, linearised, measured, Some(only));
        new_columns.add_functions();
        new_columns.candidates_among(families)
    }

    fn new(
        problem: &'a Problem,
        linearised: &'a Linearised<'l>,
        (coverage, admits_common_prior, evidence_poses): ((bool, bool), bool, usize),
        only: Option<&'a [Hypothesis]>,
    ) -> Self {
        Self {
            problem,
            linearised,
            coverage,
            admits_common_prior,
            evidence_poses,
            only,
            candidates: Vec::new(),
            shares: Vec::new(),
            unseen: Vec::new(),
            covariates: Vec::new(),
        }
    }

    /// Adds a function without a law; `share` is its prior weight relative to the others of its
    /// family.
    pub(super) fn add(
        &mut self,
        family: &str,
        share: f64,
        hypothesis: Hypothesis,
        columns: impl FnOnce() -> DMatrix<f64>,
    ) {
        self.add_design(family, share, hypothesis, || Design::Dense(columns()));
    }

    pub(super) fn add_design(
        &mut self,
        family: &str,
        share: f64,
        hypothesis: Hypothesis,
        design: impl FnOnce() -> Design,
    ) {
        if self.only.is_some_and(|only| !only.contains(&hypothesis)) {
            return;
        }
        // A candidate whose columns are zero is not added.
        if let Some(design) = design().scaled(self.evidence_poses) {
            let same = self.candidates.last().filter(|last| last.hypothesis == hypothesis);
            let variant = same.map_or(0, |last| last.variant + 1);
            let coefficients = Coefficients::default();
            self.candidates.push(Candidate {
                hypothesis,
                variant,
                design,
                ln_prior: 0.0,
                coefficients,
            });
            // The leading space distinguishes this family from families of effects.
            self.shares.push((format!(" {family}"), share));
        }
    }

    /// Adds one function of a hypothesis under the index `variant`. The index is fixed, whether or
    /// not the other functions exist.
    pub(super) fn add_variant(
        &mut self,
        family: &str,
        hypothesis: &Hypothesis,
        variant: usize,
        columns: impl FnOnce() -> DMatrix<f64>,
    ) {
        let count_before = self.candidates.len();
        self.add(family, 1.0, hypothesis.clone(), columns);
        if let Some(candidate) = self.candidates.get_mut(count_before) {
            candidate.variant = variant;
        }
    }

    fn add_effects(&mut self, effects: &[(Effect, DMatrix<f64>)]) {
        let only: Vec<Effect> = effects.iter().map(|(effect, _)| effect.clone()).collect();
        let (tries, _) = tries(&only, self.problem);
        for ((effect, columns), tries) in effects.iter().zip(tries) {
            let measured = (self.coverage, self.evidence_poses);
            match candidate_of(effect, columns.clone(), self.problem, measured) {
                Some(candidate) => {
                    self.candidates.push(candidate);
                    let share = share(effect, tries, self.problem);
                    self.shares.push((effect.name().to_owned(), share));
                }
                None => self.unseen.push(effect.clone()),
            }
        }
    }

    fn add_functions(&mut self) {
        let (recorded, loads) = (self.recorded_covariates(), self.loads());
        // The shortest length is used only for the coordinates that joints move, because it needs
        // many poses.
        let lengths = SMOOTH_LENGTHS;
        for site in geometry_sites(self.problem) {
            let Some(at) = self.linearised.column_at(site) else { continue };
            let moving = self.is_command_coordinate(site);
            let (family, lengths_here) =
                if moving { ("smooth", &lengths[..]) } else { ("smooth elsewhere", &lengths[..2]) };
            for of in &recorded {
                self.add_smooth(family, (site, &[&at]), of, (lengths_here, 0));
            }
            for (load, of) in &loads {
                self.add_smooth(
                    family,
                    (site, &[&at]),
                    of,
                    (&lengths[..2], load * VARIANTS_PER_LOAD),
                );
            }
            if moving {
                self.add_surfaces(site, &at, &recorded);
                self.add_scaled(site, &at, &recorded);
                self.add_per_pose(site, &at);
                if let ParameterSite::Joint { joint, .. } = site {
                    self.add_near_harmonics(site, &at, joint);
                    self.add_periodic_errors(site, &at, joint);
                }
            }
        }
        self.add_measurement_functions(&recorded);
        self.add_base_rotations(&recorded);
        self.add_link_functions(&recorded);
        self.add_repeats();
        self.add_sag();
        self.covariates.extend(recorded);
    }

    /// Returns true if a parameter site is the coordinate that a joint's command moves: θ or, for a
    /// prismatic joint, d.
    fn is_command_coordinate(&self, site: ParameterSite) -> bool {
        let ParameterSite::Joint { joint, field } = site else { return false };
        match self.problem.joints[joint].kind {
            JointKind::Revolute => field == JointField::Theta,
            JointKind::Prismatic => field == JointField::D,
            JointKind::Fixed => false,
        }
    }

    /// Returns the recorded quantities that vary, such as commands, temperature, loads and time,
    /// with their values in every pose.
    fn recorded_covariates(&self) -> Vec<SampledCovariate> {
        let poses = self.linearised.poses();
        let joints = &self.problem.joints;
        let moving: Vec<usize> =
            (0..joints.len()).filter(|&joint| joints[joint].takes_command()).collect();
        let mut covariates: Vec<(Covariate, Vec<f64>)> =
            moving.iter().map(|&joint| (Covariate::Command(joint), self.command(joint))).collect();
        let mut add = |covariate: Covariate, of: &dyn Fn(&Pose) -> Option<f64>| {
            let values: Option<Vec<f64>> = poses.iter().map(of).collect();
            covariates.extend(values.map(|values| (covariate, values)));
        };
        add(Covariate::Temperature, &|pose| pose.setup.temperature.copied());
        add(Covariate::Payload, &|pose| pose.setup.payload.copied());
        add(Covariate::Hoist, &|pose| pose.setup.hoist.copied());
        for which in 0..self.problem.data.covariates.len() {
            let covariate = Covariate::declared(which, self.problem);
            add(covariate, &|pose| pose.setup.covariates.get(which).copied());
        }
        // Times count from the first pose of all sessions, because structure may continue from one
        // session to the next.
        let first = poses.iter().map(|pose| pose.setup.time).fold(f64::INFINITY, f64::min);
        add(Covariate::time(self.coverage.1), &|pose| Some(pose.setup.time - first));
        for joint in moving {
            add(Covariate::Approach(joint), &|pose| pose.setup.approach.map(|all| all[joint]));
        }
        let sampled = covariates.into_iter();
        sampled.filter_map(|(covariate, values)| self.sampled(covariate, values)).collect()
    }

    /// Returns a covariate with its values in every pose; `None` if it does not vary.
    pub(super) fn sampled(
        &self,
        covariate: Covariate,
        values: Vec<f64>,
    ) -> Option<SampledCovariate> {
        SampledCovariate::new(covariate, values, self.evidence_poses)
    }

    /// Returns the columns of three coordinates, such as those of a displacement along x, y and z;
    /// `None` unless all were computed.
    pub(super) fn columns_at(
        &self,
        site: impl Fn(usize) -> ParameterSite,
    ) -> Option<Vec<DVector<f64>>> {
        (0..3).map(|axis| self.linearised.column_at(site(axis))).collect()
    }

    /// Returns a joint's command in every pose, as the argument of functions of the command.
    ///
    /// In contacts the noise is in the command, not in the measured quantity. If the target cannot
    /// reach the point without the joint, the joint's commands at one point differ by noise alone.
    /// A function of these commands would fit the noise, so they are replaced by their mean.
    pub(super) fn command(&self, joint: usize) -> Vec<f64> {
        let poses = self.linearised.poses();
        let mut values: Vec<f64> =
            poses.iter().map(|pose| pose.setup.configuration[joint]).collect();
        let coordinate = match self.problem.joints[joint].kind {
            JointKind::Prismatic => JointField::D,
            _ => JointField::Theta,
        };
        let Some(at) = self.linearised.column_at(ParameterSite::Joint { joint, field: coordinate })
        else {
            return values;
        };
        // The column of the coordinate is in σ per rad or m.
        let square = |pose: usize| at.rows(3 * pose, 3).norm_squared();
        let is_contact = |pose: &Pose| {
            matches!(pose.observation, Observation::Point(_) | Observation::Surface(_))
        };
        let contacts: Vec<usize> =
            (0..poses.len()).filter(|&k| is_contact(&poses[k]) && square(k) > 0.0).collect();
        let lever = (contacts.iter().map(|&k| square(k)).sum::<f64>()
            / contacts.len().max(1) as f64)
            .sqrt();
        if MAX_NOISE_DISPLACEMENT < MIN_UNDETERMINED_COMMAND * lever {
            merge(&mut values, contacts, MAX_NOISE_DISPLACEMENT / lever);
        }
        values
    }

    /// Returns the moment of the loads about each joint's axis and about its α axis, in every pose.
    /// The moment is the displacement by a compliance there divided by the displacement by an
    /// angle. The index of each moment counts the axes of all joints.
    fn loads(&self) -> Vec<(usize, SampledCovariate)> {
        let pairs = [
            (JointField::Compliance, JointField::Theta),
            (JointField::LateralX, JointField::Alpha),
        ];
        let of = |joint: usize, (gives, turns): (JointField, JointField)| {
            let at = |field| self.linearised.column_at(ParameterSite::Joint { joint, field });
            let (gives, turns) = (at(gives)?, at(turns)?);
            let lever = |k: usize| turns.rows(3 * k, 3).norm_squared();
            let longest = (0..turns.len() / 3).map(lever).fold(0.0, f64::max);
            let moment = |k: usize| {
                let along = gives.rows(3 * k, 3).dot(&turns.rows(3 * k, 3));
                if lever(k) > 1e-12 * longest { along / lever(k) } else { 0.0 }
            };
            let moments = (0..turns.len() / 3).map(moment).collect();
            self.sampled(Covariate::Load, moments).filter(|moment| moment.levels > 3)
        };
        let axes_of_joints =
            (0..self.problem.joints.len()).flat_map(|joint| pairs.map(|pair| (joint, pair)));
        axes_of_joints
            .enumerate()
            .filter_map(|(k, (joint, pair))| Some((k, of(joint, pair)?)))
            .collect()
    }

    /// Returns true if a candidate effect adds a term linear in this covariate at `site` and
    /// depends on nothing else. If the covariate has two values, every function of it is linear.
    fn has_law(&self, site: ParameterSite, of: &SampledCovariate) -> bool {
        let is_line = |term: &Term| {
            let is_linear = matches!(
                term.regressor.as_quantity(),
                Some(Quantity::Warming | Quantity::Elapsed | Quantity::Covariate(_))
            );
            term.site == site && (is_linear || of.levels < 3)
        };
        let acts = |candidate: &Candidate| {
            let effect = candidate
                .hypothesis
                .effect()
                .filter(|_| candidate.hypothesis.depends_on == [of.covariate.clone()]);
            effect.is_some_and(|effect| effect.terms(self.problem).iter().any(is_line))
        };
        self.candidates.iter().any(acts)
    }

    /// Adds smooth functions of one covariate along the columns `at`, one for each of `lengths`.
    /// For covariates other than commands, approaches and loads, adds a straight line, too, unless
    /// an effect is one. Candidate indices begin at `first`.
    pub(super) fn add_smooth(
        &mut self,
        family: &str,
        (site, at): (ParameterSite, &[&DVector<f64>]),
        of: &SampledCovariate,
        (lengths, first): (&[f64], usize),
    ) {
        let hypothesis = Hypothesis::smooth(site, vec![of.covariate.clone()]);
        let [warped, line] = [first + lengths.len(), first + lengths.len() + 1];
        // With few different values, only the longest length is used.
        let usable_lengths = match of.levels {
            ..3 => 0,
            3 => 1,
            _ => lengths.len(),
        };
        for (variant, &length) in lengths.iter().take(usable_lengths).enumerate() {
            self.add_variant(family, &hypothesis, first + variant, || {
                expand(at, &of.basis(length))
            });
        }
        if matches!(of.covariate, Covariate::Time | Covariate::Row) && of.levels > 2 {
            // A settling quantity changes fast at first, so functions of log time are tried, too.
            let range = of.values[..self.evidence_poses].iter().copied().fold(0.0, f64::max);
            let logarithm = of.values.iter().map(|t| (t.max(0.0) + range / 30.0).ln()).collect();
            if let Some(of) = self.sampled(of.covariate.clone(), logarithm) {
                self.add_variant(family, &hypothesis, warped, || expand(at, &of.basis(0.25)));
            }
        }
        // With two different values, every function is a straight line.
        let is_of_arm = matches!(
            of.covariate,
            Covariate::Command(_) | Covariate::Approach(_) | Covariate::Load
        );
        if !is_of_arm && !self.has_law(site, of) {
            let column =
                || expand(at, &DMatrix::from_fn(of.scaled.len(), 1, |row, _| of.scaled[row] - 0.5));
            self.add_variant(family, &hypothesis, line, column);
        }
    }

    /// Adds functions of two covariates: of two commands, of a direction of approach and another
    /// quantity, or of temperature and time, all at `site`.
    fn add_surfaces(
        &mut self,
        site: ParameterSite,
        at: &DVector<f64>,
        recorded: &[SampledCovariate],
    ) {
        for (k, first) in recorded.iter().enumerate() {
            for second in &recorded[k + 1..] {
                if are_combined(&first.covariate, &second.covariate) {
                    self.add_surface("surface", site, &[at], (first, second));
                }
            }
        }
    }

    /// Adds functions of a joint's command whose amplitude is proportional to another quantity,
    /// such as a gear error that grows with temperature or payload.
    fn add_scaled(
        &mut self,
        site: ParameterSite,
        at: &DVector<f64>,
        recorded: &[SampledCovariate],
    ) {
        let ParameterSite::Joint { joint, .. } = site else { return };
        let Some(command) =
            recorded.iter().find(|command| command.covariate == Covariate::Command(joint))
        else {
            return;
        };
        let reference = self.problem.data.reference_temperature;
        for size in recorded.iter().filter(|of| of.may_scale_error(reference)) {
            let (zero, length) = (size.zero(reference), SLOW_LENGTH);
            let hypothesis =
                Hypothesis::smooth(site, vec![command.covariate.clone(), size.covariate.clone()]);
            self.add("surface", 1.0, hypothesis, || {
                expand(&[at], &scaled_functions(command, size, zero, length))
            });
        }
    }

    /// Adds the smooth functions of two covariates along the columns `at`.
    pub(super) fn add_surface(
        &mut self,
        family: &str,
        site: ParameterSite,
        at: &[&DVector<f64>],
        (one, other): (&SampledCovariate, &SampledCovariate),
    ) {
        let mut depends_on = vec![one.covariate.clone(), other.covariate.clone()];
        depends_on.sort();
        let (hypothesis, length) = (Hypothesis::smooth(site, depends_on), SURFACE_LENGTH);
        self.add(family, 1.0, hypothesis, || expand(at, &products_of(&[one, other], length)));
    }

    /// Returns the result of [`Self::all`] once all candidates are added.
    fn into_candidates(mut self) -> (Vec<Candidate>, Vec<SampledCovariate>, f64, OtherHypotheses) {
        let mut families = Families::default();
        for ((family, share), candidate) in self.shares.iter().zip(&self.candidates) {
            families.add(family, *share, candidate.hypothesis.effect());
        }
        let unseen = std::mem::take(&mut self.unseen);
        let covariates = std::mem::take(&mut self.covariates);
        let others = OtherHypotheses { functions: families.functions(), unseen };
        (self.candidates_among(&families), covariates, ln_family(families.weight()), others)
    }

    /// Returns the candidates with the prior probabilities that they have among `families`.
    fn candidates_among(mut self, families: &Families) -> Vec<Candidate> {
        let total_weight = families.weight();
        for (candidate, (family, share)) in self.candidates.iter_mut().zip(&self.shares) {
            candidate.ln_prior = families.ln_prior(family, *share, total_weight);
        }
        self.candidates
    }
}

/// Creates the candidate for an effect from the columns of its parameters, without its prior
/// probability; `None` if it displaces no pose.
pub(super) fn candidate_of(
    effect: &Effect,
    columns: DMatrix<f64>,
    problem: &Problem,
    (coverage, evidence_poses): ((bool, bool), usize),
) -> Option<Candidate> {
    let terms = effect.terms(problem);
    let (design, largest) = scaled_to_equal_length(columns, &terms, evidence_poses)?;
    let coefficients = Coefficients {
        never_negative: terms.iter().map(|term| term.never_negative).collect(),
        alone: acts_along_axes(&terms),
        largest,
    };
    let hypothesis = Hypothesis::of_effect(effect, problem, coverage);
    Some(Candidate { hypothesis, variant: 0, design, ln_prior: 0.0, coefficients })
}
