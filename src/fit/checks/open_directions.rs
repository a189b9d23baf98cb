//! Texts about the combinations of unknowns that no row determines. Examples are the pose of the
//! base in the measuring frame, the scale, or a focal length and the distance together.
//!
//! The unknowns are grouped by the part that they describe: a joint, base, tool, fixture or lens. A
//! direction of the null space of the data that lies in the unknowns of few groups shows which
//! groups the rows do not determine separately.

use nalgebra::{DMatrix, DVector, RowDVector};
use serde_json::json;

use super::checked_fit::CheckedFit;
use super::finding::{Finding, FindingCode};
use super::open_scale::scaled_lengths;
use super::open_views;
use super::row_kind::listed_up_to;
use crate::fit::stages::parameter_size::plausible_size;
use crate::least_squares::{UnidentifiableCombination, Weak};
use crate::measurement::Measurements;
use crate::model::parameter::Parameter;
use crate::problem::Problem;
use crate::quantity::Unit;

/// Largest squared part of a unit direction outside a set of unknowns at which the direction lies
/// in the set.
const MAX_SQUARED_OUTSIDE: f64 = 1e-6;
/// Smallest part of a unit direction orthogonal to all directions found before, at which it is
/// another direction.
const MIN_NEW_PART: f64 = 0.1;
/// Smallest absolute component of an unknown in a unit direction at which the unknown is named.
const MIN_NAMED_WEIGHT: f64 = 0.02;
/// Plausible size of the deviation of a focal length or an image centre \[px\].
const PLAUSIBLE_PIXELS: f64 = 1000.0;
/// Maximum number of unknowns and groups that a sentence names.
const MAX_NAMED: usize = 8;

/// Kind of a combination of unknowns that the rows do not determine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Open {
    /// No row depends on the unknown.
    Unseen,
    /// Cameras and markers can move together, because the views do not decide their poses.
    Views,
    /// All fixtures can move together.
    Together,
    /// The base and fixtures can move together in the measuring frame.
    Place,
    /// Some parts can move against each other without an effect on any row.
    Apart,
    /// A focal length and the distance from the camera can change together.
    Focal,
    /// All lengths can change in proportion.
    Scale,
}

impl Open {
    /// Returns the word that identifies the kind in the `numbers` of the finding.
    const fn word(self) -> &'static str {
        match self {
            Self::Unseen => "unseen",
            Self::Views | Self::Together => "together",
            Self::Place => "place",
            Self::Apart => "apart",
            Self::Focal => "focal-length",
            Self::Scale => "scale",
        }
    }

    /// Returns a statement and a remedy; `names` lists the unknowns and groups involved.
    fn words(self, names: &str) -> [String; 2] {
        let texts = match self {
            Self::Unseen => {
                (format!("no row depends on {names}"), "hold them, or measure rows that do")
            }
            Self::Views => (
                format!("the views leave the poses of {names} open"),
                FindingCode::ViewsUndecided.entry().remedy,
            ),
            Self::Together => (
                format!("{names} can move together: no row refers to a known place"),
                "declare the place of one of them (at_m, rotation_deg)",
            ),
            Self::Place => (
                format!(
                    "the pose of the base: no rows against known places determine it ({names})"
                ),
                "fix base.* (fixed = true), or declare the place of a point, an anchor or a \
                 marker (at_m)",
            ),
            Self::Apart => (format!("the rows do not tell {names} apart"), "hold some of them"),
            Self::Focal => (
                format!("the focal length against the distance ({names})"),
                "view the board at an angle, hold fx and fy, or give them priors (sigma_px)",
            ),
            Self::Scale => (
                format!("the scale: no length is known ({names})"),
                "declare a [[distance]], measure one, or view a marker of several points",
            ),
        };
        [texts.0, texts.1.to_owned()]
    }
}

