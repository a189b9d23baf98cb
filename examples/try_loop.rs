use flexcal::diagnosis::close;
use flexcal::measurement::{Measurements, Split};
use flexcal::problem::Problem;
use flexcal::study::Options;
use std::path::{Path, PathBuf};
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let problem = Problem::read(Path::new(&args[1])).unwrap();
    let files: Vec<PathBuf> = args[2..].iter().map(PathBuf::from).collect();
    let files = if files.is_empty() { problem.data.files.clone() } else { files };
    let (m, _) = Measurements::read(&files, &problem).unwrap();
    let split = Split::new(&problem, &m).unwrap();
    let t = std::time::Instant::now();
    let c = close(&problem, &m, &split, &Options::default()).unwrap();
    println!("{} rounds {} time {:.2}", args.last().unwrap(), c.steps.len(), t.elapsed().as_secs_f64());
    println!(
        "  before {:.4} after {:.4} rms {:.4} chi2 {:?} -> {:?}",
        c.before.fit.fitted.held_out.mean.norm * 1e3,
        c.after.fitted.held_out.mean.norm * 1e3,
        c.after.fitted.held_out.rms.norm * 1e3,
        c.before.fit.reduced_chi2,
        c.after.reduced_chi2
    );
    println!(
        "  {:?} gain {:?} structured before {} after {}",
        c.verdict,
        c.gain,
        c.before.findings.is_structured(),
        c.findings.is_structured()
    );
    if let Some(u) = &c.unexplained {
        println!(
            "  unexplained {} {:?} p {:.1e} {:?}",
            u.place,
            u.depends_on,
            u.p_value,
            u.correction.as_ref().map(|c| (c.beyond, c.cross_validated, c.held_out.mean.norm, c.held_out.rms.norm))
        );
    }
    for f in &c.effects {
        println!("    alternatives {:?}", f.alternatives);
        println!(
            "  {:?} p {:.1e} {:?}",
            f.effect,
            f.p_value,
            f.estimates.iter().map(|e| (e.name.clone(), e.estimate, e.std_error)).collect::<Vec<_>>()
        );
    }
}
