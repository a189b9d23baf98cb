//! Candidates of a plan: rows of a table, or poses drawn from ranges.

use super::{DesignError, Extremes, Site, views};
use crate::measurement::Measurements;
use crate::problem::{PoseRanges, Problem};

/// Minimum number of candidates drawn from ranges: uniformly, and with emphasis on the limits.
pub(super) const DRAWN_CANDIDATES: [usize; 2] = [500, 2000];
/// Random stream of the uniform candidates.
pub(super) const UNIFORM_STREAM: u64 = 0;
/// Random stream of the candidates with emphasis on the limits of the ranges.
const EXTREMES_STREAM: u64 = 1;

/// Source of the poses of a plan.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum Candidates {
    /// Poses anywhere within ranges.
    Within(PoseRanges),
    /// Rows of a table.
    Rows(Box<Measurements>),
}

/// Candidates of a plan: uniform poses or the rows given, and, if there are ranges, poses at their
/// limits; with the site at which they are measured.
pub(super) struct Drawn<'a> {
    pub site: Site<'a>,
    /// Candidates: the rows of a given table, or poses that are uniform within their ranges.
    pub uniform: Measurements,
    /// Poses often at the limits of the ranges; `None` without ranges.
    pub extremes: Option<Measurements>,
    /// Number of poses drawn to find those that cameras see; `None` if cameras do not measure, or
    /// without ranges.
    pub count: Option<usize>,
}

impl<'a> Drawn<'a> {
    /// Creates the site for the candidates and `given` poses. Candidates drawn from ranges are
    /// those that cameras see, if cameras measure.
    pub fn new(
        problem: &'a Problem,
        candidates: &Candidates,
        given: Option<&Measurements>,
        counts: (usize, u64),
    ) -> Result<Self, DesignError> {
        let (uniform, extremes, _) = tables(problem, candidates, counts, None);
        let measured: Vec<&Measurements> = std::iter::once(&uniform).chain(given).collect();
        let site = Site::with_cameras(problem, &measured, views::pairs(problem, &uniform))?;
        if matches!(candidates, Candidates::Within(_)) && site.is_of_cameras(&uniform) {
            let (uniform, extremes, drawn) = tables(problem, candidates, counts, Some(&site));
            return Ok(Self { site, uniform, extremes, count: Some(drawn) });
        }
        Ok(Self { site, uniform, extremes, count: None })
    }
}

/// Returns the candidates as two tables, and the number of drawn poses. The first holds the rows
/// given, or poses drawn uniformly from the ranges; the second holds poses often at the limits of
/// the ranges, if there are ranges. With a site, poses out of view of its cameras are replaced by
/// others, as far as possible.
fn tables(
    problem: &Problem,
    candidates: &Candidates,
    (poses, seed): (usize, u64),
    site: Option<&Site>,
) -> (Measurements, Option<Measurements>, usize) {
    match candidates {
        Candidates::Within(ranges) => {
            let [uniform, extremes] = DRAWN_CANDIDATES.map(|count| count.max(2 * poses));
            let draw = |count, extremes, stream| {
                let Some(site) = site else {
                    return (ranges.draw(problem, count, extremes, seed, stream), count);
                };
                site.draw_in_view(ranges, (count, extremes), (seed, stream), |poses| poses)
            };
            let (extremes, more) = draw(extremes, Extremes::Often, EXTREMES_STREAM);
            let (uniform, drawn) = draw(uniform, Extremes::No, UNIFORM_STREAM);
            (uniform, Some(extremes), drawn + more)
        }
        Candidates::Rows(rows) => (rows.as_ref().clone().arm_rows(), None, 0),
    }
}
