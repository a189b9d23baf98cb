//! Values of the parameters of effects.

use schemars::JsonSchema;
use serde::Serialize;

use crate::fit::Estimate;
use crate::quantity::Unit;

/// Value of a parameter of an effect, SI units.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ParameterValue {
    pub name: String,
    #[serde(serialize_with = "serialize_symbol")]
    #[schemars(with = "String")]
    pub unit: Unit,
    pub estimate: f64,
    pub std_error: Option<f64>,
}

impl ParameterValue {
    /// Converts the estimate of a parameter, in SI units.
    pub(crate) fn new(estimate: &Estimate) -> Self {
        Self {
            name: estimate.name.clone(),
            unit: estimate.unit,
            estimate: estimate.estimate,
            std_error: estimate.std_error,
        }
    }

    /// Returns the amplitude of the harmonic with the coefficients `pair` of its sine and cosine,
    /// whose errors are treated as uncorrelated.
    pub(crate) fn amplitude(pair: &[Self]) -> Self {
        let (sine, cosine) = (&pair[0], &pair[1]);
        let amplitude = sine.estimate.hypot(cosine.estimate);
        let std_error = sine.std_error.zip(cosine.std_error).map(|(of_sine, of_cosine)| {
            (sine.estimate * of_sine).hypot(cosine.estimate * of_cosine)
                / amplitude.max(f64::MIN_POSITIVE)
        });
        Self { estimate: amplitude, std_error, ..sine.clone() }
    }
}

pub(super) fn serialize_symbol<S: serde::Serializer>(
    unit: &Unit,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&unit.symbol())
}
