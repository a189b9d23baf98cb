//! What each misprint and each rival leaves, over what the rigid fit leaves.

use super::prelude::*;
use crate::paper::published::{WITH_ELASTICITY, WITHOUT_ELASTICITY};
use crate::study::{
    AlternativeModel, Case, HeldOutError, MisprintStudy, Replica, ReplicaResults, Spread,
};

const ROW: i32 = 19;
/// Room for names.
const NAMES: i32 = 178;
const TOP: i32 = 26;
/// Ends of the logarithmic axis.
const RANGE: (f64, f64) = (0.02, 5.0);
const COLOURS: [RGBColor; 4] = [INK, ACCENT, FAINT, MUTED];

/// A row: its name, and mean and spread for each case.
type Row = (String, Vec<Option<Spread>>);

/// Ratio of the held-out mean to that of the rigid fit, of every reading and every rival.
pub fn misprints(study: &MisprintStudy, found: &ReplicaResults) -> Drawing {
    let spreads = |left: &dyn Fn(&Replica) -> HeldOutError| -> Vec<Option<Spread>> {
        let ratio = |case: &Case| Spread::of(found.of_case(case).map(|own| own.ratio(left(own))));
        study.cases.iter().map(ratio).collect()
    };
    let named = found.readings.iter().enumerate();
    let mut rows: Vec<Row> = named
        .map(|(place, named)| (named.name.clone(), spreads(&|own| own.reading_error(place, 0))))
        .collect();
    rows.extend(
        AlternativeModel::EACH.map(|rival| {
            (rival.words().0.to_owned(), spreads(&|own| own.alternative_error(rival)))
        }),
    );
    let caption = "Mean error of the held-out poses over that of the rigid fit, mean and standard deviation over specimens, stiffness \
                   known: each misprint alone, their combinations, and below them other explanations. Colours: how links and joints \
                   share the flexibility, and one load in place of many. The line is the paper's 2.136/3.967; a misprint \
                   explains it where its marks meet the line.";
    let title = "What each misprint costs";
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
            upright(area, place(value), (TOP, bottom), GRID)?;
            let number = number(value, if value < 1.0 { 2 } else { 0 });
            write(area, &number, (place(value) / px(1), bottom + 10), MUTED, HPos::Center)?;
        }
        upright(area, place(paper), (TOP, bottom), WARM)?;
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
                let ends = vec![(place(mean - deviation), at), (place(mean + deviation), at)];
                area.draw(&PathElement::new(ends, line(colour(j), 1.2)))?;
                area.draw(&Circle::new((place(mean), at), pixels(2.4), colour(j).filled()))?;
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

/// Where a ratio stands, in pixels as drawn.
fn place(value: f64) -> i32 {
    let (low, high) = (RANGE.0.log10(), RANGE.1.log10());
    let part = (value.max(RANGE.0).log10().clamp(low, high) - low) / (high - low);
    px(NAMES) + pixels(part * f64::from(WIDTH - NAMES - 16))
}
