//! Possible causes of a change of an arm: what may have moved, and by how much.

use nalgebra::DVector;

use super::column_space::ColumnSpace;
use super::evidence::{NOISE_RATIOS, OTHER_RATIOS, ln_sum};
use super::relocation::is_of_place;
use super::rows::SensitiveRows;
use crate::model::Model;
use crate::model::parameter::{BeamField, JointField, Parameter, ParameterSite};
use crate::problem::{JointKind, Problem};
use crate::quantity::Unit;

/// Prior probability of a trial size of a change, relative to that of the next smaller one. A
/// change of k times the size has k² times the evidence, so large changes are found all the same.
/// Sizes of causes by temperature are equally probable instead.
const LARGER_SIZE_RATIO: f64 = 0.4;
/// Trial sizes of a moved zero of a joint, 1 σ \[°\] or \[mm\], the smallest first.
const ZERO_SIZES: [f64; 4] = [0.01, 0.05, 0.25, 1.2];
/// Trial sizes of a moved target, base or fixture, 1 σ on each axis \[mm\]; rotations \[°\] are a
/// tenth of the number.
const LENGTH_SIZES: [f64; 4] = [0.05, 0.2, 1.0, 5.0];
/// Trial sizes of a bent link: 1 σ of its lengths \[mm\] and of its angles \[°\].
const LINK_SIZES: [(f64, f64); 3] = [(0.05, 0.005), (0.2, 0.02), (1.0, 0.1)];
/// Trial sizes of a change of ln stiffness, 1 σ.
const STIFFNESS_SIZES: [f64; 3] = [0.05, 0.2, 0.7];
/// Trial sizes of a change of a law's parameters, 1 σ as a fraction of the σ of their priors.
const LAW_SIZES: [f64; 3] = [0.05, 0.3, 1.0];
/// Trial sizes of the thermal strain of an arm, 1 σ: steel that is warmer by 3, 10 and 30 K.
const STRAIN_SIZES: [f64; 3] = [3.6e-5, 1.2e-4, 3.6e-4];
/// Trial sizes of the thermal drift of a joint's zero, 1 σ \[rad/K\].
const JOINT_THERMAL_SIZES: [f64; 3] = [1e-6, 5e-6, 3e-5];
/// Temperature difference from the reference \[K\] from which on temperature is a more probable
/// cause.
const MIN_WARMTH: f64 = 3.0;
/// Factor on the prior probability of temperature as the cause, if a row differs from the reference
/// by [`MIN_WARMTH`] or more.
const WARM_FACTOR: f64 = 20.0;

worded! {
    /// Kind of a cause of a change.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum CauseKind: as_str {
        /// Zero of a joint.
        Zero = "joint-zero";
        /// Geometry of a link, except the zero of its joint.
        Link = "link";
        /// Position of a target in the frame of the joint that it is mounted on.
        Tool = "tool";
        /// Pose of the base in the measuring frame.
        Base = "base";
        /// Position or pose of a point, anchor, surface, camera or marker.
        Fixture = "fixture";
        /// Stiffness of a joint or rigidity of a beam.
        Stiffness = "stiffness";
        /// Parameters of an effect or law that the problem declares.
        Law = "law";
        /// Temperature of the arm.
        Temperature = "temperature";
        /// Two of the causes above together.
        Two = "two";
        /// Noise of the measurement.
        Noise = "noise";
        /// Gross error of one row.
        Row = "row";
        /// Mistake in the table, with which the unchanged arm agrees: a unit, sign, order or column.
        Misread = "misread";
        /// Large errors without a pattern, which none of these causes explains.
        Other = "other";
    }
}

impl CauseKind {
    /// Kinds with the prior probability of each, given that something changed. Collisions and
    /// exchanged motors move zeros, so zeros have half of the probability.
    const WEIGHTS: [(Self, f64); 11] = [
        (Self::Zero, 0.50),
        (Self::Tool, 0.18),
        (Self::Base, 0.08),
        (Self::Link, 0.04),
        (Self::Noise, 0.05),
        (Self::Row, 0.05),
        (Self::Stiffness, 0.04),
        (Self::Temperature, 0.03),
        (Self::Law, 0.02),
        (Self::Fixture, 0.01),
        (Self::Other, 0.01),
    ];

    /// Returns true for a move of a base, a tool or a fixture.
    pub(super) fn is_placement(self) -> bool {
        matches!(self, Self::Base | Self::Fixture | Self::Tool)
    }

