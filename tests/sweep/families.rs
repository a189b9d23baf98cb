//! Effects of every family at a realistic size, and declared problems that lack them.

use flexcal::problem::{Effect, Equilibrium, Problem};
use flexcal::rig::TrueEffect;

use crate::bench::{catalogued, lunar};

/// Effect that the declared problem lacks.
#[derive(Clone)]
pub struct Lacking {
    /// Effect that the loop should name.
    pub effect: Effect,
    /// Values on the rig, SI; none if the declared problem lacks elasticity instead.
    pub values: Vec<f64>,
}

impl Lacking {
    pub fn new(effect: Effect, values: &[f64]) -> Self {
        Self { effect, values: values.to_vec() }
    }

    /// Returns the effect on the rig that the fully declared arm lacks.
    pub fn on_the_rig(&self) -> Option<TrueEffect> {
        let at_rest = self.effect == Effect::DeflectedEquilibrium;
        (!self.values.is_empty() && !at_rest).then(|| catalogued(&self.effect, &self.values))
    }

    /// Removes from a problem what the effect represents.
    pub fn leave_out(&self, problem: &mut Problem) {
        match &self.effect {
            Effect::DeflectedEquilibrium => problem.statics.equilibrium = Equilibrium::Undeflected,
            Effect::JointCompliance { joint } if self.values.is_empty() => {
                problem.joints[joint - 1].stiffness = None;
            }
            Effect::LinkBending { joint } if self.values.is_empty() => {
                if let Some(beam) = &mut problem.joints[joint - 1].beam {
                    (beam.ei_y, beam.ei_z) = (None, None);
                }
            }
            _ => {}
        }
    }
}

