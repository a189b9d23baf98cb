//! Commands for an arm whose effects depend on its commands, checked on the virtual rig.

use flexcal::fit::compensate;
use flexcal::problem::Effect;
use flexcal::rig::Rig;
use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::catalogue::{conditions, declared, in_truth, lunar, poses, strengths};
use crate::common::made::{model_of, predicted};

#[test]
fn a_gear_ratio_and_harmonics_are_taken_at_the_command() {
    let (mut arm, _) = lunar();
    arm.statics.beam_elements = 12;
    let effects = [
        (Effect::GearRatio { joint: 3 }, vec![4e-3]),
        (Effect::JointHarmonic { joint: 2, orders: vec![1, 12] }, vec![5e-3, 2e-3, 1e-3, 1e-3]),
        (Effect::JointCoupling { joint: 4, from: 2 }, vec![2e-3]),
    ];
    let problem = declared(&arm, &effects.clone().map(|(effect, _)| effect));
    let mut targets = poses(&arm, 10, true, &mut ChaCha8Rng::seed_from_u64(1));
    // The targets are the positions of the arm without effects.
    targets.positions =
        predicted(&arm, &targets, &DVector::zeros(model_of(&arm, &targets).parameters.len()));
    let model = model_of(&problem, &targets);
    let values: Vec<f64> = effects.iter().flat_map(|(_, values)| values.clone()).collect();
    let commands = compensate(&problem, &model, &strengths(&model, &values), &targets).unwrap();
    let rig = Rig::new(arm.clone(), effects.iter().map(|effect| in_truth(&arm, effect)).collect());
    for command in &commands {
        let mut set = conditions(&targets, command.row);
        let miss =
            |set: &_| (rig.position(set).unwrap() - targets.positions[command.row]).norm() * 1e3;
        let before = miss(&set);
        set.configuration.clone_from(&command.configuration);
        println!("{before:.3} mm before, {:.5} mm after", miss(&set));
        assert!(command.is_reached() && before > 1.0 && miss(&set) < 0.01, "row {}", command.row);
    }
}
