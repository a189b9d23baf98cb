//! Sufficiency of the poses: do their measured coordinates suffice for the fitted parameters?

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::DVector;

use super::finding::{Finding, FindingCode};
use crate::fit::Placement;
use crate::fit::stages::fitting::Fitting;
use crate::measurement::count_distinct;
use crate::model::Model;
use crate::model::parameter::{Parameter, ParameterSite};
use crate::problem::{Observation, Problem};

/// Number of coordinates of a rigid body: the largest number of independent coordinates that
/// targets on one body have in one pose.
const BODY_COORDINATES: usize = 6;

/// Numbers of different poses and independent coordinates of the identification rows, with findings
/// if they are too few.
pub(in crate::fit) struct PoseSufficiency {
    /// Finding that the identification poses are too few for the unknowns without a prior; `None`
    /// if they suffice.
    pub finding: Option<Finding>,
    /// Finding that the held-out poses are too few for a base or tool that only they use; `None` if
    /// they suffice.
    pub held_out: Option<Finding>,
    /// Number of measured coordinates that are independent of each other.
    pub coordinates: usize,
    /// Number of different poses of the arm among the identification rows; several targets in one
    /// pose count once.
    pub poses: usize,
    /// True if several targets, or several quantities such as the points of an image, are measured
    /// in one pose of the arm.
    pub several_targets: bool,
}

impl PoseSufficiency {
    /// Examines the poses of a fit of `unknowns`, linearised at the full parameter vector `at`.
    pub fn new(
        fitting: &Fitting,
        problem: &Problem,
        unknowns: &[&Parameter],
        at: &DVector<f64>,
    ) -> Self {
        let Fitting { model, measurements, placement, held_out_only, split, .. } = fitting;
        let numbers = measurements.pose_numbers(problem);
        let of_arm = measurements.arm_pose_numbers(problem);
        let poses = count_distinct(&of_arm, split.identification.iter().copied());
        let turned = if fitting.turn_sigma.is_some() { 3 } else { 0 };
        let of_row = |row: usize| {
            let observation = measurements.observation(row);
            observation.coordinates() + if observation.is_position() { turned } else { 0 }
        };
        let of_row: Vec<usize> = (0..measurements.len()).map(of_row).collect();
        let is_lens = |parameter: &&&Parameter| match parameter.site {
            ParameterSite::Fixture { kind, axis, .. } => kind.word() == "camera" && axis > 5,
            _ => false,
        };
        let lens = unknowns.iter().filter(is_lens).count();
        let coordinates =
            coordinates(fitting, (&numbers, &of_arm), &split.identification, (&of_row, lens));
        let is_open = |parameter: &&&Parameter| {
            parameter.sigma.is_none()
                && !fitting.earlier.is_some_and(|earlier| earlier.covers(&parameter.name))
        };
        let without_prior = unknowns.iter().filter(is_open).count();
        let (rows, later) = (&split.identification, &held_out_only.rows);
        let is_fitted = |k: usize| !held_out_only.parameters[k] && !fitting.is_covered(k);
        let is_held_out = |k: usize| held_out_only.parameters[k];
        let finding = (coordinates < without_prior)
            .then(|| too_few_finding("the fit".to_owned(), coordinates, without_prior))
            .or_else(|| {
                too_few_poses_finding(
                    (model, placement),
                    (&numbers, &of_row),
                    (rows, false),
                    is_fitted,
                )
            })
            .or_else(|| undetermined_base_finding(fitting, &numbers, rows, at, is_fitted));
        // A held-out session gives no information on the arm, whatever its points determine.
        let held_out = too_few_poses_finding(
            (model, placement),
            (&numbers, &of_row),
            (later, true),
            is_held_out,
        )
        .or_else(|| undetermined_base_finding(fitting, &numbers, later, at, is_held_out))
        .map(|finding| held_out_finding(&finding, placement, (later, &numbers)));
        let several_targets =
            poses < count_distinct(&numbers, split.identification.iter().copied());
        Self { finding, held_out, coordinates, poses, several_targets }
    }

    /// Returns true if the residuals can contradict the declared σ: there are at least as many
    /// independent coordinates as `parameters`, and enough for those without a prior.
    pub fn judges_noise(&self, parameters: usize) -> bool {
        let is_short = |finding: &Finding| finding.code == FindingCode::TooFewEquations;
        self.coordinates >= parameters && !self.finding.as_ref().is_some_and(is_short)
    }
}

