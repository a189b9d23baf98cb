//! The report that people look at: one HTML page that needs nothing else, and its figures as files of their own.
//!
//! - [`figures`]: one figure a file. `style`: how page and figures look, light and dark.
//! - `page`: the frame of every report. `headline`, `effects`, `parameters`, `checks`: its parts.

mod checks;
mod effects;
mod figures;
mod headline;
mod page;
mod parameters;
mod style;

use maud::{Markup, html};

use crate::diagnose::ClosedLoop;
use crate::identify::{Comparison, Identification};
use crate::problem::Problem;
use crate::report::plot_data::Picture;
use figures::Figure;
pub use figures::is_figure;
use page::{grid, section};

/// A report for people.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Page {
    /// The whole page: no scripts, nothing to load.
    pub html: String,
    /// File name and SVG text of every figure.
    pub figures: Vec<(String, String)>,
}

/// Collects the figures of a page while it is written.
#[derive(Debug, Default)]
struct Figures(Vec<Figure>);

impl Figures {
    /// Figures side by side.
    fn show(&mut self, figures: impl IntoIterator<Item = Figure>) -> Markup {
        let new: Vec<Figure> = figures.into_iter().collect();
        let first = self.0.len() + 1;
        self.0.extend(new.iter().cloned());
        grid(&new, first)
    }

    fn page(self, problem: &Problem, kind: &str, body: &Markup) -> Page {
        let files = self.0.iter().map(|figure| (format!("{}.svg", figure.name), style::alone(&figure.svg)));
        Page { figures: files.collect(), html: page::whole(problem, kind, body) }
    }
}

/// The report of `identify`.
pub fn identification_page(problem: &Problem, found: &Identification, picture: &Picture) -> Page {
    let mut figures = Figures::default();
    let body = html! {
        (headline::of_identification(problem, found))
        (section("Errors", &figures.show([figures::errors(picture), figures::vectors(picture)])))
        (left(&mut figures, found, picture))
        (identified(&mut figures, found, picture, "estimate.json"))
    };
    figures.page(problem, "identification", &body)
}

/// The report of `compare`.
pub fn comparison_page(problem: &Problem, comparison: &Comparison, picture: &Picture) -> Page {
    let mut figures = Figures::default();
    let joint = &comparison.joint;
    let beside = std::iter::once(figures::strategies(comparison)).chain(figures::ablations(comparison));
    let body = html! {
        (headline::of_comparison(problem, comparison))
        (section("Side by side", &html! {
            (figures.show(beside))
            (parameters::comparison_table(comparison))
        }))
        (section("Errors of the joint fit", &figures.show([figures::errors(picture), figures::vectors(picture)])))
        (left(&mut figures, joint, picture))
        (identified(&mut figures, joint, picture, "the estimate.json of flexcal identify"))
    };
    figures.page(problem, "comparison", &body)
}

/// The report of the loop.
pub fn closure_page(problem: &Problem, closure: &ClosedLoop, picture: &Picture) -> Page {
    let mut figures = Figures::default();
    let causes = effects::figures(closure, picture);
    let body = html! {
        (headline::of_closure(problem, closure))
        (section("What was found", &html! {
            (effects::story(closure))
            (figures.show(causes))
        }))
        (section("Errors before and after", &figures.show([figures::errors(picture), figures::vectors(picture)])))
        (section("What pointed there", &html! {
            div.columns.stack {
                (figures.show(figures::ranking(&closure.before)))
                div { (effects::rounds(closure)) (effects::absent(&closure.before)) }
            }
        }))
        (section("What is left", &html! {
            (figures.show(figures::histogram(picture).into_iter().chain(figures::order(picture))))
            (checks::list(closure))
        }))
        (identified(&mut figures, &closure.after, picture, "the estimate.json of flexcal identify problem.closed.toml"))
    };
    figures.page(problem, "closed loop", &body)
}

/// What a fit leaves, and what the checks say of it.
fn left(figures: &mut Figures, found: &Identification, picture: &Picture) -> Markup {
    section(
        "What is left",
        &html! {
            (figures.show(figures::histogram(picture).into_iter().chain(figures::order(picture))))
            (checks::of(&picture.findings, found.reduced_chi2))
        },
    )
}

/// Parameters, what they share, and what nobody sees; `file` holds what is folded.
fn identified(figures: &mut Figures, found: &Identification, picture: &Picture, file: &str) -> Markup {
    let shared =
        figures::correlation(&picture.correlations).into_iter().chain(figures::spectrum(&found.identifiability));
    html! {
        (section("Parameters", &parameters::table(found, file)))
        (section("What the poses can tell", &html! {
            (figures.show(shared))
            (parameters::blind(found, file))
        }))
    }
}