/// Check that reports the combinations of unknowns which the rows do not determine, if some rows
/// measure anything but positions.
pub(super) fn named_directions(fit: &CheckedFit) -> Vec<Finding> {
    let are_positions = fit.kinds().iter().all(|kind| kind.observation.is_position());
    let parameters: Vec<&Parameter> = fit.whole.parameters().collect();
    if are_positions {
        let is_set_up = |k: &usize| is_base(&parameters[*k].name) || is_tool(&parameters[*k].name);
        let set_up: Vec<usize> = (0..parameters.len()).filter(is_set_up).collect();
        return open_views::undecided_set_up(fit, &set_up).into_iter().collect();
    }
    let model = fit.model();
    let size = |parameter: &&Parameter| {
        let without_prior = Parameter { sigma: None, ..(*parameter).clone() };
        plausible_size(model, &without_prior).unwrap_or(match parameter.unit() {
            Unit::Length => model.reach(),
            Unit::Pixel => PLAUSIBLE_PIXELS,
            _ => 1.0,
        })
    };
    let sizes: Vec<f64> = parameters.iter().map(size).collect();
    let plausible_sizes: Vec<Option<f64>> = sizes.iter().copied().map(Some).collect();
    let rows = Weak::of(fit.triangle, &plausible_sizes)
        .map_or_else(|| DMatrix::zeros(0, sizes.len()), |weak| weak.rows);
    let scaled = DMatrix::from_fn(rows.nrows(), rows.ncols(), |i, j| rows[(i, j)] * sizes[j]);
    let names: Vec<&str> = parameters.iter().map(|parameter| &*parameter.name).collect();
    let finding = |OpenQuantity { kind, names: involved, unknowns }: OpenQuantity| {
        let focal = kind == Open::Focal;
        let poses = unknowns.into_iter().filter(|&k| is_fixture(names[k])).collect::<Vec<_>>();
        if (focal || kind == Open::Views)
            && let Some(finding) = open_views::undecided(fit, &poses, (&involved, focal))
        {
            return finding;
        }
        let [text, remedy] = kind.words(&listed_up_to(&involved, MAX_NAMED));
        let numbers = [json!(kind.word()), json!(involved)];
        Finding::new(FindingCode::NotToldApart, numbers, text).with_remedy(remedy)
    };
    let mut open = open_directions(&scaled, &names);
    if knows_a_length(fit.problem) {
        for quantity in open.iter_mut().filter(|quantity| quantity.kind == Open::Scale) {
            quantity.kind = Open::Apart;
        }
    }
    // The nominal arm misses contacts, so that another scale changes the data there.
    if open.iter().all(|quantity| quantity.kind != Open::Scale) {
        let lengths = scaled_lengths(fit.problem, fit.table(), &names);
        let scale = |names| OpenQuantity { kind: Open::Scale, names, unknowns: Vec::new() };
        open.extend(lengths.map(scale));
    }
    let mut findings: Vec<Finding> = open.into_iter().map(finding).collect();
    // A pose that the rows determine only within decimetres is open, too.
    let is_vague = |&k: &usize| {
        is_fixture(names[k])
            && fit.statistics.determined[k]
            && fit.statistics.errors[k] > open_views::MAX_POSE_ERROR
    };
    let vague: Vec<usize> = (0..names.len()).filter(is_vague).collect();
    if findings.iter().all(|finding| finding.code != FindingCode::ViewsUndecided) {
        let involved: Vec<String> = vague.iter().map(|&k| names[k].to_owned()).collect();
        findings.extend(open_views::undecided(fit, &vague, (&involved, false)));
    }
    findings
}

/// Returns true if the problem declares a length between points: a `[[distance]]`, or a marker of
/// several points.
fn knows_a_length(problem: &Problem) -> bool {
    !problem.distances.is_empty() || problem.fixtures.iter().any(|fixture| fixture.points.len() > 1)
}

/// Returns the sentence, with a remedy, that the rows of `table` leave the scale open; `None` if
/// they determine it, or if that is not certain. `unknowns` are the names of the free parameters.
pub(crate) fn open_scale(
    problem: &Problem,
    table: &Measurements,
    unknowns: &[&str],
) -> Option<String> {
    let lengths = scaled_lengths(problem, table, unknowns)?;
    Some(Open::Scale.words(&listed_up_to(&lengths, MAX_NAMED)).join("; "))
}

