//! Readings of the formulas of \[Chen2021\] that the study compares.

use crate::paper::{Form, Misprint, Reading};

/// Interpretation of the formulas of the paper, with its name.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedReading {
    /// Name of the reading in results.
    pub name: String,
    /// Numbers of the equations that are kept as printed; `all` if all are corrected.
    pub place: String,
    /// Description in a few words.
    pub summary: String,
    /// Form of each equation, printed or corrected.
    pub reading: Reading,
    /// Misprint of the reading, if the reading keeps only one; else `None`.
    pub misprint: Option<Misprint>,
}

/// Returns the readings: all equations corrected, each misprint alone, both misprinted transfers to
/// the end point, and all misprints that can be run together with and without eq. 21.
pub fn readings() -> Vec<NamedReading> {
    let named = |name: &str, place: &str, summary: &str, reading: Reading| NamedReading {
        name: name.to_owned(),
        place: place.to_owned(),
        summary: summary.to_owned(),
        reading,
        misprint: None,
    };
    let alone = |misprint: Misprint| NamedReading {
        misprint: Some(misprint),
        ..named(misprint.as_str(), misprint.place(), misprint.summary(), misprint.into())
    };
    let printed = Reading::from(Form::Printed);
    let mut all_readings = vec![named("corrected", "all", "no misprint", Reading::default())];
    all_readings.extend(Misprint::EACH.map(alone));
    all_readings.push(NamedReading {
        reading: Reading::from(Misprint::LinkSide).with(Misprint::TransferIndex, Form::Printed),
        ..named(
            "both-transfers",
            "eq. 16, 21",
            "both transfers to the end point as printed",
            printed,
        )
    });
    all_readings.push(named(
        "as-printed",
        "4-21",
        "every misprint that can have been run together",
        printed,
    ));
    all_readings.push(named(
        "as-printed-but-link-side",
        "4-10",
        "the same with eq. 21 corrected",
        printed.with(Misprint::LinkSide, Form::Corrected),
    ));
    all_readings
}