    /// Returns the largest ratio of the errors to the assumed noise that is tried for the cause;
    /// `None` for a cause without such a ratio.
    pub(crate) fn largest_ratio(self) -> Option<f64> {
        match self {
            Self::Noise => NOISE_RATIOS.last().copied(),
            Self::Other => OTHER_RATIOS.last().copied(),
            _ => None,
        }
    }
}

/// Trial size of a change.
#[derive(Debug, Clone)]
pub(super) struct Trial {
    /// Prior standard deviation (1 σ) of each amplitude.
    pub sigmas: Vec<f64>,
    /// Logarithm of the prior probability among the trials of the cause.
    pub ln_prior: f64,
}

/// Returns trials of these sizes, the smallest first. Each is `larger` times as probable as the
/// next smaller one, and the probabilities sum to 1.
fn trials(sizes: impl IntoIterator<Item = Vec<f64>>, larger: f64) -> Vec<Trial> {
    let sizes: Vec<Vec<f64>> = sizes.into_iter().collect();
    let sum: f64 = (0..sizes.len()).map(|size| larger.powf(size as f64)).sum();
    let ln_prior = |size: usize| size as f64 * larger.ln() - sum.ln();
    let of_size = |(size, sigmas)| Trial { sigmas, ln_prior: ln_prior(size) };
    sizes.into_iter().enumerate().map(of_size).collect()
}

/// Possible cause of a change.
#[derive(Debug, Clone)]
pub(super) struct Cause {
    pub kind: CauseKind,
    /// Name for people, such as "zero of joint 2".
    pub label: String,
    /// Columns of the sensitivities that the cause moves.
    pub columns: Vec<usize>,
    /// Parameters that each of these columns moves together, with the change of each for a unit
    /// amplitude, the root mean square over the rows.
    pub terms: Vec<Vec<(usize, f64)>>,
    /// Name and unit of each amplitude.
    pub amplitudes: Vec<(String, Unit)>,
    /// Trials, one for each size of a change.
    pub trials: Vec<Trial>,
    /// Logarithm of the prior probability, given that something changed.
    pub ln_weight: f64,
}

/// Model with a free parameter at every site that may have changed.
pub(super) struct Extended {
    pub model: Model,
    /// Full parameter vector of that model.
    pub x: DVector<f64>,
    /// Number of parameters of the model without the added ones.
    pub declared: usize,
    /// Names of the added parameters.
    names: Vec<String>,
}

impl Extended {
    /// Adds a parameter for each geometric field of a moving joint, and for each coordinate of a
    /// base or target, that is not free in `model`. `x` is the full parameter vector of `model`,
    /// and `words` are the names of the bases, then of the targets.
    pub fn new(problem: &Problem, model: &Model, x: &DVector<f64>, words: [&[String]; 2]) -> Self {
        let mut sites: Vec<(ParameterSite, f64, String)> = Vec::new();
        let mut add = |site, nominal, name: String| {
            let is_free =
                |parameter: &Parameter| parameter.site == site && parameter.regressor.is_constant();
            if !model.parameters.iter().any(is_free) {
                sites.push((site, nominal, name));
            }
        };
        for (joint, declared) in problem.joints.iter().enumerate() {
            if declared.kind == JointKind::Fixed || declared.mimic.is_some() {
                continue;
            }
            for field in JointField::GEOMETRY {
                let name = format!("joint{}.{}", joint + 1, field.name());
                add(ParameterSite::Joint { joint, field }, 0.0, name);
            }
        }
        for (what, words, axes) in [("base", words[0], 6), ("tool", words[1], 3)] {
            for (place, word) in words.iter().enumerate() {
                for axis in 0..axes {
                    let site = if what == "base" {
                        ParameterSite::Base { base: place, axis }
                    } else {
                        ParameterSite::Target { target: place, axis }
                    };
                    let label =
                        if word.is_empty() { what.to_owned() } else { format!("{what}[{word}]") };
                    let suffix = ["x", "y", "z", "rx", "ry", "rz"][axis];
                    add(site, 0.0, format!("{label}.{suffix}"));
                }
            }
        }
        let probes: Vec<(ParameterSite, f64)> =
            sites.iter().map(|&(site, nominal, _)| (site, nominal)).collect();
        let extended = model.with_probes(&probes);
        let x =
            DVector::from_fn(extended.parameters.len(), |k, _| x.get(k).copied().unwrap_or(0.0));
        let names = sites.into_iter().map(|(.., name)| name).collect();
        Self { declared: model.parameters.len(), model: extended, x, names }
    }

