//! Derivatives of every kind of row, compared with extrapolated differences.

use flexcal::fit::Placement;
use flexcal::least_squares::{check_jacobian, jacobian};
use flexcal::model::PoseResiduals;
use flexcal::problem::Observation;
use flexcal::quantity::Unit;
use nalgebra::DVector;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

use crate::bench::{AROUND, Bench, problem};
use crate::common::made::{draw, model_of};
use crate::common::reading::read_dataset;

/// Largest allowed difference of a column of the Jacobian, relative to its norm.
const WORST: f64 = 1e-7;

#[test]
fn derivatives_of_every_kind() {
    let elastic = problem(&format!("\"base.*\" = {{ free = true }}\n{AROUND}"));
    let mut rigid = elastic.clone();
    rigid.joints.iter_mut().for_each(|joint| joint.stiffness = None);
    rigid.parameters.retain(|rule| !rule.pattern.contains("stiffness"));
    for (what, problem) in [("elastic", elastic), ("rigid", rigid)] {
        let table = Bench::new(problem.clone(), 3)
            .table(&["position", "point", "distance", "plane", "sphere", "tilt"], 8);
        let rows = read_dataset(&problem, &table).measurements;
        // Tilts of every frame, including the base.
        let mut rows = rows;
        for row in 0..rows.len() {
            if let Observation::Tilt(frame) = &mut rows.observations[row] {
                *frame = row % (problem.joints.len() + 1);
            }
        }
        let model = model_of(&problem, &rows);
        let x = draw(&model, |_| 0.3, &mut ChaCha8Rng::seed_from_u64(5));
        let poses = Placement::of(&rows).poses(&rows, &(0..rows.len()).collect::<Vec<_>>(), 1e-3);
        let kinds: Vec<usize> = poses.iter().map(|pose| pose.observation.coordinates()).collect();
        assert!(kinds.contains(&1) && kinds.contains(&3));
        let residuals =
            PoseResiduals::new(&model, poses, (0..model.parameters.len()).collect(), x.clone());
        let step = |unit| if matches!(unit, Unit::Angle | Unit::Length) { 0.1 } else { 0.5 };
        let step = DVector::from_iterator(
            x.len(),
            model.parameters.iter().map(|parameter| step(parameter.unit())),
        );
        let check = check_jacobian(&residuals, &x, &step);
        let (worst, column) = check.worst().unwrap();
        println!(
            "{what}: {} parameters, worst {:.1e} at {}",
            x.len(),
            column.relative_error,
            model.parameters[worst].name
        );
        assert!(
            column.relative_error < WORST,
            "{what}: {} {column:?}",
            model.parameters[worst].name
        );
        // Every fixture has a non-zero derivative.
        let exact = jacobian(&residuals, &x);
        for (k, parameter) in model.parameters.iter().enumerate() {
            assert!(exact.column(k).norm() > 0.0, "{what}: {} has no effect", parameter.name);
        }
    }
}
