//! A law that the catalogue does not hold: `cargo run --example own_effect`.
//!
//! Suppose that the second joint of the lunar sampler has a belt that slackens as it is warmed. A law
//! is written as in a problem file, with a site and formulas (docs/effects.md lists both). It is
//! fitted beside everything that the problem declares, and offered to the search for effects that the
//! model lacks, beside the catalogue.

use std::error::Error;
use std::path::Path;

use flexcal::fit::{Options, identify};
use flexcal::measurement::Dataset;
use flexcal::problem::Problem;
use flexcal::select::trace;

/// Δθ = slack · (T − T₀).
const BELT: &str = "law = { name = 'belt', at = 'joint2', terms = ['T'], sigma_deg = 0.006 }";

fn main() -> Result<(), Box<dyn Error>> {
    let problem = Problem::read(Path::new("problems/lunar-sampler"))?;
    let (data, _warnings) = Dataset::read(&problem)?;
    let belt = problem.effect(BELT, Path::new("belt"))?.effect;

    let before = identify(&problem, &data, &Options::default())?;
    let after = identify(&problem.with_effect(belt.clone()), &data, &Options::default())?;
    let slack = after.estimate("law[belt].1").ok_or("not fitted")?;
    let traced = trace(&problem, &data, &Options::default().with_candidates(vec![belt.clone()]))?;
    let rank = traced.ranking.iter().position(|ranked| ranked.effect == belt);
    let millimetres = |metres: f64| metres * 1e3;
    #[expect(clippy::print_stdout, reason = "an example shows what it found")]
    {
        println!(
            "{} = {:.2e} ± {:.1e} rad/K",
            slack.name,
            slack.estimate,
            slack.std_error.unwrap_or(f64::NAN)
        );
        println!(
            "rms error on held-out poses: {:.3} mm without it, {:.3} mm with it",
            millimetres(before.fitted.held_out.rms.norm),
            millimetres(after.fitted.held_out.rms.norm)
        );
        match rank {
            Some(rank) => println!("rank {} of the candidates; the first is:", rank + 1),
            None => println!("not among the candidates that the residual points to; the first is:"),
        }
        println!("{}", traced.describe(&traced.ranking[0].effect));
    }
    Ok(())
}