    /// Returns the name of a parameter.
    fn name(&self, k: usize) -> String {
        match k.checked_sub(self.declared) {
            Some(added) => self.names[added].clone(),
            None => self.model.parameters[k].name.clone(),
        }
    }

    /// Returns the unit of a parameter's deviation.
    fn unit(&self, k: usize) -> Unit {
        if k < self.declared {
            self.model.parameters[k].unit()
        } else {
            self.model.parameters[k].site.unit()
        }
    }

    /// Lists the causes for rows of this model, with their prior probabilities. `warmth` is the
    /// difference of each row from the reference temperature \[K\], if the rows state temperatures.
    /// Columns for thermal causes are added to `rows`.
    pub fn causes(
        &self,
        problem: &Problem,
        rows: &mut SensitiveRows,
        warmth: Option<&[f64]>,
    ) -> Vec<Cause> {
        let mut causes = Vec::new();
        let of = |choose: &dyn Fn(ParameterSite, &Parameter) -> bool| -> Vec<usize> {
            let all = self.model.parameters.iter().enumerate();
            all.filter(|(_, parameter)| choose(parameter.site, parameter)).map(|(k, _)| k).collect()
        };
        let mut push = |kind, label: String, columns: Vec<usize>, sizes: Vec<Vec<f64>>| {
            if !columns.is_empty() {
                let amplitudes = columns.iter().map(|&k| (self.name(k), self.unit(k))).collect();
                let (trials, ln_weight) = (trials(sizes, LARGER_SIZE_RATIO), 0.0);
                let terms = columns.iter().map(|&k| vec![(k, 1.0)]).collect();
                causes.push(Cause { kind, label, columns, terms, amplitudes, trials, ln_weight });
            }
        };
        let mixed = |columns: &[usize], length_mm: f64, angle_deg: f64| -> Vec<f64> {
            let size = |&k: &usize| match self.unit(k) {
                Unit::Angle => angle_deg.to_radians(),
                _ => length_mm * 1e-3,
            };
            columns.iter().map(size).collect()
        };
        let is_geometry = |k: usize, joint: usize, is_zero: bool| {
            let added = k >= self.declared;
            let parameter = &self.model.parameters[k];
            let ParameterSite::Joint { joint: of, field } = parameter.site else { return false };
            let zero = match problem.joints[joint].kind {
                JointKind::Prismatic => JointField::D,
                _ => JointField::Theta,
            };
            of == joint
                && field.is_geometry()
                && (added || parameter.regressor.is_constant())
                && (field == zero) == is_zero
        };
        let count = self.model.parameters.len();
        for joint in 0..problem.joints.len() {
            let chosen = |is_zero| -> Vec<usize> {
                (0..count).filter(|&k| is_geometry(k, joint, is_zero)).collect()
            };
            let (zero, link) = (chosen(true), chosen(false));
            if problem.joints[joint].kind != JointKind::Fixed {
                let sizes = ZERO_SIZES.iter().map(|&size| mixed(&zero, size, size)).collect();
                push(CauseKind::Zero, format!("zero of joint {}", joint + 1), zero, sizes);
            }
            let sizes = LINK_SIZES.iter().map(|&(mm, deg)| mixed(&link, mm, deg)).collect();
            push(CauseKind::Link, format!("link of joint {}", joint + 1), link, sizes);
        }
        let is_stiff = |site, _: &Parameter| match site {
            ParameterSite::Joint { field, .. } => field == JointField::Stiffness,
            ParameterSite::Beam { field, .. } => matches!(
                field,
                BeamField::Axial
                    | BeamField::Bending
                    | BeamField::BendingY
                    | BeamField::BendingZ
                    | BeamField::Twist
            ),
            _ => false,
        };
        for k in of(&is_stiff) {
            let sizes = STIFFNESS_SIZES.iter().map(|&size| vec![size]).collect();
            push(CauseKind::Stiffness, self.name(k), vec![k], sizes);
        }
        let label =
            |k: usize| self.name(k).rsplit_once('.').map_or(String::new(), |n| n.0.to_owned());
        let mut grouped = |kind, columns: Vec<usize>, sizes: &dyn Fn(&[usize]) -> Vec<Vec<f64>>| {
            let mut labels: Vec<String> = columns.iter().map(|&k| label(k)).collect();
            labels.sort();
            labels.dedup();
            for name in labels {
                let group: Vec<usize> =
                    columns.iter().copied().filter(|&k| label(k) == name).collect();
                let tried = sizes(&group);
                push(kind, name, group, tried);
            }
        };
        let placed = |group: &[usize]| -> Vec<Vec<f64>> {
            LENGTH_SIZES.iter().map(|&size| mixed(group, size, size / 10.0)).collect()
        };
        grouped(
            CauseKind::Tool,
            of(&|site, _| matches!(site, ParameterSite::Target { .. })),
            &placed,
        );
        grouped(
            CauseKind::Base,
            of(&|site, _| matches!(site, ParameterSite::Base { .. })),
            &placed,
        );
        grouped(CauseKind::Fixture, of(&is_place_of_fixture), &placed);
        let is_law = |site: ParameterSite, parameter: &Parameter| {
            let is_of_arm = matches!(site, ParameterSite::Joint { field, .. } if field.is_geometry())
                && parameter.regressor.is_constant();
            parameter.sigma.is_some()
                && !is_of_arm
                && !is_stiff(site, parameter)
                && !site.is_placement()
        };
        let laws: Vec<usize> = of(&is_law).into_iter().filter(|&k| k < self.declared).collect();
        grouped(CauseKind::Law, laws, &|group| {
            let sigma = |k: &usize| self.model.parameters[*k].sigma.unwrap_or(0.0);
            LAW_SIZES.iter().map(|part| group.iter().map(|k| part * sigma(k)).collect()).collect()
        });
        causes.extend(self.thermal_causes(problem, rows, warmth));
        let none = |kind, label: &str| Cause {
            kind,
            label: label.to_owned(),
            columns: Vec::new(),
            terms: Vec::new(),
            amplitudes: Vec::new(),
            trials: Vec::new(),
            ln_weight: 0.0,
        };
        causes.push(none(
            CauseKind::Noise,
            "larger errors without a pattern (noise, or several changes at once)",
        ));
        causes.push(none(CauseKind::Row, "one gross row"));
        causes.push(none(CauseKind::Other, "something else"));
        set_prior_probabilities(&mut causes, warmth);
        self.merged_held_causes(causes, rows)
    }

