//! Columns of the hypotheses: what each would do to every measured coordinate.

use crate::select::settings::{SLOW_LENGTH, SMOOTH_LENGTHS, SURFACE_LENGTH};
use nalgebra::{DMatrix, DVector};

use super::block::Design;
use super::candidate::{Candidate, even};
use super::families::{Families, OtherHypotheses, ln_family};
use super::functions::{SampledCovariate, goes_with, growing, merge, products_of, times};
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

/// Displacement of the target, in units of σ, up to which a difference between commands that touch
/// the same point may be noise.
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
    pub takes_gears: bool,
    /// Number of poses on which evidence is evaluated, the first ones. At the other poses,
    /// functions are only predicted.
    pub weighed: usize,
    /// Only hypothesis whose functions are built; `None` builds all.
    only: Option<&'a Hypothesis>,
    pub candidates: Vec<Candidate>,
    /// For each candidate, its family and its share of the family's prior probability.
    shares: Vec<(String, f64)>,
    /// Effects that displace no pose.
    unseen: Vec<Effect>,
    /// Covariates on which the functions depend.
    pub covariates: Vec<SampledCovariate>,
}

impl<'a, 'l> Columns<'a, 'l> {
    /// Builds the candidates: effects with their columns, and functions without a law. With `only`,
    /// it builds the functions of that hypothesis alone.
    ///
    /// Returns the candidates, the covariates of the functions, ln of the prior probability of one
    /// family of effects, and what that of a single effect needs to know of the others.
    pub fn all(
        problem: &'a Problem,
        linearised: &'a Linearised<'l>,
        (coverage, takes_gears, weighed): ((bool, bool), bool, usize),
        effects: &[(Effect, DMatrix<f64>)],
        only: Option<&'a Hypothesis>,
    ) -> (Vec<Candidate>, Vec<SampledCovariate>, f64, OtherHypotheses) {
        let (candidates, shares, covariates) = (Vec::new(), Vec::new(), Vec::new());
        let unseen = Vec::new();
        let mut new_columns = Self {
            problem,
            linearised,
            coverage,
            takes_gears,
            weighed,
            only,
            candidates,
            shares,
            unseen,
            covariates,
        };
        new_columns.effects(effects);
        new_columns.functions();
        new_columns.into_candidates()
    }

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
        if self.only.is_some_and(|only| *only != hypothesis) {
            return;
        }
        // The space distinguishes this family from families of effects, whose names never begin
        // with one.
        self.push_candidate(
            &format!(" {family}"),
            share,
            hypothesis,
            design(),
            Coefficients::default(),
        );
    }

    fn push_candidate(
        &mut self,
        family: &str,
        share: f64,
        hypothesis: Hypothesis,
        design: Design,
        coefficients: Coefficients,
    ) {
        if let Some(design) = design.scaled(self.weighed) {
            let same = self.candidates.last().filter(|last| last.hypothesis == hypothesis);
            let variant = same.map_or(0, |last| last.variant + 1);
            self.candidates.push(Candidate {
                hypothesis,
                variant,
                design,
                ln_prior: 0.0,
                coefficients,
            });
            self.shares.push((family.to_owned(), share));
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

    fn effects(&mut self, effects: &[(Effect, DMatrix<f64>)]) {
        let only: Vec<Effect> = effects.iter().map(|(effect, _)| effect.clone()).collect();
        let (tries, _) = tries(&only, self.problem);
        for ((effect, columns), tries) in effects.iter().zip(tries) {
            let measured = (self.coverage, self.weighed);
            match candidate_of(effect, columns.clone(), self.problem, measured) {
                Some(candidate) => {
                    self.candidates.push(candidate);
                    self.shares.push((effect.name().to_owned(), 1.0 / tries));
                }
                None => self.unseen.push(effect.clone()),
            }
        }
    }

    fn functions(&mut self) {
        let (known, loads) = (self.recorded_covariates(), self.loads());
        // The shortest length is used only for the coordinates that joints move, because it needs
        // many poses.
        let lengths = SMOOTH_LENGTHS;
        for site in geometry_sites(self.problem) {
            let Some(at) = self.linearised.place(site) else { continue };
            let moving = self.is_command_coordinate(site);
            let (family, lengths_here) =
                if moving { ("smooth", &lengths[..]) } else { ("smooth elsewhere", &lengths[..2]) };
            for of in &known {
                self.smooth(family, (site, &[&at]), of, (lengths_here, 0));
            }
            for (load, of) in &loads {
                self.smooth(family, (site, &[&at]), of, (&lengths[..2], load * VARIANTS_PER_LOAD));
            }
            if moving {
                self.surfaces(site, &at, &known);
                self.scaled_by(site, &at, &known);
                self.per_pose(site, &at);
                if let ParameterSite::Joint { joint, .. } = site {
                    self.near_harmonics(site, &at, joint);
                    self.gears(site, &at, joint);
                }
            }
        }
        self.measurement(&known);
        self.base(&known);
        self.warming(&known);
        self.repeats();
        self.sag();
        self.covariates.extend(known);
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
        let mut covariates: Vec<(Covariate, Vec<f64>)> = Vec::new();
        let moving = self
            .problem
            .joints
            .iter()
            .enumerate()
            .filter(|(_, joint)| joint.command_kind() != JointKind::Fixed);
        for (joint, _) in moving.clone() {
            covariates.push((Covariate::Command(joint), self.command(joint)));
        }
        for covariate in [Covariate::Temperature, Covariate::Payload, Covariate::Hoist] {
            let of = |pose: &Pose| match covariate {
                Covariate::Temperature => pose.setup.temperature.copied(),
                Covariate::Payload => pose.setup.payload.copied(),
                _ => pose.setup.hoist.copied(),
            };
            covariates.extend(
                poses
                    .iter()
                    .map(of)
                    .collect::<Option<Vec<f64>>>()
                    .map(|values| (covariate, values)),
            );
        }
        for which in 0..self.problem.data.covariates.len() {
            let values = poses.iter().map(|pose| pose.setup.covariates.get(which).copied());
            covariates.extend(
                values
                    .collect::<Option<Vec<f64>>>()
                    .map(|values| (Covariate::declared(which, self.problem), values)),
            );
        }
        // Times count from the first pose of all sessions, because structure may continue from one
        // session to the next.
        let first = poses.iter().map(|pose| pose.setup.time).fold(f64::INFINITY, f64::min);
        covariates.push((
            Covariate::time(self.coverage.1),
            poses.iter().map(|pose| pose.setup.time - first).collect(),
        ));
        for (joint, _) in moving {
            let sides = poses.iter().map(|pose| pose.setup.approach.map(|all| all[joint]));
            covariates.extend(
                sides.collect::<Option<Vec<f64>>>().map(|v| (Covariate::Approach(joint), v)),
            );
        }
        covariates
            .into_iter()
            .filter_map(|(covariate, values)| {
                SampledCovariate::new(covariate, values, self.weighed)
            })
            .collect()
    }

    /// Returns the values of a joint's command in every pose for functions of the command.
    ///
    /// In contacts the noise is in the command, not in the measured quantity. If the target cannot
    /// reach the point without the joint, the joint's commands at one point differ by noise alone.
    /// A function of them would fit the noise, so they are replaced by their mean.
    pub(super) fn command(&self, joint: usize) -> Vec<f64> {
        let poses = self.linearised.poses();
        let mut values: Vec<f64> =
            poses.iter().map(|pose| pose.setup.configuration[joint]).collect();
        let coordinate = match self.problem.joints[joint].kind {
            JointKind::Prismatic => JointField::D,
            _ => JointField::Theta,
        };
        let Some(at) = self.linearised.place(ParameterSite::Joint { joint, field: coordinate })
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
    /// angle. The index of each moment counts all joints and both axes; it does not depend on the
    /// poses.
    fn loads(&self) -> Vec<(usize, SampledCovariate)> {
        let pairs = [
            (JointField::Compliance, JointField::Theta),
            (JointField::LateralX, JointField::Alpha),
        ];
        let of = |joint: usize, (gives, turns): (JointField, JointField)| {
            let at = |field| self.linearised.place(ParameterSite::Joint { joint, field });
            let (gives, turns) = (at(gives)?, at(turns)?);
            let lever = |k: usize| turns.rows(3 * k, 3).norm_squared();
            let longest = (0..turns.len() / 3).map(lever).fold(0.0, f64::max);
            let moment = |k: usize| {
                let along = gives.rows(3 * k, 3).dot(&turns.rows(3 * k, 3));
                if lever(k) > 1e-12 * longest { along / lever(k) } else { 0.0 }
            };
            SampledCovariate::new(
                Covariate::Load,
                (0..turns.len() / 3).map(moment).collect(),
                self.weighed,
            )
            .filter(|known| known.levels > 3)
        };
        let axes_of_joints =
            (0..self.problem.joints.len()).flat_map(|joint| pairs.map(|pair| (joint, pair)));
        axes_of_joints
            .enumerate()
            .filter_map(|(k, (joint, pair))| Some((k, of(joint, pair)?)))
            .collect()
    }

    /// Returns true if a candidate effect adds a term linear in this covariate at `site`, and
    /// depends on nothing else. If the covariate has only two values, every function of it is
    /// linear.
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
    /// Adds a straight line, too, unless an effect is one. The candidate indices begin at `first`.
    pub(super) fn smooth(
        &mut self,
        family: &str,
        (site, at): (ParameterSite, &[&DVector<f64>]),
        of: &SampledCovariate,
        (lengths, first): (&[f64], usize),
    ) {
        let hypothesis = Hypothesis::smooth(site, vec![of.covariate.clone()]);
        let [warped, line] = [first + lengths.len(), first + lengths.len() + 1];
        // With few different values, only the longest length is used.
        let told = match of.levels {
            ..3 => 0,
            3 => 1,
            _ => lengths.len(),
        };
        for (variant, &length) in lengths.iter().take(told).enumerate() {
            self.add_variant(family, &hypothesis, first + variant, || times(at, &of.basis(length)));
        }
        if matches!(of.covariate, Covariate::Time | Covariate::Row) && of.levels > 2 {
            // A settling quantity changes fast at first, so functions of log time are tried, too.
            let range = of.values[..self.weighed].iter().copied().fold(0.0, f64::max);
            let logarithm = of.values.iter().map(|t| (t.max(0.0) + range / 30.0).ln()).collect();
            if let Some(of) = SampledCovariate::new(of.covariate.clone(), logarithm, self.weighed) {
                self.add_variant(family, &hypothesis, warped, || times(at, &of.basis(0.25)));
            }
        }
        // With two different values, every function is a straight line.
        let is_of_arm = matches!(
            of.covariate,
            Covariate::Command(_) | Covariate::Approach(_) | Covariate::Load
        );
        if !is_of_arm && !self.has_law(site, of) {
            let column =
                || times(at, &DMatrix::from_fn(of.scaled.len(), 1, |row, _| of.scaled[row] - 0.5));
            self.add_variant(family, &hypothesis, line, column);
        }
    }

    /// Adds functions of two covariates: of two commands, of a direction of approach and another
    /// quantity, or of temperature and time, all at `site`.
    fn surfaces(&mut self, site: ParameterSite, at: &DVector<f64>, recorded: &[SampledCovariate]) {
        for (k, first) in recorded.iter().enumerate() {
            for second in &recorded[k + 1..] {
                if goes_with(&first.covariate, &second.covariate) {
                    self.surface("surface", site, &[at], (first, second));
                }
            }
        }
    }

    /// Adds functions of a joint's command whose amplitude is proportional to another quantity,
    /// such as a gear error that grows with temperature or payload.
    fn scaled_by(&mut self, site: ParameterSite, at: &DVector<f64>, recorded: &[SampledCovariate]) {
        let ParameterSite::Joint { joint, .. } = site else { return };
        let Some(command) =
            recorded.iter().find(|command| command.covariate == Covariate::Command(joint))
        else {
            return;
        };
        let reference = self.problem.data.reference_temperature;
        for size in recorded.iter().filter(|of| of.is_size(reference)) {
            let (zero, length) = (size.zero(reference), SLOW_LENGTH);
            let hypothesis =
                Hypothesis::smooth(site, vec![command.covariate.clone(), size.covariate.clone()]);
            self.add("surface", 1.0, hypothesis, || {
                times(&[at], &growing(command, size, zero, length))
            });
        }
    }

    pub(super) fn surface(
        &mut self,
        family: &str,
        site: ParameterSite,
        at: &[&DVector<f64>],
        (one, other): (&SampledCovariate, &SampledCovariate),
    ) {
        let mut depends_on = vec![one.covariate.clone(), other.covariate.clone()];
        depends_on.sort();
        let (hypothesis, length) = (Hypothesis::smooth(site, depends_on), SURFACE_LENGTH);
        self.add(family, 1.0, hypothesis, || times(at, &products_of(&[one, other], length)));
    }

    /// Returns the candidates with their prior probabilities, the covariates, ln of the prior
    /// probability of a family of effects, and the weight of the functions without a law.
    fn into_candidates(self) -> (Vec<Candidate>, Vec<SampledCovariate>, f64, OtherHypotheses) {
        let mut families = Families::default();
        for ((family, share), candidate) in self.shares.iter().zip(&self.candidates) {
            families.add(family, *share, candidate.hypothesis.effect());
        }
        let total_weight = families.weight(false);
        let mut candidates = self.candidates;
        for (candidate, (family, share)) in candidates.iter_mut().zip(&self.shares) {
            candidate.ln_prior = families.ln_prior(family, *share, total_weight);
        }
        let weight_of_functions = families.weight(true);
        let others = OtherHypotheses { weight_of_functions, unseen: self.unseen };
        (candidates, self.covariates, ln_family(total_weight), others)
    }
}

/// Creates the candidate for an effect from the columns of its parameters, without its prior
/// probability; `None` if it displaces no pose.
pub(super) fn candidate_of(
    effect: &Effect,
    columns: DMatrix<f64>,
    problem: &Problem,
    (coverage, weighed): ((bool, bool), usize),
) -> Option<Candidate> {
    let terms = effect.terms(problem);
    let (columns, largest) = even(columns, &terms, weighed);
    let coefficients = Coefficients {
        never_negative: terms.iter().map(|term| term.never_negative).collect(),
        alone: acts_along_axes(&terms),
        largest,
    };
    let design = Design::Dense(columns).scaled(weighed)?;
    let hypothesis = Hypothesis::of_effect(effect, problem, coverage);
    Some(Candidate { hypothesis, variant: 0, design, ln_prior: 0.0, coefficients })
}
