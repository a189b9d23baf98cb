//! Bounds on individual unknowns.

use nalgebra::DVector;

/// Side of an active bound or constraint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AtBound {
    /// Lower side of the interval.
    Lower,
    /// Upper side of the interval.
    Upper,
}

/// Bounds lo ≤ x ≤ hi, infinite where an unknown is unbounded.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounds {
    lower: DVector<f64>,
    upper: DVector<f64>,
}

/// Error of bounds that no x satisfies.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BoundsError {
    /// The vectors of lower and of upper bounds differ in length.
    #[error("setting bounds: {lower} lower bounds, but {upper} upper bounds")]
    Sizes {
        /// Number of lower bounds.
        lower: usize,
        /// Number of upper bounds.
        upper: usize,
    },
    /// An unknown violates lo ≤ hi, has a bound that is not a number, or an infinity on the wrong
    /// side.
    #[error("setting bounds: unknown {index} has no value between {lower} and {upper}")]
    Empty {
        /// Index of the unknown whose bounds are wrong, from 0.
        index: usize,
        /// Lower bound of the unknown.
        lower: f64,
        /// Upper bound of the unknown.
        upper: f64,
    },
}

impl Bounds {
    /// Creates bounds lo ≤ x ≤ hi; lo = hi fixes an unknown.
    ///
    /// # Errors
    /// Returns an error if the lengths differ or an unknown is left without a value.
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

    /// Creates infinite bounds for `n` unknowns.
    #[doc(hidden)]
    pub fn none(n: usize) -> Self {
        Self {
            lower: DVector::from_element(n, f64::NEG_INFINITY),
            upper: DVector::from_element(n, f64::INFINITY),
        }
    }

    /// Returns the lower bounds lo.
    pub fn lower(&self) -> &DVector<f64> {
        &self.lower
    }

    /// Returns the upper bounds hi.
    pub fn upper(&self) -> &DVector<f64> {
        &self.upper
    }

    /// Returns the bound that `x[j]` lies on or beyond, or `None` between the bounds.
    pub(super) fn at(&self, x: &DVector<f64>, j: usize) -> Option<AtBound> {
        if x[j] <= self.lower[j] {
            Some(AtBound::Lower)
        } else if x[j] >= self.upper[j] {
            Some(AtBound::Upper)
        } else {
            None
        }
    }

    /// Moves x to the nearest point within the bounds.
    pub fn clamp(&self, x: &mut DVector<f64>) {
        for (j, x) in x.iter_mut().enumerate() {
            *x = x.clamp(self.lower[j], self.upper[j]);
        }
    }

    /// Places each unknown with an active bound exactly on that bound and clamps all others into
    /// the box.
    pub(super) fn place_on_bounds(&self, x: &mut DVector<f64>, active: &[Option<AtBound>]) {
        for (j, active) in active.iter().enumerate() {
            match active {
                Some(AtBound::Lower) => x[j] = self.lower[j],
                Some(AtBound::Upper) => x[j] = self.upper[j],
                None => {}
            }
        }
        self.clamp(x);
    }

    /// Returns true if x satisfies every bound.
    pub(super) fn contain(&self, x: &DVector<f64>) -> bool {
        (0..x.len()).all(|j| self.lower[j] <= x[j] && x[j] <= self.upper[j])
    }
}
