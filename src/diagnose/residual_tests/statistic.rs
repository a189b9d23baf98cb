//! Statistics of studentised residuals.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::dependence::Cumulative;
use super::order::Order;

/// Studentised residuals, about their mean.
#[derive(Debug, Clone)]
pub(super) struct Sample {
    /// y of each pose, with Σ y = 0.
    pub centred: Vec<Vector3<f64>>,
    /// Σ y yᵀ.
    pub squares: Matrix3<f64>,
}

impl Sample {
    /// Of studentised residuals.
    pub fn of(mut values: Vec<Vector3<f64>>) -> Self {
        let mean = values.iter().sum::<Vector3<f64>>() / values.len().max(1) as f64;
        let mut squares = Matrix3::zeros();
        for value in &mut values {
            *value -= mean;
            squares += *value * value.transpose();
        }
        Self { centred: values, squares }
    }
}

/// A number that grows with structure of one kind; free of the residuals' unit.
#[derive(Debug)]
pub(super) enum Statistic {
    /// Share of steps at which a coordinate keeps its sign.
    Runs(Arc<Order>),
    /// Ljung and Box's Q.
    LjungBox(Arc<Order>),
    /// Squared distance correlation with a covariate.
    Dependence(Cumulative),
}

impl Statistic {
    /// Its value.
    pub fn of(&self, sample: &Sample) -> f64 {
        match self {
            Self::Runs(order) => order.kept_signs(sample),
            Self::LjungBox(order) => order.ljung_box(sample),
            Self::Dependence(cumulative) => cumulative.correlation(sample),
        }
    }
}
