//! Which inputs a kept part belongs to.

use super::part::Part;
use super::plan::{Campaign, Cell};
use crate::problem::digest::hexadecimal;

impl Campaign {
    /// A digest of everything that the fits of a part depend on, 64 hexadecimal digits: the version of flexcal, the
    /// text of the problem file, the truth, and the numbers of the study that concern these fits.
    ///
    /// Numbers that do not concern them do not enter: a study with one more noise level keeps the others' parts.
    pub(super) fn key(&self, part: &Part) -> String {
        let Self { problem_text, truth, source, seed, held_out, .. } = self;
        let Cell { sigma, poses, strategy, solver } = &self.cells[part.cell];
        let (version, repetitions) = (env!("CARGO_PKG_VERSION"), &part.repetitions);
        let inputs = format!(
            "{version} {source:?} {seed} {held_out} {sigma:?} {poses} {strategy:?} {solver:?} {repetitions:?}\n\
             {truth:?}\n{problem_text}"
        );
        hexadecimal(&inputs)
    }
}