/// Returns a sentence with a remedy for each kind of quantity that unidentifiable `combinations` of
/// the unknowns leave undetermined; none if no fixture is unknown.
pub(crate) fn open_quantities(
    combinations: &[UnidentifiableCombination],
    unknowns: &[String],
) -> Vec<String> {
    let mut rows = DMatrix::zeros(combinations.len(), unknowns.len());
    for (i, combination) in combinations.iter().enumerate() {
        combination.weights.iter().for_each(|&(j, weight)| rows[(i, j)] = weight);
    }
    let names: Vec<&str> = unknowns.iter().map(String::as_str).collect();
    // Without fixtures, rows measure positions in the frame of the tracker. Combinations of the
    // arm's parameters are then listed elsewhere.
    if !names.iter().any(|name| is_fixture(name)) {
        return Vec::new();
    }
    let sentence =
        |open: OpenQuantity| open.kind.words(&listed_up_to(&open.names, MAX_NAMED)).join("; ");
    open_directions(&rows, &names).into_iter().map(sentence).collect()
}

/// Returns the name of the group of a parameter: the part of its name before the last point, such
/// as `joint2` or `camera[left]`.
fn group(name: &str) -> &str {
    name.rsplit_once('.').map_or(name, |(group, _)| group)
}

fn field(name: &str) -> &str {
    name.rsplit_once('.').map_or("", |(_, field)| field)
}

fn is_joint(name: &str) -> bool {
    name.starts_with("joint")
}

fn is_base(name: &str) -> bool {
    group(name) == "base" || name.starts_with("base[")
}

fn is_tool(name: &str) -> bool {
    group(name) == "tool" || name.starts_with("tool[")
}

/// Returns true for a parameter of the position or pose of a point, anchor, surface, camera or
/// marker.
fn is_fixture(name: &str) -> bool {
    let words = ["point[", "anchor[", "surface[", "camera[", "marker["];
    words.iter().any(|word| name.starts_with(word)) && !is_lens(name) && field(name) != "radius"
}

fn is_lens(name: &str) -> bool {
    let of_pose = ["x", "y", "z", "rx", "ry", "rz"];
    name.starts_with("camera[") && !of_pose.contains(&field(name))
}

fn is_length(name: &str) -> bool {
    let fields: &[&str] = match () {
        () if is_joint(name) => &["a", "d", "x", "y", "z"],
        () if is_base(name) || is_tool(name) || is_fixture(name) => &["x", "y", "z", "d"],
        () => &[],
    };
    fields.contains(&field(name)) || field(name) == "radius"
}

/// Quantity that the rows leave open.
#[derive(Debug, PartialEq, Eq)]
struct OpenQuantity {
    kind: Open,
    /// Names of the unknowns or groups involved.
    names: Vec<String>,
    /// Indices of the unknowns with a notable component; empty if they are not needed.
    unknowns: Vec<usize>,
}

