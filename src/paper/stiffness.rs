//! First stage of the paper's identification: stiffness, before the geometry is identified (§3.3).

use nalgebra::{DMatrix, DVector, Matrix3xX, Vector3};

use super::form::Reading;
use super::residuals::Measured;
use super::{EndPoint, Flexibility, Parameters};
use crate::least_squares::solver::minimum_norm_step;
use crate::least_squares::{Block, Triangle};
use crate::problem::Problem;

worded! {
    /// Source of the stiffness that is fixed while the geometry is identified. The paper says that
    /// elastic parameters are calibrated first, but not how.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    #[non_exhaustive]
    pub enum StiffnessStage: as_str {
        /// No elasticity: a rigid arm, which the paper calls ignoring elasticity.
        Rigid = "rigid";
        /// Stiffness that the problem declares.
        Nominal = "nominal-stiffness";
        /// Linear least squares from the measured positions at nominal geometry.
        Positions = "from-positions";
        /// Linear least squares from differences between poses of one configuration under different
        /// loads, in which the geometry cancels.
        LoadDifferences = "from-load-differences";
    }
}

impl StiffnessStage {
    /// Largest singular value of the elastic Jacobian, relative to its largest one, at which a
    /// combination of flexibilities keeps its nominal value. Columns of the Jacobian are
    /// derivatives with respect to the logarithms of the flexibilities.
    pub const TOLERANCE: f64 = 1e-2;
}

/// Returns x = A⁺ b, with singular values of A up to `tolerance` times the largest one dropped
/// [Chen2021, eq. 43, 44].
///
/// Returns `None` if A or b is not finite, or if their numbers of rows differ.
pub fn least_squares(a: &DMatrix<f64>, b: &DVector<f64>, tolerance: f64) -> Option<DVector<f64>> {
    if a.nrows() != b.len() || !a.iter().chain(b.iter()).all(|value| value.is_finite()) {
        return None;
    }
    let mut block = Block::zeros(a.nrows(), a.ncols());
    for (j, column) in a.column_iter().enumerate() {
        block.column_mut(j).iter_mut().zip(&column).for_each(|(to, from)| *to = *from);
    }
    block.column_mut(a.ncols()).iter_mut().zip(b).for_each(|(to, from)| *to = -from);
    let mut triangle = Triangle::new(a.ncols());
    triangle.absorb(&mut block);
    Some(minimum_norm_step(&triangle.into_linearisation(), tolerance))
}

/// Equations of one pose, measuring frame: derivatives ∂`D_f`/∂ln c with respect to the
/// flexibilities c, shape = (3, flexibilities) \[m\], and the residual `PE_meas` − `PE_nom` − `D_f`
/// \[m\].
type Equations = (Matrix3xX<f64>, Vector3<f64>);

/// Returns parameters with nominal geometry and the flexibilities of the given `stage`.
///
/// Linear least squares estimates the flexibilities c from their nominal values c₀ at nominal
/// geometry, where `D_f` = C c: c = c₀ + C⁺ [`PE_meas` − `PE_nom` − C c₀].
///
/// With load differences, the mean over each configuration is subtracted from its poses. This
/// cancels all quantities that do not depend on the load: the geometric errors, except their part
/// in `J_f` (eq. 40). Poses of a configuration with a single load are not used.
///
/// Returns `None` if a value is not finite, or if load differences are requested and no
/// configuration was measured under several loads.
pub fn stiffness(
    problem: &Problem,
    poses: &[Measured],
    reading: &Reading,
    stage: StiffnessStage,
) -> Option<Parameters> {
    let mut parameters = Parameters::nominal(problem);
    let unknowns = match stage {
        StiffnessStage::Rigid => return Some(Parameters::rigid(problem)),
        StiffnessStage::Nominal => return Some(parameters),
        StiffnessStage::Positions | StiffnessStage::LoadDifferences => parameters.flexibilities(),
    };
    let mut equations: Vec<Equations> = poses
        .iter()
        .map(|pose| equations_of(problem, &parameters, &unknowns, pose, reading))
        .collect();
    if stage == StiffnessStage::LoadDifferences {
        equations = differences(poses, &equations)?;
    }
    let mut columns = DMatrix::zeros(3 * equations.len(), unknowns.len());
    let mut residuals = DVector::zeros(3 * equations.len());
    for (row, (derivatives, residual)) in equations.iter().enumerate() {
        columns.fixed_rows_mut::<3>(3 * row).copy_from(derivatives);
        residuals.fixed_rows_mut::<3>(3 * row).copy_from(residual);
    }
    let relative = least_squares(&columns, &residuals, StiffnessStage::TOLERANCE)?;
    for (&which, change) in unknowns.iter().zip(&relative) {
        parameters.set(which, parameters.get(which) * (1.0 + change));
    }
    Some(parameters)
}

/// Returns the equations of one pose at nominal geometry.
fn equations_of(
    problem: &Problem,
    parameters: &Parameters,
    unknowns: &[Flexibility],
    pose: &Measured,
    reading: &Reading,
) -> Equations {
    let end = EndPoint::new(problem, parameters, &pose.setup, reading);
    let derivative = |which: &Flexibility| {
        end.displacement(&end.elastic.derivative(*which)) * parameters.get(*which)
    };
    let columns: Vec<Vector3<f64>> = unknowns.iter().map(derivative).collect();
    (Matrix3xX::from_columns(&columns), pose.position - end.position(parameters))
}

/// Returns the equations of the poses with the mean over their configuration subtracted. Poses of
/// configurations with a single load are left out. Returns `None` if no configuration has several.
fn differences(poses: &[Measured], equations: &[Equations]) -> Option<Vec<Equations>> {
    let load = |pose: &Measured| (pose.setup.payload.copied(), pose.setup.hoist.copied());
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (k, pose) in poses.iter().enumerate() {
        let is_same = |group: &&mut Vec<usize>| {
            poses[group[0]].setup.configuration == pose.setup.configuration
        };
        match groups.iter_mut().find(is_same) {
            Some(group) => group.push(k),
            None => groups.push(vec![k]),
        }
    }
    groups.retain(|group| group.iter().any(|&k| load(&poses[k]) != load(&poses[group[0]])));
    let mut out = Vec::new();
    for group in &groups {
        let n = group.len() as f64;
        let (mut columns, mut residual) = equations[group[0]].clone();
        for &k in &group[1..] {
            columns += &equations[k].0;
            residual += equations[k].1;
        }
        out.extend(
            group.iter().map(|&k| (&equations[k].0 - &columns / n, equations[k].1 - residual / n)),
        );
    }
    (!out.is_empty()).then_some(out)
}
