//! Bounds on single unknowns.

use nalgebra::DVector;

/// The side of a bound or constraint that holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AtBound {
    /// The lower one.
    Lower,
    /// The upper one.
    Upper,
}

/// Bounds lo ≤ x ≤ hi; infinite where there is none.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounds {
    lower: DVector<f64>,
    upper: DVector<f64>,
}

/// Bounds that no x can satisfy.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BoundsError {
    /// The two vectors differ in length.
    #[error("setting bounds: {lower} lower bounds, but {upper} upper bounds")]
    Sizes {
        /// Number of lower bounds.
        lower: usize,
        /// Number of upper bounds.
        upper: usize,
    },
    /// Not lo ≤ hi (or not a number, or an infinity on the wrong side).
    #[error("setting bounds: unknown {index} has no value between {lower} and {upper}")]
    Empty {
        /// Which unknown.
        index: usize,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
}

impl Bounds {
    /// Bounds lo ≤ x ≤ hi; lo = hi holds an unknown fixed.
    ///
    /// # Errors
    /// When the lengths differ or some unknown is left without a value.
    pub fn new(lower: DVector<f64>, upper: DVector<f64>) -> Result<Self, BoundsError> {
        if lower.len() != upper.len() {
            return Err(BoundsError::Sizes { lower: lower.len(), upper: upper.len() });
        }
        for (index, (&lower, &upper)) in lower.iter().zip(&upper).enumerate() {
            if !(lower <= upper && lower < f64::INFINITY && upper > f64::NEG_INFINITY) {
                return Err(BoundsError::Empty { index, lower, upper });
            }
        }
        Ok(Self { lower, upper })
    }

    /// No bounds on any of `n` unknowns.
    pub fn none(n: usize) -> Self {
        Self {
            lower: DVector::from_element(n, f64::NEG_INFINITY),
            upper: DVector::from_element(n, f64::INFINITY),
        }
    }

    /// lo.
    pub fn lower(&self) -> &DVector<f64> {
        &self.lower
    }

    /// hi.
    pub fn upper(&self) -> &DVector<f64> {
        &self.upper
    }

    /// The bound that `x[j]` equals, if any.
    pub fn at(&self, x: &DVector<f64>, j: usize) -> Option<AtBound> {
        if x[j] <= self.lower[j] {
            Some(AtBound::Lower)
        } else if x[j] >= self.upper[j] {
            Some(AtBound::Upper)
        } else {
            None
        }
    }

    /// The nearest point within the bounds.
    pub fn clamp(&self, x: &mut DVector<f64>) {
        for (j, x) in x.iter_mut().enumerate() {
            *x = x.clamp(self.lower[j], self.upper[j]);
        }
    }

    /// Puts the unknowns of `active` bounds exactly on them, and rounds all others into the box.
    pub(super) fn hold(&self, x: &mut DVector<f64>, active: &[Option<AtBound>]) {
        for (j, active) in active.iter().enumerate() {
            match active {
                Some(AtBound::Lower) => x[j] = self.lower[j],
                Some(AtBound::Upper) => x[j] = self.upper[j],
                None => {}
            }
        }
        self.clamp(x);
    }

    pub(super) fn contain(&self, x: &DVector<f64>) -> bool {
        (0..x.len()).all(|j| self.lower[j] <= x[j] && x[j] <= self.upper[j])
    }
}