/// Returns the kinds of combinations in the null space that `rows` span, shape = (combinations,
/// unknowns), each with the names of the unknowns or groups involved.
fn open_directions(rows: &DMatrix<f64>, names: &[&str]) -> Vec<OpenQuantity> {
    let Some(null) = orthonormal(rows) else { return Vec::new() };
    let mut found = Found { null, accounted: Vec::new() };
    let mut open = Vec::new();
    let unseen = (0..names.len()).filter(|&j| !found.within(|k| k == j).is_empty());
    let unseen: Vec<String> = unseen.map(|j| names[j].to_owned()).collect();
    if !unseen.is_empty() {
        open.push(OpenQuantity { kind: Open::Unseen, names: unseen, unknowns: Vec::new() });
    }
    let named = |k: usize, is: &dyn Fn(&str) -> bool| is(names[k]);
    // Combinations of joint parameters alone are listed elsewhere.
    found.within(|k| named(k, &is_joint));
    let is_focal = |name: &str| is_lens(name) && ["fx", "fy"].contains(&field(name));
    let mut add = |kind, directions: Vec<RowDVector<f64>>| {
        if !directions.is_empty() {
            let mut unknowns = notable(&directions);
            // Coefficients of the distortion follow the focal length.
            if kind == Open::Focal {
                unknowns.retain(|&k| !is_lens(names[k]) || is_focal(names[k]));
            }
            open.push(OpenQuantity { kind, names: involved(&unknowns, names), unknowns });
        }
    };
    let is_marker = |name: &str| is_fixture(name) && name.starts_with("marker[");
    let has_view = |name: &str| is_marker(name) || name.starts_with("camera[") && !is_lens(name);
    add(Open::Together, found.within(|k| named(k, &is_marker)));
    add(Open::Views, found.within(|k| named(k, &has_view)));
    add(Open::Together, found.within(|k| named(k, &is_fixture)));
    add(Open::Place, found.within(|k| named(k, &|name| is_base(name) || is_fixture(name))));
    let set_up = |name: &str| is_base(name) || is_tool(name) || is_fixture(name);
    add(Open::Apart, found.within(|k| named(k, &set_up)));
    let mut joints: Vec<&str> =
        names.iter().copied().filter(|name| is_joint(name)).map(group).collect();
    joints.dedup();
    for joint in joints.into_iter().rev() {
        let part = |name: &str| is_fixture(name) || is_tool(name) || group(name) == joint;
        add(Open::Apart, found.within(|k| named(k, &part)));
        let part = |name: &str| set_up(name) || group(name) == joint;
        add(Open::Apart, found.within(|k| named(k, &part)));
    }
    let mut lenses: Vec<&str> =
        names.iter().copied().filter(|name| is_lens(name)).map(group).collect();
    lenses.dedup();
    for camera in lenses {
        let part = |name: &str| set_up(name) || is_lens(name) && group(name) == camera;
        // A combination is one of the focal length only if it has a notable part of it.
        let without_focal = |k: usize| named(k, &part) && !is_focal(names[k]);
        add(Open::Apart, found.within_up_to(MIN_NAMED_WEIGHT.powi(2), without_focal));
        add(Open::Focal, found.within(|k| named(k, &part)));
    }
    let scale = found.within(|k| named(k, &is_length));
    let is_scale = |direction: &RowDVector<f64>| {
        let involves = |is: fn(&str) -> bool| {
            (0..names.len()).any(|k| is(names[k]) && direction[k].abs() > MIN_NAMED_WEIGHT)
        };
        involves(is_joint) && involves(|name| is_fixture(name) || is_tool(name))
    };
    add(Open::Scale, scale.into_iter().filter(is_scale).collect());
    open
}

/// Null space with the directions that have already been found in it.
struct Found {
    /// Orthonormal rows that span the null space.
    null: DMatrix<f64>,
    /// Orthonormal directions, in the space of the unknowns, that earlier calls of `within` found.
    accounted: Vec<RowDVector<f64>>,
}

impl Found {
    /// Returns the directions of the null space that lie in the unknowns for whose index
    /// `is_in_set` returns true, without those that earlier calls found. Adds them to `accounted`.
    fn within(&mut self, is_in_set: impl Fn(usize) -> bool) -> Vec<RowDVector<f64>> {
        self.within_up_to(MAX_SQUARED_OUTSIDE, is_in_set)
    }

    /// Does the work of [`within`](Self::within) for directions whose squared part outside the set
    /// is at most `max_outside`.
    fn within_up_to(
        &mut self,
        max_outside: f64,
        is_in_set: impl Fn(usize) -> bool,
    ) -> Vec<RowDVector<f64>> {
        let unknowns = self.null.ncols();
        let outside: Vec<usize> = (0..unknowns).filter(|&k| !is_in_set(k)).collect();
        let outside = self.null.select_columns(&outside);
        let eigen = (&outside * outside.transpose()).symmetric_eigen();
        let mut found = Vec::new();
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            if *value > max_outside {
                continue;
            }
            let mut direction: RowDVector<f64> = vector.transpose() * &self.null;
            for _ in 0..2 {
                for earlier in &self.accounted {
                    direction -= earlier * direction.dot(earlier);
                }
            }
            if direction.norm() > MIN_NEW_PART {
                direction.normalize_mut();
                self.accounted.push(direction.clone());
                (0..direction.len()).filter(|&k| !is_in_set(k)).for_each(|k| direction[k] = 0.0);
                found.push(direction);
            }
        }
        found
    }
}