/// Returns the declared problem without these effects.
pub fn declared(lacking: &[Lacking]) -> Problem {
    let mut problem = lunar();
    for one in lacking {
        one.leave_out(&mut problem);
    }
    problem
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Returns single effects.
pub fn catalogue() -> Vec<Lacking> {
    let harmonic = |joint, order, sin: f64, cos: f64| {
        Lacking::new(
            Effect::JointHarmonic { joint, orders: vec![order] },
            &[sin * DEGREE, cos * DEGREE],
        )
    };
    let link = |name: &str| name.to_owned();
    let mut all = vec![
        harmonic(1, 2, 0.02, 0.0),
        harmonic(2, 1, 0.016, 0.012),
        harmonic(2, 3, 0.02, 0.0),
        harmonic(3, 1, 0.012, 0.016),
        harmonic(3, 2, 0.02, 0.0),
        harmonic(4, 1, 0.03, 0.0),
        harmonic(4, 2, 0.02, 0.02),
    ];
    for joint in 1..=4 {
        all.push(Lacking::new(Effect::Backlash { joint }, &[0.03 * DEGREE]));
        all.push(Lacking::new(
            Effect::GearRatio { joint },
            &[if joint == 4 { 1.5e-3 } else { 7e-4 }],
        ));
    }
    all.push(Lacking::new(Effect::GearRatio { joint: 2 }, &[1.5e-3]));
    all.push(Lacking::new(Effect::GearRatio { joint: 3 }, &[5e-4]));
    for joint in [2, 3, 4] {
        all.push(Lacking::new(Effect::JointCompliance { joint }, &[]));
    }
    all.push(Lacking::new(Effect::JointCompliance { joint: 1 }, &[1e-5]));
    for (joint, cubic) in [(2, 2e-11), (3, 1e-10), (4, 5e-7)] {
        all.push(Lacking::new(Effect::JointNonlinearStiffness { joint }, &[cubic]));
    }
    for joint in [2, 3, 4] {
        all.push(Lacking::new(Effect::JointLateralCompliance { joint }, &[2e-5, 1e-5]));
    }
    all.push(Lacking::new(Effect::JointLateralCompliance { joint: 3 }, &[0.0, 5e-5]));
    for joint in [2, 3, 4] {
        all.push(Lacking::new(Effect::JointThermalDrift { joint }, &[3e-5]));
    }
    for (joint, from) in [(4, 3), (3, 2), (2, 1), (4, 2)] {
        all.push(Lacking::new(Effect::JointCoupling { joint, from }, &[1e-3]));
    }
    for joint in [3, 4] {
        all.push(Lacking::new(Effect::LinkBending { joint }, &[]));
    }
    for name in ["A", "B"] {
        all.push(Lacking::new(Effect::LinkThermalBending { link: link(name) }, &[2e-5, 0.0]));
        all.push(Lacking::new(Effect::LinkThermalBending { link: link(name) }, &[1e-5, 2e-5]));
        all.push(Lacking::new(Effect::LinkThermalExpansion { link: link(name) }, &[2e-5]));
        all.push(Lacking::new(Effect::UnmodelledMass { link: link(name) }, &[0.5, 1.2]));
    }
    all.push(Lacking::new(Effect::PayloadMass, &[0.35]));
    all.push(Lacking::new(Effect::HoistForce, &[0.05]));
    all.push(Lacking::new(Effect::HoistForce, &[0.1]));
    all.push(Lacking::new(Effect::HoistDirection, &[0.05, 0.0, 0.0]));
    all.push(Lacking::new(Effect::HoistDirection, &[0.0, 0.03, 0.03]));
    all.push(Lacking::new(Effect::BaseCompliance, &[2e-6, 1e-6]));
    all.push(Lacking::new(Effect::BaseCompliance, &[0.0, 2e-6]));
    all.push(Lacking::new(Effect::GravityDirection, &[0.3 * DEGREE, 0.0]));
    all.push(Lacking::new(Effect::GravityDirection, &[0.2 * DEGREE, 0.3 * DEGREE]));
    all.push(Lacking::new(Effect::DeflectedEquilibrium, &[1.0]));
    all.push(Lacking::new(Effect::TrackerScale, &[1e-4]));
    all.push(Lacking::new(Effect::TrackerScale, &[3e-4]));
    all.push(Lacking::new(Effect::FrameStrain, &[3e-4, -3e-4, 0.0, 0.0, 0.0, 0.0]));
    all.push(Lacking::new(Effect::FrameStrain, &[0.0, 0.0, 0.0, 0.0, 4e-4, 0.0]));
    all.push(Lacking::new(Effect::TrackerSettling { time_constant: 800.0 }, &[4e-4, 0.0, -2e-4]));
    all.push(Lacking::new(Effect::PayloadBacklash { joint: 2 }, &[0.04 * DEGREE]));
    all.push(Lacking::new(Effect::PayloadBacklash { joint: 3 }, &[0.04 * DEGREE]));
    let per_hour = 1e-3 / 3600.0;
    all.push(Lacking::new(
        Effect::TrackerDrift,
        &[0.1 * per_hour, -0.1 * per_hour, 0.05 * per_hour],
    ));
    all.push(Lacking::new(Effect::TrackerDrift, &[0.3 * per_hour, 0.2 * per_hour, 0.0]));
    all.push(Lacking::new(Effect::StationShift { at_time: 3000.0 }, &[3e-4, 0.0, 1e-4]));
    all.push(Lacking::new(Effect::StationShift { at_time: 4500.0 }, &[0.0, 2e-4, 2e-4]));
    all
}

/// Returns effects with a searched argument, and a coupled cross-section: the latest families of
/// the catalogue.
pub fn newest() -> Vec<Lacking> {
    let link = |name: &str| name.to_owned();
    let mut all = Vec::new();
    for (joint, order) in [(1, 2.43), (2, 7.37), (3, 4.6), (4, 11.5), (2, 100.5)] {
        all.push(Lacking::new(
            Effect::JointWave { joint, order },
            &[0.016 * DEGREE, 0.012 * DEGREE],
        ));
    }
    for (joint, distance) in [(2, 1.0), (3, 0.5), (1, 1.5)] {
        all.push(Lacking::new(Effect::JointHysteresis { joint, distance }, &[0.03 * DEGREE]));
    }
    for (name, part) in [("A", 1.0), ("B", 3.0)] {
        let time_constant = 400.0 * part;
        all.push(Lacking::new(
            Effect::LinkThermalBendingLag { link: link(name), time_constant },
            &[3e-5, -2e-5],
        ));
        all.push(Lacking::new(
            Effect::LinkThermalExpansionLag { link: link(name), time_constant },
            &[4e-5],
        ));
        all.push(Lacking::new(Effect::TwistBending { link: link(name) }, &[5e-6, -3e-6]));
    }
    for joint in [2, 3] {
        all.push(Lacking::new(
            Effect::JointThermalDriftLag { joint, time_constant: 600.0 },
            &[6e-5],
        ));
    }
    all
}

/// Returns pairs of effects.
pub fn pairs() -> Vec<Vec<Lacking>> {
    let per_hour = 1e-3 / 3600.0;
    let b = || "B".to_owned();
    let harmonic = |joint, order| {
        Lacking::new(
            Effect::JointHarmonic { joint, orders: vec![order] },
            &[0.016 * DEGREE, 0.012 * DEGREE],
        )
    };
    let drift = || Lacking::new(Effect::TrackerDrift, &[0.3 * per_hour, 0.2 * per_hour, 0.0]);
    let backlash = |joint| Lacking::new(Effect::Backlash { joint }, &[0.03 * DEGREE]);
    vec![
        vec![Lacking::new(Effect::GearRatio { joint: 3 }, &[7e-4]), drift()],
        vec![backlash(2), Lacking::new(Effect::LinkThermalBending { link: b() }, &[1e-5, 2e-5])],
        vec![Lacking::new(Effect::PayloadMass, &[0.35]), harmonic(2, 1)],
        vec![Lacking::new(Effect::BaseCompliance, &[2e-6, 1e-6]), backlash(3)],
        vec![Lacking::new(Effect::HoistForce, &[0.1]), Lacking::new(Effect::TrackerScale, &[3e-4])],
        vec![harmonic(3, 2), Lacking::new(Effect::JointThermalDrift { joint: 2 }, &[3e-5])],
        vec![
            Lacking::new(Effect::StationShift { at_time: 3000.0 }, &[3e-4, 0.0, 1e-4]),
            harmonic(1, 2),
        ],
        vec![
            Lacking::new(Effect::JointCompliance { joint: 3 }, &[]),
            Lacking::new(Effect::JointCoupling { joint: 2, from: 1 }, &[1e-3]),
        ],
    ]
}

/// Returns triples of effects.
pub fn triples() -> Vec<Vec<Lacking>> {
    let with = |mut pair: Vec<Lacking>, third: Lacking| {
        pair.push(third);
        pair
    };
    let thirds = [
        Lacking::new(Effect::Backlash { joint: 2 }, &[0.03 * DEGREE]),
        Lacking::new(Effect::PayloadMass, &[0.35]),
        Lacking::new(Effect::Backlash { joint: 4 }, &[0.06 * DEGREE]),
        Lacking::new(Effect::JointHarmonic { joint: 1, orders: vec![2] }, &[0.02 * DEGREE, 0.0]),
    ];
    pairs().into_iter().zip(thirds).map(|(pair, third)| with(pair, third)).collect()
}