    /// Returns true if a cause moves parameters, all of which the model holds.
    pub fn is_held(&self, cause: &Cause) -> bool {
        !cause.columns.is_empty() && !self.has_free_parameter(cause)
    }

    /// Returns true if a cause moves a parameter that the model frees.
    fn has_free_parameter(&self, cause: &Cause) -> bool {
        cause.terms.iter().flatten().any(|&(k, _)| k < self.declared)
    }

    /// Returns the causes without those whose parameters are all held, if the moves of a placement
    /// with free parameters are exactly theirs. The placement gets the prior probability of that
    /// cause, because the rows cannot distinguish the two. With pixels alone, for example, a held
    /// base and a free board in the world are one unknown.
    fn merged_held_causes(&self, mut causes: Vec<Cause>, rows: &SensitiveRows) -> Vec<Cause> {
        let spaces: Vec<(usize, ColumnSpace)> = causes
            .iter()
            .enumerate()
            .filter(|(_, cause)| cause.kind.is_placement() && self.has_free_parameter(cause))
            .map(|(place, cause)| (place, ColumnSpace::new(rows, &cause.columns)))
            .collect();
        let mut merged: Vec<(usize, usize)> = Vec::new();
        for (held, cause) in causes.iter().enumerate().filter(|(_, cause)| self.is_held(cause)) {
            let held_space = ColumnSpace::new(rows, &cause.columns);
            let is_twin = |space: &ColumnSpace| {
                space.basis.ncols() == held_space.basis.ncols()
                    && space.contains(rows, &cause.columns)
            };
            let twin = spaces.iter().find(|(_, space)| is_twin(space));
            merged.extend(twin.map(|(place, _)| (held, *place)));
        }
        for &(held, twin) in &merged {
            causes[twin].ln_weight = ln_sum([causes[twin].ln_weight, causes[held].ln_weight]);
        }
        let mut place = 0;
        causes.retain(|_| {
            place += 1;
            merged.iter().all(|(held, _)| *held != place - 1)
        });
        causes
    }

