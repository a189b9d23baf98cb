//! Errors with each misprint and each alternative model, relative to the rigid fit.

use super::prelude::*;
use crate::paper::published::{WITH_ELASTICITY, WITHOUT_ELASTICITY};
use crate::study::{
    AlternativeModel, Case, HeldOutError, MisprintStudy, Replica, ReplicaResults, Spread,
};

/// Height of a row in pixels.
const ROW: i32 = 19;
/// Width for names in pixels.
const NAMES: i32 = 178;
/// Height above the rows in pixels.
const TOP: i32 = 26;
/// Ends of the logarithmic axis.
const RANGE: (f64, f64) = (0.02, 5.0);
/// Colours of the cases.
const COLOURS: [RGBColor; 4] = [INK, ACCENT, FAINT, MUTED];

/// Name of a row with mean and spread of each case.
type Row = (String, Vec<Option<Spread>>);

/// Draws the ratio of the held-out mean to that of the rigid fit, for every reading and every
/// alternative model.
pub fn misprints(study: &MisprintStudy, results: &ReplicaResults) -> Drawing {
    let spreads = |error: &dyn Fn(&Replica) -> HeldOutError| -> Vec<Option<Spread>> {
        let ratio = |case: &Case| {
            Spread::of(results.of_case(case).map(|replica| replica.ratio(error(replica))))
        };
        study.cases.iter().map(ratio).collect()
    };
    let named = results.readings.iter().enumerate();
    let mut rows: Vec<Row> = named
        .map(|(index, named)| {
            (named.name.clone(), spreads(&|replica| replica.reading_error(index, 0)))
        })
        .collect();
    rows.extend(AlternativeModel::EACH.map(|model| {
        (model.words().0.to_owned(), spreads(&|replica| replica.alternative_error(model)))
    }));
    let caption = "Mean error at the held-out poses relative to that of the rigid fit, mean and standard deviation over specimens, with \
                   known stiffness: each misprint alone, combinations of misprints, and below them alternative models. Colours: how \
                   links and joints share the flexibility, and a single load instead of several. The line is the ratio in the paper, \
                   2.136/3.967; a misprint can explain it if its marks meet the line.";
    let title = "Cost of each misprint";
    Drawing::new("misprints", title, caption, draw(study, &rows))
}

fn draw(study: &MisprintStudy, rows: &[Row]) -> String {
    let bottom = TOP + ROW * i32::try_from(rows.len()).unwrap_or_default();
    let paper = WITH_ELASTICITY.mean[3] / WITHOUT_ELASTICITY.mean[3];
    let colour = |k: usize| COLOURS[k % COLOURS.len()];
    let words: Vec<String> = study.cases.iter().map(Case::name).collect();
    figure((WIDTH, bottom + BELOW), "Error of every reading over that of the rigid fit", |area| {
        let mut marks: Vec<(&str, RGBColor, Mark)> = words
            .iter()
            .enumerate()
            .map(|(k, word)| (word.as_str(), colour(k), Mark::Dot))
            .collect();
        marks.push(("the paper", WARM, Mark::Line));
        legend(area, TOP, &marks)?;
        for value in [0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0] {
            vertical_line(area, position(value), (TOP, bottom), GRID)?;
            let number = number(value, if value < 1.0 { 2 } else { 0 });
            write(area, &number, (position(value) / px(1), bottom + 10), MUTED, HPos::Center)?;
        }
        vertical_line(area, position(paper), (TOP, bottom), WARM)?;
        for (k, (name, spreads)) in (0..).zip(rows) {
            let y = TOP + ROW * k + ROW / 2;
            write(area, name, (NAMES - 10, y), INK, HPos::Right)?;
            if spreads.iter().all(Option::is_none) {
                write(area, "diverges", (NAMES + 8, y), MUTED, HPos::Left)?;
            }
            for (j, spread) in spreads.iter().enumerate() {
                let Some(Spread { mean, deviation, .. }) = *spread else { continue };
                let shift = px(4)
                    * (2 * i32::try_from(j).unwrap_or_default()
                        - i32::try_from(spreads.len()).unwrap_or_default()
                        + 1)
                    / 2;
                let at = px(y) + shift;
                let ends = vec![(position(mean - deviation), at), (position(mean + deviation), at)];
                area.draw(&PathElement::new(ends, line(colour(j), 1.2)))?;
                area.draw(&Circle::new((position(mean), at), pixels(2.4), colour(j).filled()))?;
            }
        }
        let middle = NAMES + (WIDTH - NAMES) / 2;
        write(
            area,
            "held-out mean over that of the rigid fit",
            (middle, bottom + 28),
            INK,
            HPos::Center,
        )
    })
}

/// Returns the horizontal position of a ratio in drawn pixels.
fn position(value: f64) -> i32 {
    let (low, high) = (RANGE.0.log10(), RANGE.1.log10());
    let fraction = (value.max(RANGE.0).log10().clamp(low, high) - low) / (high - low);
    px(NAMES) + pixels(fraction * f64::from(WIDTH - NAMES - 16))
}
