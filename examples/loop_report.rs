//! Closes the loop on a problem and writes its report: `cargo run --example loop_report -- PROBLEM
//! FOLDER [FILE…]`.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::{env, fs};

use flexcal::fit::Options;
use flexcal::measurement::Dataset;
use flexcal::problem::Problem;
use flexcal::report;
use flexcal::results::PlotData;
use flexcal::select::close;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [problem, folder, files @ ..] = &arguments[..] else {
        return Err("PROBLEM FOLDER [FILE…]".into());
    };
    let (problem, folder) = (Problem::read(Path::new(problem))?, Path::new(folder));
    let files: Vec<PathBuf> = files.iter().map(PathBuf::from).collect();
    let files = if files.is_empty() { &problem.data.files } else { &files };
    let (data, _warnings) = Dataset::read_files(files, &problem)?;
    let closure = close(&problem, &data, &Options::default())?;
    let shown = PlotData::of_loop(&problem, &data, &closure)?;
    let page = report::loop_report(&problem, &closure, &shown);
    fs::create_dir_all(folder.join("figures"))?;
    for (name, figure) in &page.figures {
        fs::write(folder.join("figures").join(name), figure)?;
    }
    Ok(fs::write(folder.join("report.html"), page.html)?)
}
