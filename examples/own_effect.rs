//! An effect that no catalogue holds, without touching flexcal: `cargo run --example own_effect`.
//!
//! Suppose that the second joint of the lunar sampler has a belt that slackens as it is warmed. One parameter more at a slot of
//! the model, multiplied by a driver (docs/effects.md lists both), fitted beside everything that the problem declares.

use std::error::Error;
use std::path::Path;

use flexcal::identify::{Options, Placement, identify, identify_model};
use flexcal::measurement::Dataset;
use flexcal::model::Model;
use flexcal::model::effect::{Term, named};
use flexcal::model::parameter::{Driver, JointField, Slot};
use flexcal::problem::Problem;

fn main() -> Result<(), Box<dyn Error>> {
    let problem = Problem::read(Path::new("problems/lunar-sampler"))?;
    let (data, _warnings) = Dataset::read(&problem)?;
    let options = Options::default();

    // Joints count from 0 here; the last number is 1 σ of the prior [rad/K].
    let slot = Slot::Joint { joint: 1, field: JointField::Theta };
    let slack = Term::driven("slack", slot, Driver::Warming { reference: 20.0 }, 1e-4);
    let belt = named("joint-belt", "2", vec![slack]);
    let placement = Placement::of(&data.measurements);
    let model = Model::with_terms(&problem, &placement.bases, &placement.targets, &belt)?;

    let before = identify(&problem, &data, &options)?;
    let after = identify_model(&model, &problem, &data, &options)?;
    let own = after.estimate("joint-belt[2].slack").ok_or("not fitted")?;
    let rms = |poses: f64| poses * 1e3;
    #[expect(clippy::print_stdout, reason = "an example shows what it found")]
    {
        println!("{} = {:.2e} ± {:.1e} rad/K", own.name, own.estimate, own.std_error.unwrap_or(f64::NAN));
        println!(
            "rms error on held-out poses: {:.3} mm without it, {:.3} mm with it",
            rms(before.fitted.held_out.rms.norm),
            rms(after.fitted.held_out.rms.norm)
        );
        println!(
            "(the rig's link bows with temperature, so part of that looks like a slack belt: compare `flexcal trace`)"
        );
    }
    Ok(())
}
