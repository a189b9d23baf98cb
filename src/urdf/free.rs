//! Which parameters to free at first: as many as positions tell apart.

use nalgebra::{DMatrix, DVector, Vector3};
use rand::RngExt as _;

use crate::error::{InputError, Location};
use crate::least_squares::jacobian;
use crate::model::parameter::Parameter;
use crate::model::{Model, Pose, PoseResiduals};
use crate::problem::{
    Freedom, JointKind, Observation, ParameterRule, PoseView, Problem, Quantities,
};
use crate::random::stream;

/// A column adds something if that much of it is left beside those before \[1\].
const NEW: f64 = 1e-3;
/// Range of a joint without limits \[rad\], and of one that slides \[m\].
const TURN: f64 = 3.0;
const SLIDE: f64 = 0.5;

/// Names of the parameters that measured positions tell apart, of a target anywhere on the tool.
///
/// Base and tool come first, then α, a, θ, d of all joints, then β: each is taken if it moves
/// positions in a way that none before it does, in poses drawn from the limits of the joints.
pub(super) fn distinguishable_parameters(problem: &Problem) -> Result<Vec<String>, InputError> {
    let mut problem = problem.clone();
    let location = Location::file(&problem.data.location.file);
    let freedom = Freedom::Free {
        sigma: Quantities::default(),
        min: Quantities::default(),
        max: Quantities::default(),
    };
    problem.parameters = vec![ParameterRule { pattern: "*".to_owned(), freedom, location }];
    problem.tool.target = Vector3::new(0.11, 0.07, 0.05);
    let unnamed = [String::new()];
    let model = Model::new(&problem, &unnamed, &unnamed)?;
    let count = model.parameters.len();
    let mut random = stream(1, 0);
    let mut draw = |joint: &crate::problem::Joint| {
        let reach = match joint.command_kind() {
            JointKind::Fixed => return 0.0,
            JointKind::Revolute => TURN,
            JointKind::Prismatic => SLIDE,
        };
        let (from, to) = (joint.limits.0.max(-reach), joint.limits.1.min(reach));
        from + (to - from) * random.random::<f64>()
    };
    let configurations: Vec<Vec<f64>> =
        (0..count).map(|_| problem.joints.iter().map(&mut draw).collect()).collect();
    let measured = Vector3::zeros();
    let mut poses = Vec::with_capacity(count);
    for configuration in &configurations {
        poses.push(Pose {
            setup: PoseView::from_configuration(configuration),
            base: 0,
            target: 0,
            observation: Observation::default(),
            measured: &measured,
            sigma: 1.0,
            orientation: None,
        });
    }
    let zero = DVector::zeros(count);
    let columns =
        jacobian(&PoseResiduals::new(&model, poses, (0..count).collect(), zero.clone()), &zero);
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by_key(|&k| model.parameters.get(k).map_or(0, turn));
    let chosen = independent(&columns, &order);
    Ok(chosen.iter().filter_map(|&k| Some(model.parameters.get(k)?.name.clone())).collect())
}

/// When a parameter has its turn; those of one turn go in the order of the arm.
fn turn(parameter: &Parameter) -> usize {
    let field = parameter.name.rsplit('.').next().unwrap_or_default();
    let fields = ["alpha", "a", "theta", "d", "beta"];
    if parameter.site.is_placement() {
        0
    } else {
        1 + fields.iter().position(|own| *own == field).unwrap_or(fields.len())
    }
}

/// Those of the columns, in this order, that are no combination of the ones before.
fn independent(columns: &DMatrix<f64>, order: &[usize]) -> Vec<usize> {
    let (mut basis, mut chosen): (Vec<DVector<f64>>, Vec<usize>) = (Vec::new(), Vec::new());
    for &k in order {
        let mut rest = columns.column(k).into_owned();
        let whole = rest.norm();
        // Twice is enough for orthogonality to rounding.
        for own in basis.iter().chain(&basis) {
            rest.axpy(-own.dot(&rest), own, 1.0);
        }
        let left = rest.norm();
        if left > NEW * whole && whole > 0.0 {
            basis.push(rest / left);
            chosen.push(k);
        }
    }
    chosen
}
