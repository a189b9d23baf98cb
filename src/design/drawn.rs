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

/// Candidates of a plan as two tables, with the site at which they are measured.
pub(super) struct Drawn<'a> {
    pub site: Site<'a>,
    /// Rows given, or poses drawn uniformly.
    pub uniform: Measurements,
    /// Poses often at the limits of the ranges; `None` without ranges.
    pub extremes: Option<Measurements>,
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
        let (uniform, extremes) = tables(problem, candidates, counts, None);
        let measured: Vec<&Measurements> = std::iter::once(&uniform).chain(given).collect();
        let site = Site::with_cameras(problem, &measured, views::pairs(problem, &uniform))?;
        if matches!(candidates, Candidates::Within(_)) && site.is_of_cameras(&uniform) {
            let (uniform, extremes) = tables(problem, candidates, counts, Some(&site));
            return Ok(Self { site, uniform, extremes });
        }
        Ok(Self { site, uniform, extremes })
    }
}

/// Returns the candidates as two tables. The first holds the rows given, or poses drawn uniformly
/// from the ranges; the second holds poses often at the limits of the ranges, if there are ranges.
/// With a site, poses out of view of its cameras are replaced by others, as far as possible.
fn tables(
    problem: &Problem,
    candidates: &Candidates,
    (poses, seed): (usize, u64),
    site: Option<&Site>,
) -> (Measurements, Option<Measurements>) {
    match candidates {
        Candidates::Within(ranges) => {
            let [uniform, extremes] = DRAWN_CANDIDATES.map(|count| count.max(2 * poses));
            let draw = |count, extremes, stream| {
                let drawn = site.map_or(count, |site| site.poses_to_draw(count));
                let poses = ranges.draw(problem, drawn, extremes, seed, stream);
                match site {
                    Some(site) => site.first_in_view(poses, count),
                    None => poses,
                }
            };
            let extremes = draw(extremes, Extremes::Often, EXTREMES_STREAM);
            (draw(uniform, Extremes::No, UNIFORM_STREAM), Some(extremes))
        }
        Candidates::Rows(rows) => (rows.as_ref().clone().arm_rows(), None),
    }
}
