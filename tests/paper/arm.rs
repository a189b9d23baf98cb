//! Lunar sampler with its golden positions, and the results of the dual-number model.

use flexcal::least_squares::jacobian;
use flexcal::model::parameter::Parameter;
use flexcal::model::{Model, Pose, PoseResiduals};
use flexcal::paper::{EndPoint, Mdh, Parameters, Reading};
use flexcal::problem::{Equilibrium, Freedom, Observation, Problem, Quantities};
use nalgebra::{DMatrix, DVector, Vector3};

use crate::common::arms::{ODD, TABLE_2, golden_problem, parse, without_elasticity};
use crate::common::golden::{GoldenRow, golden_rows};

/// Returns the lunar sampler with loads on the rigid arm; every parameter of the arm is free
/// without prior.
pub fn problem() -> Problem {
    prepared(golden_problem())
}

/// Returns an arm in general position, prepared in the same way, so that every term matters.
pub fn odd_problem() -> Problem {
    prepared(parse(ODD))
}

fn prepared(mut problem: Problem) -> Problem {
    problem.statics.equilibrium = Equilibrium::Undeflected;
    problem.parameters.retain(|rule| !["tool.*", "base.*"].contains(&rule.pattern.as_str()));
    for rule in &mut problem.parameters {
        let none = Quantities::default();
        rule.freedom = Freedom::Free { sigma: none, min: none, max: none };
    }
    problem
}

/// Removes the elasticity of a prepared problem.
pub fn rigid(problem: Problem) -> Problem {
    let mut problem = without_elasticity(problem);
    problem
        .parameters
        .retain(|rule| rule.pattern.starts_with("joint") && rule.pattern != "joint*.stiffness");
    problem
}

/// Returns a configuration of the odd arm for each of the sampler's.
pub fn odd_rows(name: &str) -> Vec<GoldenRow> {
    let mut rows = golden_rows(name);
    for row in &mut rows {
        let [a, b, c, d] = row.q[..] else { continue };
        row.q = vec![a, 0.0, b, 0.2 * c, d];
    }
    rows
}

pub fn table_2() -> Vec<Mdh> {
    let row = |[alpha, a, theta, d, beta]: [f64; 5]| Mdh {
        alpha: alpha.to_radians(),
        a,
        theta: theta.to_radians(),
        d,
        beta: beta.to_radians(),
    };
    TABLE_2.into_iter().map(row).collect()
}

/// Returns e = table 2 − nominal, shape = (20).
pub fn table_2_errors(problem: &Problem) -> DVector<f64> {
    let nominal = Parameters::nominal(problem).geometry;
    let pairs = nominal.into_iter().zip(table_2());
    let errors = pairs.flat_map(|(mut from, mut to)| {
        let (from, to) = (from.fields_mut().map(|v| *v), to.fields_mut().map(|v| *v));
        std::array::from_fn::<f64, 5, _>(|k| to[k] - from[k])
    });
    DVector::from_iterator(20, errors)
}

/// Returns nominal parameters, and the same with the geometry of table 2.
pub fn both(problem: &Problem) -> [Parameters; 2] {
    let nominal = Parameters::nominal(problem);
    [nominal.clone(), Parameters { geometry: table_2(), ..nominal }]
}

pub fn end(
    problem: &Problem,
    parameters: &Parameters,
    row: &GoldenRow,
    reading: impl Into<Reading>,
) -> EndPoint {
    EndPoint::new(problem, parameters, &row.setup(), &reading.into())
}

pub fn model(problem: &Problem) -> Model {
    Model::new(problem, &[String::new()], &[String::new()]).unwrap()
}

/// Returns ∂(position)/∂x of one pose by dual numbers, shape = (3, parameters of the model).
pub fn dual_jacobian(model: &Model, row: &GoldenRow, x: &DVector<f64>) -> DMatrix<f64> {
    let pose = Pose {
        setup: row.setup(),
        base: 0,
        target: 0,
        observation: Observation::default(),
        measured: &Vector3::zeros(),
        sigma: 1.0,
        orientation: None,
    };
    let residuals = PoseResiduals::new(model, vec![pose], (0..x.len()).collect(), x.clone());
    -jacobian(&residuals, x)
}

/// Returns the index of a model parameter in e = [e₁ … e_n]; `None` for a flexibility.
pub fn place_in_e(parameter: &Parameter) -> Option<usize> {
    let (joint, field) = parameter.name.strip_prefix("joint")?.split_once('.')?;
    let field = ["alpha", "a", "theta", "d", "beta"].iter().position(|name| *name == field)?;
    Some(5 * (joint.parse::<usize>().unwrap() - 1) + field)
}
