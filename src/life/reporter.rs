//! Report of a cause: its size, its probability, and how well it predicts rows that are left out.

use nalgebra::{DMatrix, DVector};

use super::assessment::AssessedCause;
use super::causes::{Cause, CauseKind};
use super::column_space::ColumnSpace;
use super::earlier::WIDE_SIGMA;
use super::evidence::{MIN_NAMED_PROBABILITY, Unchanged};
use super::onset::{padded_factor, sums_of};
use super::rows::SensitiveRows;
use crate::quantity::Unit;

/// Maximum number of groups of rows that are left out in turn to test a cause.
const MAX_GROUPS: usize = 60;
/// Smallest of these maxima: with many unknowns, fewer groups are left out.
const MIN_GROUPS: usize = 10;
/// Maximum number of operations of the solutions without each group: cubes of the number of
/// unknowns.
const MAX_OPERATIONS: f64 = 6e8;
/// Smallest expected evidence per pose for one cause against another \[nats\] at which more poses
/// can distinguish the causes.
const MIN_NATS_PER_POSE: f64 = 1e-3;
/// Largest part of a change that a placement does not imitate, as a share of the change and in units
/// of the noise, at which rows do not distinguish the two.
const MAX_OUTSIDE_SHARE: f64 = 0.01;
const MAX_OUTSIDE_NOISE: f64 = 1.0;
/// Smallest ratio of the error with the most probable cause to that of a table read in another way,
/// at which the table is misread.
const MIN_MARGIN: f64 = 1.5;

/// Cause of a change with its probability and size.
#[derive(Debug, Clone)]
pub struct WatchedCause {
    /// Kind of the cause.
    pub kind: CauseKind,
    /// Name for people, such as "zero of joint 2".
    pub label: String,
    /// Placement that moves the rows in the same way, such as "base or the instrument"; `None` if
    /// the rows tell the cause from all placements.
    pub alike: Option<String>,
    /// Index of the gross row among all rows of the table, from 0; `None` for other causes.
    pub row: Option<usize>,
    /// Index of the first row that shows the change among all rows of the table, from 0; `None` if
    /// the change happened before the table.
    pub from_row: Option<usize>,
    /// Probability among all causes, given that something changed.
    pub probability: f64,
    /// Changes of the parameters that the cause moves. For larger noise and for something else,
    /// this is the ratio of the errors to the assumed noise.
    pub changes: Vec<Change>,
    /// Root mean square error of rows of the leading kind (positions, if there are any), each
    /// predicted with this cause as estimated without the row \[m\] or \[rad\]. For a gross row it
    /// is the error of the other rows; `None` for noise and for something else.
    pub left_out_error: Option<f64>,
    /// Number of additional poses like the measured ones after which the data are expected to
    /// decide between this cause and the most probable other one; `None` if no number would
    /// suffice, or if there is no other cause.
    pub poses_to_tell_apart: Option<usize>,
}

impl WatchedCause {
    /// Returns the cause that the table is misread if its rows, read in another way, have a clearly
    /// smaller error than with the most probable of `causes`; else these causes. `misread` describes
    /// the other way, with its error.
    pub(super) fn or_misread(causes: Vec<Self>, misread: Option<(String, f64)>) -> Vec<Self> {
        let left = causes.first().and_then(|cause| cause.left_out_error).unwrap_or(f64::INFINITY);
        let Some((label, error)) = misread.filter(|(_, error)| MIN_MARGIN * error < left) else {
            return causes;
        };
        vec![Self {
            kind: CauseKind::Misread,
            label,
            alike: None,
            row: None,
            from_row: None,
            probability: 1.0,
            changes: Vec::new(),
            left_out_error: Some(error),
            poses_to_tell_apart: None,
        }]
    }
}

/// Change of one parameter since the estimate.
#[derive(Debug, Clone)]
pub struct Change {
    /// Name of the parameter.
    pub parameter: String,
    /// Unit of the change.
    pub unit: Unit,
    /// Change, SI; of the logarithm for stiffnesses.
    pub change: f64,
    /// Standard error of the change; NaN for a turn of a camera or marker and for a ratio of the
    /// noise.
    pub std_error: f64,
}

/// Rows and causes from which the report of a cause is computed.
pub(super) struct Reporter<'a> {
    pub rows: &'a SensitiveRows,
    /// Matrix F with F Fᵀ the covariance of the estimate.
    pub factor: &'a DMatrix<f64>,
    /// The same without drift.
    pub undrifted: &'a DMatrix<f64>,
    /// Columns of bases and targets that the estimate does not know, such as those of a new session.
    pub unknown: &'a [usize],
    pub causes: &'a [Cause],
    /// True for rows of the leading kind (positions, if there are any), whose errors are reported.
    pub leads: &'a [bool],
}