/// Converts the `finding` that poses are too few into the one about a base or tool that only
/// held-out rows use. `rows` are these held-out rows, `numbers` the pose numbers of all rows.
fn held_out_finding(
    finding: &Finding,
    placement: &Placement,
    (rows, numbers): (&[usize], &[usize]),
) -> Finding {
    let text = format!("held-out rows of {}; their errors say little", finding.text);
    let of = finding.value("of").cloned().unwrap_or_default();
    let is_of = |row: &usize| {
        let base = label("base", &placement.bases[placement.base_of(*row)]);
        let tool = label("tool", &placement.targets[placement.target_of(*row)]);
        of == base.as_str() || of == tool.as_str()
    };
    let poses = count_distinct(numbers, rows.iter().copied().filter(is_of));
    let numbers = [of, poses.into()];
    Finding::new(FindingCode::HeldOutBaseNotDetermined, numbers, text)
}

/// Creates the finding that the whole fit, a base or a tool (`of`) has fewer measured coordinates
/// than parameters without a prior.
fn too_few_finding(of: String, coordinates: usize, parameters: usize) -> Finding {
    let text = format!(
        "{of}: {coordinates} measured coordinates for {parameters} parameters without a prior (a \
         pose measured again adds none)"
    );
    let numbers = [of.into(), coordinates.into(), parameters.into()];
    Finding::new(FindingCode::TooFewEquations, numbers, text)
}

/// Returns the number of independent measured coordinates of `rows`.
///
/// In each pose of a frame that carries targets, the coordinates of its targets are counted, but at
/// most six. If targets on a frame have more than six coordinates, the excess is counted once for
/// the frame, because it determines the relative positions of the targets. Contacts and distances
/// in different poses are added.
///
/// `numbers` and `of_arm` hold the pose number of each row of the table, with and without regard to
/// the target. `of_row` holds the number of coordinates of each row.
fn coordinates(
    fitting: &Fitting,
    (numbers, of_arm): (&[usize], &[usize]),
    rows: &[usize],
    (of_row, lens): (&[usize], usize),
) -> usize {
    let Fitting { model, measurements, placement, .. } = fitting;
    let (positions, others): (Vec<usize>, Vec<usize>) =
        rows.iter().partition(|&&row| measurements.observation(row).is_position());
    // Each point or target is counted with the frame that carries it.
    let mut points: BTreeMap<(usize, usize), BTreeMap<usize, usize>> = BTreeMap::new();
    let mut targets: BTreeMap<usize, BTreeMap<usize, usize>> = BTreeMap::new();
    for &row in &positions {
        let target = placement.target_of(row);
        let carrier = model.target_joint(target);
        points.entry((carrier, of_arm[row])).or_default().insert(numbers[row], of_row[row]);
        targets.entry(carrier).or_default().insert(target, of_row[row]);
    }
    let of_pose = |targets: &BTreeMap<usize, usize>| targets.values().sum::<usize>();
    let of_poses: usize =
        points.values().map(|targets| of_pose(targets).min(BODY_COORDINATES)).sum();
    let several = |carrier: usize| {
        points.iter().any(|(key, targets)| key.0 == carrier && of_pose(targets) > BODY_COORDINATES)
    };
    let contacts: BTreeSet<(usize, Observation)> =
        others.iter().map(|&row| (of_arm[row], measurements.observation(row))).collect();
    let (image_points, contacts): (Vec<_>, Vec<_>) =
        contacts.into_iter().partition(|(_, observation)| observation.point().is_some());
    let of_contacts: usize =
        contacts.iter().map(|(_, observation)| observation.coordinates()).sum();
    let mut images: BTreeMap<(usize, [Option<usize>; 2]), usize> = BTreeMap::new();
    for (pose, observation) in image_points {
        *images.entry((pose, observation.fixtures())).or_default() += observation.coordinates();
    }
    let of_markers: usize = images.values().map(|count| (*count).min(BODY_COORDINATES)).sum();
    let of_lenses = images.values().sum::<usize>().saturating_sub(of_markers).min(lens);
    let of_targets = targets.iter().filter(|(carrier, _)| several(**carrier));
    let of_targets: usize =
        of_targets.map(|(_, shape)| of_pose(shape).saturating_sub(BODY_COORDINATES)).sum();
    of_poses + of_targets + of_contacts + of_markers + of_lenses
}

