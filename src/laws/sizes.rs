//! Prior sizes of the parameters of effects in the catalogue.

/// Prior σ of a coefficient that adds to a joint's coordinate \[rad\] or \[m\], or to a beam's
/// strain or curvature [1/m], per unit of the formula that it multiplies.
pub(super) const DRIFT_SIGMA: f64 = 1e-3;
/// Prior σ of the thermal strain of a whole arm [1/K]; aluminium grows by 24e-6.
pub(super) const ARM_STRAIN_SIGMA: f64 = 3e-5;
/// Prior σ of a relative error, such as that of a transmission ratio or of a scale.
pub(super) const RELATIVE_SIGMA: f64 = 0.01;
/// Prior σ of a displacement of the instrument's readings \[m\].
pub(super) const READING_SHIFT_SIGMA: f64 = 5e-3;
/// Prior σ of the displacement \[m\] and of the rotation \[rad\] of an instrument that was knocked
/// or set up again.
pub(super) const SETUP_SHIFT_SIGMA: f64 = 1e-2;
/// Prior σ of a bending flexibility 1/EI [1/(N·m²)].
pub(super) const FLEXIBILITY_SIGMA: f64 = 1e-2;
/// Prior σ of a displacement of the payload's centre of mass \[m\].
pub(super) const PAYLOAD_SHIFT_SIGMA: f64 = 0.1;
/// Prior σ of the time between the reading of the joints and the exposure of an image's first row
/// \[s\].
pub(super) const EXPOSURE_DELAY_SIGMA: f64 = 0.02;
/// Prior σ of the time between the exposures of successive rows of an image \[s\]; sensors read a
/// row in 5 to 60 µs.
pub(super) const ROW_TIME_SIGMA: f64 = 3e-5;
/// Prior σ of the change of a focal length with temperature [px/K].
pub(super) const LENS_DRIFT_SIGMA: f64 = 0.3;
/// Prior σ of the sine and cosine with which an image centre follows a joint \[px\].
pub(super) const LENS_SAG_SIGMA: f64 = 1.0;
/// Largest plausible rotation of a joint by the cubic term of its torsion, under the largest
/// plausible moment \[rad\].
pub(super) const MAX_TURN: f64 = 0.1;
