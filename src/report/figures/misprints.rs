//! Figure of the errors with each misprint and each alternative model, relative to the rigid fit.

use super::prelude::*;
use crate::paper::published::{WITH_ELASTICITY, WITHOUT_ELASTICITY};
use crate::study::{
    AlternativeModel, Case, HeldOutError, MisprintStudy, Replica, ReplicaResults, Spread,
};

/// Smallest and largest ratio on the logarithmic axis.
const RATIO_RANGE: (f64, f64) = (0.02, 5.0);
/// Colours of the cases of the study; a fifth case takes the first colour again.
const CASE_COLOURS: [Colour; 4] = [INK, ACCENT, FAINT, MUTED];

/// Name of a row, with mean and spread of the ratio over specimens in each case; `None` if no fit
/// converged.
type Row = (String, Vec<Option<Spread>>);

/// Draws the ratio of the mean held-out error to that of the rigid fit, for every reading and every
/// alternative model.
pub fn misprints(study: &MisprintStudy, results: &ReplicaResults) -> Drawing {
    let spreads = |error: &dyn Fn(&Replica) -> HeldOutError| -> Vec<Option<Spread>> {
        let ratio = |case: &Case| {
            Spread::of(results.of_case(case).map(|replica| replica.ratio(error(replica))))
        };
        study.cases.iter().map(ratio).collect()
    };
    let named = results.readings.iter().enumerate();
    let readings = named.map(|(index, named)| {
        (named.name.clone(), spreads(&|replica| replica.reading_error(index, 0)))
    });
    let models = AlternativeModel::EACH.into_iter().map(|model| {
        (model.as_str().to_owned(), spreads(&|replica| replica.alternative_error(model)))
    });
    let rows: Vec<Row> = readings.chain(models).collect();
    let cases: Vec<String> = study.cases.iter().map(Case::name).collect();
    let mut legend: Vec<_> = cases
        .iter()
        .zip(CASE_COLOURS.into_iter().cycle())
        .map(|(case, colour)| (case.as_str(), colour, Mark::Dot))
        .collect();
    legend.push(("the paper", WARM, Mark::Line));
    let (low, high) = (RATIO_RANGE.0.log10(), RATIO_RANGE.1.log10());
    let at = |value: f64| value.max(RATIO_RANGE.0).log10().clamp(low, high);
    let marks = rows.iter().enumerate().flat_map(|(k, (_, spreads))| {
        let row = k as f64;
        let mark = |(j, spread): (usize, &Option<Spread>)| {
            let Spread { mean, deviation, .. } = (*spread)?;
            let y = row + 0.21 * (j as f64 - 0.5 * (spreads.len() as f64 - 1.0));
            let colour = CASE_COLOURS[j % CASE_COLOURS.len()];
            let ends = [mean - deviation, mean + deviation].map(|value| (at(value), y));
            let line = Shape::line(ends, Paint::line(colour, 1.2));
            Some([line, Shape::dot((at(mean), y), 2.4, Paint::fill(colour), None)])
        };
        let diverges = spreads.iter().all(Option::is_none);
        let note = diverges.then(|| Shape::text((low, row), 8.0, "diverges", MUTED));
        spreads.iter().enumerate().filter_map(mark).flatten().chain(note).collect::<Vec<_>>()
    });
    let names = rows.iter().map(|(name, _)| (name.clone(), INK));
    let x = Axis::logarithmic((low, high), "held-out mean over that of the rigid fit", 6);
    let paper = WITH_ELASTICITY.mean[3] / WITHOUT_ELASTICITY.mean[3];
    let panel = Panel::of_rows(19.0, (178.0, 16.0), x, names)
        .with_reference(paper.log10(), WARM)
        .with(marks);
    let caption = "Mean error at the held-out poses relative to that of the rigid fit, mean and \
                   standard deviation over specimens, with known stiffness: each misprint alone, \
                   combinations of misprints, and below them alternative models. Colours: how \
                   links and joints share the flexibility, and a single load instead of several. \
                   The line is the ratio in the paper, 2.136/3.967; a misprint can explain it if \
                   its marks meet the line.";
    let svg = chart("Error of every reading over that of the rigid fit", &legend, &[panel]);
    let cell = |spread: &Option<Spread>| spread.map_or_else(String::new, |s| fixed(s.mean, 6));
    let header = std::iter::once("reading").chain(cases.iter().map(String::as_str));
    let cells = rows.iter().map(|(name, spreads)| {
        std::iter::once(name.clone()).chain(spreads.iter().map(cell)).collect()
    });
    Drawing::new(("misprints", "Cost of each misprint"), caption, svg, sheet(header, cells))
}
