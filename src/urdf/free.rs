//! Choice of the parameters that are free at first: as many as position measurements distinguish.

use nalgebra::{DMatrix, DVector, Vector3};
use rand::RngExt as _;

use crate::error::{InputError, Location};
use crate::least_squares::jacobian;
use crate::model::parameter::Parameter;
use crate::model::{MeasuredOrientation, Model, Pose, PoseResiduals};
use crate::problem::{
    Freedom, JointKind, Observation, ParameterRule, PoseView, Problem, Quantities, Target,
};
use crate::random::stream;

/// Smallest fraction of a Jacobian column's norm that must be independent of the columns of the
/// parameters chosen before.
const MIN_INDEPENDENT_FRACTION: f64 = 1e-3;
/// Largest magnitude of a random command of a revolute joint \[rad\].
const MAX_SAMPLED_ANGLE: f64 = 3.0;
/// Largest magnitude of a random command of a prismatic joint \[m\].
const MAX_SAMPLED_TRAVEL: f64 = 0.5;

/// Returns the names of the parameters that measured positions of an off-axis target distinguish, on
/// the joint of each number in `ends` (from 1). If `are_oriented` is true, orientations are measured, too, as by views of a board.
///
/// Base and tool come first, then α, a, θ, d of all joints, then β. A parameter is chosen if its
/// Jacobian column is independent of the chosen ones, at random poses within the joint limits.
pub(super) fn distinguishable_parameters(
    problem: &Problem,
    ends: &[usize],
    are_oriented: bool,
) -> Result<Vec<String>, InputError> {
    let mut problem = problem.clone();
    if are_oriented {
        problem.data.fits_orientation = true;
        problem.data.orientation_sigma = Some(1.0);
    }
    let location = Location::file(&problem.data.location.file);
    let freedom = Freedom::Free {
        sigma: Quantities::default(),
        min: Quantities::default(),
        max: Quantities::default(),
    };
    problem.parameters = vec![ParameterRule { pattern: "*".to_owned(), freedom, location }];
    problem.tool.target = Vector3::new(0.11, 0.07, 0.05);
    let unnamed = [String::new()];
    let mut targets = unnamed.to_vec();
    if ends.len() > 1 {
        let target = |end: &usize| Target {
            name: end.to_string(),
            joint: end - 1,
            at: problem.tool.target,
            rotation: Vector3::zeros(),
            location: problem.data.location.clone(),
        };
        problem.targets = ends.iter().map(target).collect();
        targets = problem.targets.iter().map(|target| target.name.clone()).collect();
    }
    let model = Model::new(&problem, &unnamed, &targets)?;
    let count = model.parameters.len();
    let mut random = stream(1, 0);
    let mut draw = |joint: &crate::problem::Joint| {
        let reach = match joint.command_kind() {
            JointKind::Fixed => return 0.0,
            JointKind::Revolute => MAX_SAMPLED_ANGLE,
            JointKind::Prismatic => MAX_SAMPLED_TRAVEL,
        };
        let (from, to) = (joint.limits.0.max(-reach), joint.limits.1.min(reach));
        from + (to - from) * random.random::<f64>()
    };
    let configurations: Vec<Vec<f64>> =
        (0..count).map(|_| problem.joints.iter().map(&mut draw).collect()).collect();
    let measured = Vector3::zeros();
    let mut poses = Vec::with_capacity(count);
    for (row, configuration) in configurations.iter().enumerate() {
        poses.push(Pose {
            setup: PoseView::from_configuration(configuration),
            base: 0,
            target: row % targets.len(),
            observation: Observation::default(),
            measured: &measured,
            sigma: 1.0,
            orientation: are_oriented.then_some(MeasuredOrientation { measured: None, sigma: 1.0 }),
        });
    }
    let zero = DVector::zeros(count);
    let columns =
        jacobian(&PoseResiduals::new(&model, poses, (0..count).collect(), zero.clone()), &zero);
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by_key(|&k| model.parameters.get(k).map_or(0, priority));
    let chosen = independent(&columns, &order);
    Ok(chosen.iter().filter_map(|&k| Some(model.parameters.get(k)?.name.clone())).collect())
}

/// Returns the rank of a parameter in the choice, the lowest first: 0 for those of base and target,
/// then α, a, θ, d, β, then others. Equal ranks follow the order of the arm.
fn priority(parameter: &Parameter) -> usize {
    let field = parameter.name.rsplit('.').next().unwrap_or_default();
    let fields = ["alpha", "a", "theta", "d", "beta"];
    if parameter.site.is_placement() {
        0
    } else {
        1 + fields.iter().position(|known| *known == field).unwrap_or(fields.len())
    }
}

/// Returns the indices of those columns that are linearly independent of the columns before them in
/// the given order.
fn independent(columns: &DMatrix<f64>, order: &[usize]) -> Vec<usize> {
    let (mut basis, mut chosen): (Vec<DVector<f64>>, Vec<usize>) = (Vec::new(), Vec::new());
    for &k in order {
        let mut residual = columns.column(k).into_owned();
        let length = residual.norm();
        // Two passes of Gram–Schmidt give orthogonality to rounding.
        for direction in basis.iter().chain(&basis) {
            residual.axpy(-direction.dot(&residual), direction, 1.0);
        }
        let independent_length = residual.norm();
        if independent_length > MIN_INDEPENDENT_FRACTION * length && length > 0.0 {
            basis.push(residual / independent_length);
            chosen.push(k);
        }
    }
    chosen
}
