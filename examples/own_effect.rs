//! An effect that no catalogue holds, without touching flexcal: `cargo run --example own_effect`.
//!
//! Suppose that the second joint of the lunar sampler has a belt that slackens as it is warmed. One
//! parameter more at a site of the model, multiplied by a regressor (docs/effects.md lists both):
//! fitted beside everything that the problem declares, and offered to the search for what the model
//! lacks, beside the catalogue.

use std::error::Error;
use std::path::Path;

use flexcal::fit::{Options, identify};
use flexcal::measurement::Dataset;
use flexcal::model::effect::{CustomEffect, Term};
use flexcal::model::parameter::{ParameterSite, Regressor};
use flexcal::problem::{Effect, Problem};
use flexcal::select::trace;

/// Δθ = slack · (T − 20 °C).
#[derive(Debug)]
struct Belt {
    /// Number of the joint, from 1.
    joint: usize,
}

impl CustomEffect for Belt {
    fn name(&self) -> &'static str {
        "joint-belt"
    }

    fn place(&self) -> String {
        self.joint.to_string()
    }

    fn terms(&self, problem: &Problem) -> Vec<Term> {
        // The last number is 1 σ of the prior [rad/K].
        let site = ParameterSite::coordinate(problem, self.joint);
        vec![Term::driven("slack", site, Regressor::Warming { reference: 20.0 }, 1e-4)]
    }

    fn describe(&self) -> String {
        format!("the belt of joint {} slackens with temperature", self.joint)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let problem = Problem::read(Path::new("problems/lunar-sampler"))?;
    let (data, _warnings) = Dataset::read(&problem)?;
    let belt = Effect::custom(Belt { joint: 2 });

    let before = identify(&problem, &data, &Options::default())?;
    let after = identify(&problem.with_effect(belt.clone()), &data, &Options::default())?;
    let own = after.estimate("joint-belt[2].slack").ok_or("not fitted")?;
    let traced = trace(&problem, &data, &Options::default().with_candidates(vec![belt.clone()]))?;
    let rank = traced.ranking.iter().position(|ranked| ranked.effect == belt);
    let rms = |poses: f64| poses * 1e3;
    #[expect(clippy::print_stdout, reason = "an example shows what it found")]
    {
        println!(
            "{} = {:.2e} ± {:.1e} rad/K",
            own.name,
            own.estimate,
            own.std_error.unwrap_or(f64::NAN)
        );
        println!(
            "rms error on held-out poses: {:.3} mm without it, {:.3} mm with it",
            rms(before.fitted.held_out.rms.norm),
            rms(after.fitted.held_out.rms.norm)
        );
        match rank {
            Some(rank) => {
                println!("number {} of what the residual points to, the first is:", rank + 1)
            }
            None => println!("not among what the residual points to, the first is:"),
        }
        println!("{}", traced.describe(&traced.ranking[0].effect));
    }
    Ok(())
}