/// Returns orthonormal rows that span the rows of a matrix; `None` if it has no rows, or a row that
/// is zero or not finite.
fn orthonormal(rows: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let norms: Vec<f64> = rows.row_iter().map(|row| row.norm()).collect();
    if norms.is_empty() || norms.iter().any(|norm| !(*norm > 0.0 && norm.is_finite())) {
        return None;
    }
    let scale = DVector::from_iterator(norms.len(), norms.iter().map(|norm| norm.recip()));
    let unit = DMatrix::from_fn(rows.nrows(), rows.ncols(), |i, j| rows[(i, j)] * scale[i]);
    Some(unit.transpose().qr().q().transpose())
}

/// Returns the indices of the unknowns with a notable component in some of the `directions`.
fn notable(directions: &[RowDVector<f64>]) -> Vec<usize> {
    let is_part = |k: &usize| directions.iter().any(|of| of[*k].abs() > MIN_NAMED_WEIGHT);
    (0..directions.first().map_or(0, RowDVector::len)).filter(is_part).collect()
}

/// Returns the names of `unknowns`. For those of bases, tools and fixtures it is the name of their
/// group.
fn involved(unknowns: &[usize], names: &[&str]) -> Vec<String> {
    let mut involved: Vec<String> = Vec::new();
    for name in unknowns.iter().map(|&k| names[k]) {
        let is_single = is_joint(name) || is_lens(name);
        let word = if is_single { name.to_owned() } else { group(name).to_owned() };
        if !involved.contains(&word) {
            involved.push(word);
        }
    }
    involved
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_named_by_their_unknowns() {
        let names = [
            "joint1.d",
            "joint2.a",
            "joint6.d",
            "base.x",
            "tool.x",
            "camera[eye].z",
            "camera[eye].fx",
            "marker[board].x",
            "marker[board].z",
            "camera[eye].k2",
            "camera[eye].k3",
        ];
        let row = |weights: &[(usize, f64)]| {
            let mut row = RowDVector::zeros(names.len());
            for &(k, weight) in weights {
                row[k] = weight;
            }
            row
        };
        let open = |rows: &[RowDVector<f64>]| {
            let found = open_directions(&DMatrix::from_rows(rows), &names);
            found.into_iter().map(|of| (of.kind.word(), of.names.join(" "))).collect::<Vec<_>>()
        };
        let unseen = row(&[(4, 1.0)]);
        let place = row(&[(3, 1.0), (7, -1.0)]);
        let last = row(&[(2, 1.0), (5, -1.0)]);
        let focal = row(&[(6, 1.0), (5, 0.2), (8, -0.5)]);
        let lens = row(&[(9, 1.0), (10, -0.6)]);
        let scale = row(&[(0, 0.4), (1, 0.6), (2, 0.1), (5, 0.2), (7, 0.3), (8, 0.9)]);
        let expected = |word: &'static str, names: &str| (word, names.to_owned());
        assert_eq!(open(std::slice::from_ref(&unseen)), [expected("unseen", "tool.x")]);
        assert_eq!(
            // Mixed, the space is the same.
            open(&[
                unseen.clone() + &place,
                &place - &last,
                last.clone(),
                focal + &last + &lens,
                lens,
                scale + place.clone()
            ]),
            [
                expected("unseen", "tool.x"),
                expected("place", "base marker[board]"),
                expected("apart", "joint6.d camera[eye]"),
                expected("apart", "camera[eye].k2 camera[eye].k3"),
                expected("focal-length", "camera[eye] camera[eye].fx marker[board]"),
                expected("scale", "joint1.d joint2.a joint6.d base camera[eye] marker[board]"),
            ]
        );
        assert_eq!(open_directions(&DMatrix::zeros(0, names.len()), &names), []);
    }
}