    /// Lists the causes by temperature: all links expand and, if the rows state temperatures, the
    /// zero of a joint moves with them. The list is empty if no row is 1 K or more from the
    /// reference.
    fn thermal_causes(
        &self,
        problem: &Problem,
        rows: &mut SensitiveRows,
        warmth: Option<&[f64]>,
    ) -> Vec<Cause> {
        let column = |joint: usize, field: JointField| {
            let site = ParameterSite::Joint { joint, field };
            let mut all = self.model.parameters.iter().enumerate();
            all.find(|(k, parameter)| {
                parameter.site == site && (*k >= self.declared || parameter.regressor.is_constant())
            })
            .map(|(k, _)| k)
        };
        let lengths = problem.joints.iter().enumerate().flat_map(|(joint, declared)| {
            [(JointField::A, declared.a), (JointField::D, declared.d)]
                .into_iter()
                .filter_map(move |(field, length)| Some((column(joint, field)?, length)))
        });
        let lengths: Vec<(usize, f64)> = lengths.filter(|(_, length)| *length != 0.0).collect();
        let of_row = |row: usize| warmth.map_or(1.0, |warmth| warmth[row]);
        let is_warm = warmth.is_none_or(|warmth| warmth.iter().any(|t| t.abs() >= 1.0));
        if lengths.is_empty() || !is_warm {
            return Vec::new();
        }
        // The sizes are strains. If the rows state temperatures, the amplitude is a strain per
        // kelvin, and its sizes are the strains divided by 10 K.
        let (unit, part) = match warmth {
            Some(_) => (Unit::PerDegree, 0.1),
            None => (Unit::Ratio, 1.0),
        };
        // Terms hold the root mean square change of a parameter over the rows, because the mean of
        // rows above and below the reference may be 0.
        let mean_square =
            |warmth: &[f64]| warmth.iter().map(|t| t * t).sum::<f64>() / warmth.len() as f64;
        let warmth_of_rows = warmth.map_or(1.0, |warmth| mean_square(warmth).sqrt());
        let thermal =
            |label: String, (column, terms): (usize, &[_]), amplitude, sizes: &[f64]| Cause {
                kind: CauseKind::Temperature,
                label,
                columns: vec![column],
                terms: vec![
                    terms.iter().map(|&(k, factor)| (k, warmth_of_rows * factor)).collect(),
                ],
                amplitudes: vec![amplitude],
                trials: trials(sizes.iter().map(|&size| vec![size]), 1.0),
                ln_weight: 0.0,
            };
        let all = rows.add_column(&lengths, of_row);
        let sizes = STRAIN_SIZES.map(|size| part * size);
        let expansion = ("strain of all links".to_owned(), unit);
        let mut causes = vec![thermal(
            "all links expand with temperature".to_owned(),
            (all, &lengths),
            expansion,
            &sizes,
        )];
        for joint in (0..problem.joints.len()).filter(|_| warmth.is_some()) {
            let Some(zero) = column(joint, JointField::Theta) else { continue };
            let moved = [(zero, 1.0)];
            let column = rows.add_column(&moved, of_row);
            let number = joint + 1;
            let amplitude = (format!("joint{number}.theta per kelvin"), Unit::AnglePerDegree);
            let label = format!("zero of joint {number} drifts with temperature");
            causes.push(thermal(label, (column, &moved), amplitude, &JOINT_THERMAL_SIZES));
        }
        causes
    }
}

/// Returns true if a parameter belongs to the pose of a camera or marker, or to another fixture.
fn is_place_of_fixture(site: ParameterSite, parameter: &Parameter) -> bool {
    matches!(site, ParameterSite::Fixture { .. }) && is_of_place(parameter)
}

/// Sets the prior probabilities of the causes; they sum to 1.
fn set_prior_probabilities(causes: &mut [Cause], warmth: Option<&[f64]>) {
    let is_warm = warmth.is_some_and(|warmth| warmth.iter().any(|t| t.abs() >= MIN_WARMTH));
    let count = |kind| causes.iter().filter(|cause| cause.kind == kind).count() as f64;
    let weight = |kind: CauseKind| {
        let all =
            CauseKind::WEIGHTS.iter().find(|(of, _)| *of == kind).map_or(0.0, |entry| entry.1);
        // The thermal causes of a warm arm must compete with moved zeros, which are more probable.
        let factor = if kind == CauseKind::Temperature && is_warm { WARM_FACTOR } else { 1.0 };
        factor * all / count(kind).max(1.0)
    };
    let weights: Vec<f64> = causes.iter().map(|cause| weight(cause.kind)).collect();
    let sum: f64 = weights.iter().sum();
    for (cause, weight) in causes.iter_mut().zip(weights) {
        cause.ln_weight = (weight / sum).ln();
    }
}
