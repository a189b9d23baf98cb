//! Terms of an effect, evaluated in every pose.

use nalgebra::Vector3;

use super::figure::Quantity;
use crate::laws::Quantity as LawQuantity;
use crate::model::parameter::{ParameterSite, Regressor};
use crate::problem::{PoseView, Problem};

/// Terms of an effect, with the poses of all rows and the displacement by the effect in each row.
pub struct EffectRows<'a> {
    pub poses: Vec<PoseView<'a>>,
    /// Displacement of the target by the effect in each row, measuring frame \[m\].
    pub displacements: Vec<Vector3<f64>>,
    /// Regressor and fitted value of each term.
    pub terms: Vec<(Regressor, f64)>,
    /// Site of each term.
    pub sites: Vec<ParameterSite>,
}

/// Function from the abscissa of a figure to the ordinate of the fitted law, both SI.
pub type Law<'a> = Box<dyn Fn(f64) -> f64 + 'a>;

impl EffectRows<'_> {
    /// Returns the common site of all terms; `None` if they have several sites or there are no
    /// terms.
    pub fn site(&self) -> Option<ParameterSite> {
        let (first, others) = self.sites.split_first()?;
        others.iter().all(|site| site == first).then_some(*first)
    }

    /// Returns the quantities on which the terms depend, without duplicates.
    pub fn quantities(&self) -> Vec<LawQuantity> {
        let mut found = Vec::new();
        for quantity in self.terms.iter().flat_map(|(regressor, _)| regressor.quantities()) {
            if !found.contains(&quantity) {
                found.push(quantity);
            }
        }
        found
    }

    /// Returns Σ value × regressor over the terms of the effect in one pose.
    pub fn sum_of_terms(&self, pose: &PoseView) -> f64 {
        self.terms.iter().map(|(regressor, value)| value * regressor.value(pose)).sum()
    }

    /// Returns the axis label of a regressor: its formula with "\[SI\]", or words for a friction
    /// state.
    pub fn label(regressor: &Regressor) -> String {
        match regressor.as_quantity() {
            Some(LawQuantity::Friction { joint, .. }) => {
                format!("friction that holds joint {} back [−1 … +1]", joint + 1)
            }
            _ => format!("{} [SI]", regressor.text()),
        }
    }

    /// Returns the axis of one quantity, its value in each pose, and Σ value × regressor as a
    /// function of that quantity. `None` if the quantity alone does not determine the regressors.
    pub fn over_quantity<'r>(
        &'r self,
        quantity: LawQuantity,
        problem: &Problem,
    ) -> Option<(Quantity, Vec<f64>, Law<'r>)> {
        let each =
            |value: &dyn Fn(&PoseView) -> f64| self.poses.iter().map(value).collect::<Vec<f64>>();
        let reference = problem.data.reference_temperature.unwrap_or_default();
        Some(match quantity {
            LawQuantity::Command(joint) => {
                let count = self.poses.first()?.configuration.len();
                let law =
                    move |q: f64| self.sum_of_terms(&PoseView::from_configuration(&vec![q; count]));
                let across = Quantity::command(problem, joint + 1);
                (across, each(&|pose| pose.configuration[joint]), Box::new(law))
            }
            LawQuantity::Warming => {
                let law = move |t: f64| {
                    let pose = PoseView::from_configuration(&[]);
                    self.sum_of_terms(&PoseView { temperature: Some(&t), ..pose })
                };
                let value = |pose: &PoseView| pose.temperature.copied().unwrap_or_default();
                (Quantity::temperature(), each(&value), Box::new(law))
            }
            // The sum is a function of the lagged temperature only if every regressor is that
            // temperature itself.
            LawQuantity::Lagging { time_constant } if self.has_only_regressor(quantity) => {
                let sum: f64 = self.terms.iter().map(|term| term.1).sum();
                let regressor = &self.terms.first()?.0;
                let values = each(&|pose| regressor.value(pose) + reference);
                let law = move |lagged: f64| sum * (lagged - reference);
                (Quantity::lagging(time_constant), values, Box::new(law))
            }
            LawQuantity::Covariate(index) => {
                let name = &problem.data.covariates.get(index)?.name;
                let law = move |value: f64| {
                    let mut covariates = vec![0.0; index];
                    covariates.push(value);
                    let pose = PoseView::from_configuration(&[]);
                    self.sum_of_terms(&PoseView { covariates: &covariates, ..pose })
                };
                let value =
                    |pose: &PoseView| pose.covariates.get(index).copied().unwrap_or_default();
                (Quantity::new(name, 1.0), each(&value), Box::new(law))
            }
            LawQuantity::Elapsed | LawQuantity::Time => {
                let elapsed = each(&|pose| pose.elapsed);
                let last = elapsed.iter().copied().fold(0.0, f64::max);
                let first = self.poses.first().map_or(0.0, |pose| pose.time - pose.elapsed);
                let law = move |elapsed: f64| {
                    let pose = PoseView::from_configuration(&[]);
                    self.sum_of_terms(&PoseView { elapsed, time: first + elapsed, ..pose })
                };
                (Quantity::elapsed(last), elapsed, Box::new(law))
            }
            _ => return None,
        })
    }

    /// Returns true if the regressor of every term is this quantity itself.
    pub fn has_only_regressor(&self, quantity: LawQuantity) -> bool {
        self.terms.iter().all(|(regressor, _)| regressor.as_quantity() == Some(quantity))
    }

    /// Returns the effect's displacement in each row divided by the row's entry of `sizes` \[m per
    /// unit of size\]; zero if that entry is 0.
    pub fn displacements_per(&self, sizes: impl Iterator<Item = f64>) -> Vec<Vector3<f64>> {
        let lever = |(displacement, size): (&Vector3<f64>, f64)| {
            if size == 0.0 { Vector3::zeros() } else { displacement / size }
        };
        self.displacements.iter().zip(sizes).map(lever).collect()
    }
}