/// Returns the label of a base or tool: `base[A]`, or `base` for one without a name.
pub(in crate::fit) fn label(what: &str, word: &str) -> String {
    if word.is_empty() { what.to_owned() } else { format!("{what}[{word}]") }
}

/// Returns the finding about the first base whose pose the measured positions of `rows` do not
/// determine; `None` if there is none. Only parameters of bases are considered that have no prior
/// and for whose index `varied` returns true.
fn undetermined_base_finding(
    fitting: &Fitting,
    numbers: &[usize],
    rows: &[usize],
    at: &DVector<f64>,
    varied: impl Fn(usize) -> bool,
) -> Option<Finding> {
    let Fitting { model, placement, .. } = fitting;
    let open = |b: &usize| {
        // Contacts may not determine the pose of a base, which is then reported as an
        // unidentifiable combination.
        let of_base = rows.iter().copied().filter(|&row| placement.base_of(row) == *b);
        let points: Vec<usize> =
            of_base.filter(|&row| fitting.measurements.observation(row).is_position()).collect();
        let counts = |k: &usize| {
            let parameter = &model.parameters[*k];
            let of_base = matches!(parameter.site, ParameterSite::Base { base, .. } if base == *b);
            of_base && parameter.sigma.is_none() && varied(*k)
        };
        let unknowns: Vec<usize> = (0..model.parameters.len()).filter(counts).collect();
        if points.is_empty() || unknowns.is_empty() {
            return false;
        }
        let none = vec![false; unknowns.len()];
        fitting.stage(&points, unknowns).gauge(at, &none, &[]).rows.nrows() > 0
    };
    let base = (0..placement.bases.len()).find(open)?;
    let of_base = rows.iter().copied().filter(|&row| placement.base_of(row) == base);
    let (of, poses) = (label("base", &placement.bases[base]), count_distinct(numbers, of_base));
    let text = format!(
        "{of}: its points, of {poses} different poses, are too few or lie on a line, so that a \
         rotation of the base about it is not determined"
    );
    Some(Finding::new(FindingCode::BaseNotDetermined, [of.into(), poses.into()], text))
}

/// Returns the finding about the first base or target that has fewer coordinates in different poses
/// of `rows` than parameters without a prior; `None` if there is none. Only parameters are counted
/// for whose index `varied` returns true. Targets that only one base uses are counted with that
/// base.
///
/// `numbers` are the pose numbers of all rows, `of_row` their numbers of coordinates. If `judged`
/// is true, one more coordinate is required, so that the errors of the rows are not zero by the
/// fit.
fn too_few_poses_finding(
    (model, placement): (&Model, &Placement),
    (numbers, of_row): (&[usize], &[usize]),
    (rows, judged): (&[usize], bool),
    varied: impl Fn(usize) -> bool,
) -> Option<Finding> {
    let check = |of: String,
                 used: &dyn Fn(usize) -> bool,
                 is_part: &dyn Fn(ParameterSite) -> bool| {
        let apart: BTreeMap<usize, usize> =
            rows.iter().filter(|&&row| used(row)).map(|&row| (numbers[row], of_row[row])).collect();
        let coordinates = apart.values().sum::<usize>();
        let counts = |k: usize| {
            varied(k) && model.parameters[k].sigma.is_none() && is_part(model.parameters[k].site)
        };
        let unknowns = (0..model.parameters.len()).filter(|&k| counts(k)).count();
        let enough = if judged { coordinates > unknowns } else { coordinates >= unknowns };
        (0 < coordinates && 0 < unknowns && !enough)
            .then(|| too_few_finding(of, coordinates, unknowns))
    };
    let base = |b: usize| {
        let alone = |t: usize| {
            rows.iter().all(|&row| placement.target_of(row) != t || placement.base_of(row) == b)
        };
        let is_part = |site| match site {
            ParameterSite::Base { base, .. } => base == b,
            ParameterSite::Target { target, .. } => {
                alone(target) && rows.iter().any(|&row| placement.target_of(row) == target)
            }
            _ => false,
        };
        check(label("base", &placement.bases[b]), &|row| placement.base_of(row) == b, &is_part)
    };
    let target = |t: usize| {
        let is_part = |site| matches!(site, ParameterSite::Target { target, .. } if target == t);
        check(label("tool", &placement.targets[t]), &|row| placement.target_of(row) == t, &is_part)
    };
    let bases = (0..placement.bases.len()).find_map(base);
    bases.or_else(|| (0..placement.targets.len()).find_map(target))
}