impl Reporter<'_> {
    /// Returns the report of a cause; `rival` is the most probable other one.
    pub fn cause(&self, assessed: &AssessedCause, rival: Option<&AssessedCause>) -> WatchedCause {
        let cause = &self.causes[assessed.cause];
        let changes = cause.amplitudes.iter().enumerate().map(|(i, (name, unit))| Change {
            parameter: name.clone(),
            unit: *unit,
            change: assessed.mean[i],
            std_error: assessed.covariance[(i, i)].sqrt(),
        });
        let mut changes: Vec<Change> = changes.collect();
        if matches!(cause.kind, CauseKind::Noise | CauseKind::Other) {
            let (parameter, unit) =
                ("noise, as a multiple of the known one".to_owned(), Unit::Number);
            changes.push(Change { parameter, unit, change: assessed.mean[0], std_error: f64::NAN });
        }
        let rival = rival.filter(|rival| rival.cause != assessed.cause);
        WatchedCause {
            kind: cause.kind,
            label: cause.label.clone(),
            alike: None,
            row: assessed.row,
            from_row: None,
            probability: assessed.probability,
            changes,
            left_out_error: match (cause.kind, assessed.row) {
                (CauseKind::Noise | CauseKind::Other, _) => None,
                (_, Some(off)) => {
                    Some(self.rms_of(|row| row != off, |row| self.rows.residual_of(row)))
                }
                _ => self.left_out_error(cause, assessed),
            },
            poses_to_tell_apart: rival.and_then(|rival| self.poses_to_tell_apart(assessed, rival)),
        }
    }

    /// Returns the root mean square length, over the rows of the leading kind (positions, if there
    /// are any), of the residuals that `residual` returns in units of σ \[m\] or \[rad\].
    pub fn rms(&self, residual: impl Fn(usize) -> DVector<f64>) -> f64 {
        self.rms_of(|_| true, residual)
    }

    /// Returns the root mean square length of the residuals that `residual` returns over those rows
    /// of the leading kind for which `is_included` is true \[m\] or \[rad\].
    fn rms_of(
        &self,
        is_included: impl Fn(usize) -> bool,
        residual: impl Fn(usize) -> DVector<f64>,
    ) -> f64 {
        let chosen: Vec<usize> =
            (0..self.rows.len()).filter(|&row| self.leads[row] && is_included(row)).collect();
        let square = |&row: &usize| {
            let numbers = residual(row);
            numbers.rows(0, numbers.len().min(3)).norm_squared() * self.rows.sigma[row].powi(2)
        };
        (chosen.iter().map(square).sum::<f64>() / chosen.len().max(1) as f64).sqrt()
    }

    /// Returns the factor of the covariance without drift and without the variance of what the
    /// estimate does not know.
    fn known_factor(&self) -> DMatrix<f64> {
        let mut known = self.undrifted.clone();
        self.unknown.iter().for_each(|&k| known.row_mut(k).fill(0.0));
        known
    }

    /// Returns the root mean square error of the rows of the leading kind that noise, the known
    /// misfit and the uncertainty of the estimate without drift give \[m\] or \[rad\]. Bases and
    /// targets that the estimate does not know are fitted to the rows, and take up what they can.
    pub fn expected_error(&self) -> f64 {
        let mut known = self.known_factor();
        // Effects of temperature that the estimate lacks are possible, but not expected.
        let of_warmth = self.causes.iter().filter(|cause| cause.kind == CauseKind::Temperature);
        of_warmth.flat_map(|cause| &cause.columns).for_each(|&k| known.row_mut(k).fill(0.0));
        let unknown = ColumnSpace::new(self.rows, self.unknown);
        let of_estimate = unknown.outside_of(&(self.rows.columns(&known) * &known));
        self.rms(|row| self.rows.expected_errors(row, &of_estimate))
    }

    /// Returns the root mean square error of the rows of the leading kind (positions, if there are
    /// any), each predicted with the changes of the cause as estimated without the row's group.
    /// `None` if a number is not finite.
    fn left_out_error(&self, cause: &Cause, assessed: &AssessedCause) -> Option<f64> {
        let (rows, mut columns) = self.rows.masked_before(assessed.onset, &cause.columns);
        // What the estimate does not know, and its uncertainty, are estimated together with the
        // cause, because errors of the estimate may compensate each other.
        let known = self.known_factor();
        let (rows, carried) = &rows.with_columns(&(self.rows.columns(&known) * &known));
        columns.extend(self.unknown);
        columns.extend(carried.clone());
        let unknown = vec![WIDE_SIGMA; self.unknown.len()];
        let sizes = [&*assessed.sizes, &unknown, &vec![1.0; carried.len()]].concat();
        let factor = DMatrix::zeros(rows.sensitivity.ncols(), 1);
        let sums = sums_of(rows, 1.0);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positive")]
        let fitting = (MAX_OPERATIONS / (columns.len() as f64).powi(3)) as usize;
        let groups = rows.len().min(fitting.clamp(MIN_GROUPS, MAX_GROUPS));
        let means: Option<Vec<DVector<f64>>> = (0..groups)
            .map(|group| {
                let mut others = sums.clone();
                (group..rows.len()).step_by(groups).for_each(|row| others.add(rows, row, -1.0));
                let unchanged = Unchanged::new(&others, &factor)?;
                unchanged.mean(&columns, &sizes)
            })
            .collect();
        let means = means?;
        Some(self.rms(|row| {
            let moved = rows.of_row(row).select_columns(&columns);
            rows.residual_of(row) - moved * &means[row % groups]
        }))
    }

    /// Returns the words for a base, tool or fixture that would move the measured points just as a
    /// link or a zero does, by the most probable size of its change; `None` if rows distinguish the two.
    pub fn placement_alike(&self, assessed: &AssessedCause) -> Option<String> {
        let cause = &self.causes[assessed.cause];
        if !matches!(cause.kind, CauseKind::Zero | CauseKind::Link) {
            return None;
        }
        let columns = self.rows.sensitivity.select_columns(&cause.columns);
        let moved = columns * &assessed.mean;
        let is_alike = |placement: &&Cause| {
            let (count, rows) = (placement.columns.len(), self.rows);
            let space = ColumnSpace::new(rows, &placement.columns);
            let outside = space.outside(&moved).norm();
            rows.coordinates.iter().sum::<usize>() > count
                && space.basis.ncols() == count
                && outside <= MAX_OUTSIDE_NOISE
                && outside <= MAX_OUTSIDE_SHARE * moved.norm()
        };
        let placement = self.causes.iter().filter(|of| of.kind.is_placement()).find(is_alike)?;
        let instrument = if placement.kind == CauseKind::Base { " or the instrument" } else { "" };
        Some(format!("{}{instrument}", placement.label))
    }

    /// Returns the number of additional poses like these after which a cause is expected to be nine
    /// times as probable as its rival, if it is the true one. `None` if one of the two moves no
    /// parameter, or if the poses hardly distinguish them.
    fn poses_to_tell_apart(
        &self,
        assessed: &AssessedCause,
        rival: &AssessedCause,
    ) -> Option<usize> {
        let (cause, other) = (&self.causes[assessed.cause], &self.causes[rival.cause]);
        let wanted = (MIN_NAMED_PROBABILITY / (1.0 - MIN_NAMED_PROBABILITY)).ln()
            - (assessed.probability / rival.probability).ln();
        if wanted <= 0.0 {
            return Some(0);
        }
        if cause.columns.is_empty() || other.columns.is_empty() {
            return None;
        }
        let (rows, columns) = self.rows.masked_before(assessed.onset, &cause.columns);
        let (rows, of_rival) = rows.masked_before(rival.onset, &other.columns);
        let factor = padded_factor(self.factor, columns.len() + of_rival.len());
        let unchanged = Unchanged::new(&sums_of(&rows, 1.0), &factor)?;
        let part = |a: &[usize], b: &[usize]| {
            DMatrix::from_fn(a.len(), b.len(), |i, j| unchanged.information[(a[i], b[j])])
        };
        // Evidence of the change for the cause, minus the part that the rival can imitate.
        let shown = part(&columns, &columns) * &assessed.mean;
        let seen = part(&of_rival, &columns) * &assessed.mean;
        let mut matrix = part(&of_rival, &of_rival);
        for (i, size) in rival.sizes.iter().enumerate() {
            matrix[(i, i)] += size.powi(-2);
        }
        let imitated = seen.dot(&matrix.cholesky()?.solve(&seen));
        let nats = 0.5 * (assessed.mean.dot(&shown) - imitated).max(0.0);
        let of_pose = nats / (rows.len() - assessed.onset) as f64;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small, ≥ 0")]
        let poses = (wanted / of_pose).ceil() as usize;
        (of_pose > MIN_NATS_PER_POSE).then_some(poses)
    }
}
