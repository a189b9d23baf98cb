//! The readings of the paper's formulas that are tried.

use crate::paper::{Form, Misprint, Reading};

/// A reading with its name.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedReading {
    /// Name in results.
    pub name: String,
    /// The equations that are kept as printed, or what it is.
    pub place: String,
    /// What it says, in a few words.
    pub summary: String,
    /// The forms.
    pub reading: Reading,
    /// The misprint, where it is one alone.
    pub misprint: Option<Misprint>,
}

/// Everything corrected, each misprint alone, eq. 21 with each other misprint that may have been
/// run, and everything as printed that may have been run, with and without eq. 21.
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
    let mut all = vec![named("corrected", "all", "no misprint", Reading::default())];
    all.extend(Misprint::ALL.map(alone));
    all.push(NamedReading {
        reading: Reading::from(Misprint::LinkSide).with(Misprint::TransferIndex, Form::Printed),
        ..named(
            "both-transfers",
            "eq. 16, 21",
            "both transfers to the end point as printed",
            printed,
        )
    });
    all.push(named(
        "as-printed",
        "4-21",
        "every misprint that can have been run together",
        printed,
    ));
    all.push(named(
        "as-printed-but-link-side",
        "4-10",
        "the same with eq. 21 corrected",
        printed.with(Misprint::LinkSide, Form::Corrected),
    ));
    all
}
