//! Effects that a loop did not exclude in the place of declared ones, and by how much they would
//! move commands.

use crate::error::InputError;
use crate::fit::Placement;
use crate::measurement::Measurements;
use crate::model::Model;
use crate::problem::{EffectDeclaration, Problem};

/// Effect that a loop did not exclude, and the declared effect in whose place it would act.
#[derive(Debug, Clone)]
pub struct Rival {
    /// Declared effect.
    pub declared: Side,
    /// Effect that may act instead.
    pub rival: Side,
    /// Probability that the rival acts, among all effects that may act in this place.
    pub share: f64,
}

/// Effect with the values of its parameters.
#[derive(Debug, Clone)]
pub struct Side {
    /// Effect as a problem declares it.
    pub effect: EffectDeclaration,
    /// Description of the effect in words.
    pub description: String,
    /// Name and value (SI) of each parameter.
    pub values: Vec<(String, f64)>,
}

impl Rival {
    /// Returns for each row how far the true positions \[m\] differ that belong to one reading under
    /// the two effects. Both fit the readings alike, so the true positions differ by the errors that
    /// each of them states for the instrument. `rows` are in the frame in which they are given.
    pub(super) fn differences(
        &self,
        problem: &Problem,
        rows: &Measurements,
    ) -> Result<Vec<f64>, InputError> {
        let declared = self.declared.reading_errors(problem, rows)?;
        let rival = self.rival.reading_errors(problem, rows)?;
        Ok(declared.iter().zip(&rival).map(|(one, other)| (one - other).norm()).collect())
    }
}

impl Side {
    /// Returns the errors of the instrument in the readings of all rows \[m\], by this effect alone.
    fn reading_errors(
        &self,
        problem: &Problem,
        rows: &Measurements,
    ) -> Result<Vec<nalgebra::Vector3<f64>>, InputError> {
        let mut problem = problem.clone();
        if !problem.effects.iter().any(|of| of.effect.is_same_as(&self.effect.effect)) {
            problem.effects.push(self.effect.clone());
        }
        let placement = Placement::of(rows);
        let model = Model::new(&problem, &placement.bases, &placement.targets)?;
        let value = |name: &str| self.values.iter().find(|(known, _)| known == name);
        let x: Vec<f64> = model
            .parameters
            .iter()
            .map(|parameter| value(&parameter.name).map_or(0.0, |(_, value)| *value))
            .collect();
        let all_rows: Vec<usize> = (0..rows.len()).collect();
        let poses = placement.poses(rows, &all_rows, 1.0);
        Ok(model.reading_errors(&x, &poses, &rows.positions))
    }
}
