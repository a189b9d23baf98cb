//! Euler–Bernoulli cantilever in closed form, in three dimensions.
//!
//! Root frame: x along the beam, tip at x = L. Each load is a wrench at a station or spread evenly,
//! and deflections superpose. L may be negative (the link runs along −x). Rigidities then take the
//! sign of L, and every formula stays as it is.

use nalgebra::Vector3;

use super::imperfection::Strain;
use crate::scalar::Scalar;

/// Flexibilities of a uniform beam; 0 is rigid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flexibility<S> {
    /// Axial flexibility 1/EA [1/N].
    pub axial: S,
    /// Bending flexibility `1/EI_y` in the x-z plane [1/(N·m²)].
    pub about_y: S,
    /// Bending flexibility `1/EI_z` in the x-y plane [1/(N·m²)].
    pub about_z: S,
    /// Torsional flexibility 1/GJ [1/(N·m²)].
    pub twist: S,
    /// Couplings `k_y`, `k_z` of twist with bending about y and z [1/(N·m²)]: curvature `k_y M_x`
    /// and rate of twist `k_y M_y`, likewise about z. The strain energy is positive if `k_y`² ≤
    /// `about_y`·`twist`.
    pub coupling: Option<[S; 2]>,
}

impl Flexibility<f64> {
    /// Flexibility of a rigid beam.
    pub const RIGID: Self =
        Self { axial: 0.0, about_y: 0.0, about_z: 0.0, twist: 0.0, coupling: None };
}

/// Force and moment at one point, in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wrench<S> {
    /// Force at the point \[N\].
    pub force: Vector3<S>,
    /// Moment about the point [N·m].
    pub moment: Vector3<S>,
}

/// Displacement \[m\] and small rotation vector \[rad\] of a section, root frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deflection<S> {
    /// Displacement of the beam's axis at this point, frame of the beam \[m\].
    pub displacement: Vector3<S>,
    /// Rotation vector of the beam's section at this point, small, frame of the beam \[rad\].
    pub rotation: Vector3<S>,
}

impl<S: Scalar> Deflection<S> {
    /// Creates a deflection of zero.
    pub fn zero() -> Self {
        let zero = Vector3::from_element(S::from(0.0));
        Self { displacement: zero, rotation: zero }
    }
}

/// Factors of the closed-form response to a unit load. They depend on geometry alone and serve both
/// bending planes.
#[derive(Clone, Copy)]
struct ResponseFactors<S> {
    /// Deflection per force and flexibility \[m³\]; for an evenly spread load, per N/m and
    /// flexibility \[m⁴\].
    deflection_of_force: S,
    /// Slope per force and flexibility \[m²\]; for an evenly spread load, per N/m and flexibility
    /// \[m³\].
    slope_of_force: S,
    /// Deflection δ of the tip by a moment M, divided by M and by the flexibility 1/EI \[m²\].
    deflection_of_moment: S,
    /// Slope per moment and flexibility \[m\], which is also stretch per force and twist per
    /// torque.
    slope_of_moment: S,
}

/// Clamped uniform beam with its loads, all in the root frame.
#[derive(Debug)]
pub struct Cantilever<'a, S> {
    /// Signed length L \[m\].
    pub length: S,
    /// Flexibilities of a beam along +x.
    pub flexibility: Flexibility<S>,
    /// Evenly spread load [N/m], the total force over the signed length.
    pub spread: Vector3<S>,
    /// Strain without load, uniform along the beam.
    pub strain: Option<Strain<S>>,
    /// Point loads: station s \[m\] between 0 and L, and the wrench there. The tip load is at s =
    /// L.
    pub points: &'a [(S, Wrench<S>)],
}

impl<S: Scalar> Cantilever<'_, S> {
    /// Returns the deflection of the section at `x` \[m\], 0 ≤ x/L ≤ 1.
    ///
    /// Load F, M at s, for x ≤ s:  δ = F (s x²/2 − x³/6)/EI + M x²/(2EI),  φ = F (s x − x²/2)/EI +
    /// M x/EI; beyond s the beam stays straight. Spread load q:  δ = q (L²x²/4 − L x³/6 +
    /// x⁴/24)/EI. Small slopes only. At the tip these are [Chen2021, eq. 4 and 6] without their
    /// misprints.
    pub fn at(&self, x: S) -> Deflection<S> {
        let l = self.length;
        let (x2, l2) = (x * x, l * l);
        let k = self.signed_flexibility();
        let mut out = Deflection::zero();
        for (station, wrench) in self.points {
            let s = *station;
            let shape = if x.re().abs() <= s.re().abs() {
                ResponseFactors {
                    deflection_of_force: x2 * (s * 0.5 - x / 6.0),
                    slope_of_force: x * (s - x * 0.5),
                    deflection_of_moment: x2 * 0.5,
                    slope_of_moment: x,
                }
            } else {
                let (beyond, half) = (x - s, s * s * 0.5);
                ResponseFactors {
                    deflection_of_force: s * half * (2.0 / 3.0) + half * beyond,
                    slope_of_force: half,
                    deflection_of_moment: half + s * beyond,
                    slope_of_moment: s,
                }
            };
            superpose(&mut out, &k, &shape, wrench);
        }
        self.superpose_spread(
            &mut out,
            &k,
            x2 * (l2 * 0.25 - l * x / 6.0 + x2 / 24.0),
            x * (l2 * 0.5 - l * x * 0.5 + x2 / 6.0),
            x * (l - x * 0.5),
        );
        self.superpose_strain(&mut out, x, x * x * 0.5);
        out
    }

    /// Returns the deflection of the tip, x = L.
    pub fn tip(&self) -> Deflection<S> {
        self.at(self.length)
    }

    /// Returns the mean displacement along the beam \[m\], which is that of its centre of mass.
    pub fn mean_displacement(&self) -> Vector3<S> {
        let l = self.length;
        let k = self.signed_flexibility();
        let mut out = Deflection::zero();
        for (station, wrench) in self.points {
            let s = *station;
            let (beyond, half) = (l - s, s * s * 0.5);
            let end = ResponseFactors {
                deflection_of_force: s * half * (2.0 / 3.0),
                slope_of_force: half,
                deflection_of_moment: half,
                slope_of_moment: s,
            };
            let mean =
                |inside: S, end: S, slope: S| (inside + (end + slope * beyond * 0.5) * beyond) / l;
            let shape = ResponseFactors {
                deflection_of_force: mean(
                    half * half * 0.5,
                    end.deflection_of_force,
                    end.slope_of_force,
                ),
                slope_of_force: half,
                deflection_of_moment: mean(s * half / 3.0, end.deflection_of_moment, s),
                slope_of_moment: (half + s * beyond) / l,
            };
            superpose(&mut out, &k, &shape, wrench);
        }
        let l2 = l * l;
        self.superpose_spread(&mut out, &k, l2 * l2 * 0.05, l2 * l / 6.0, l2 / 3.0);
        self.superpose_strain(&mut out, l * 0.5, l2 / 6.0);
        out.displacement
    }

    fn signed_flexibility(&self) -> Flexibility<S> {
        let k = self.flexibility;
        if self.length.re() < 0.0 {
            Flexibility {
                axial: -k.axial,
                about_y: -k.about_y,
                about_z: -k.about_z,
                twist: -k.twist,
                coupling: k.coupling.map(|coupling| coupling.map(|k| -k)),
            }
        } else {
            k
        }
    }

    fn superpose_spread(
        &self,
        out: &mut Deflection<S>,
        k: &Flexibility<S>,
        deflection: S,
        slope: S,
        stretch: S,
    ) {
        let q = &self.spread;
        out.displacement.x += k.axial * q.x * stretch;
        out.displacement.y += k.about_z * q.y * deflection;
        out.displacement.z += k.about_y * q.z * deflection;
        out.rotation.y -= k.about_y * q.z * slope;
        out.rotation.z += k.about_z * q.y * slope;
        if let Some([k_y, k_z]) = k.coupling {
            out.rotation.x += (k_z * q.y - k_y * q.z) * slope;
        }
    }

    /// Adds the deflection by the strain without load, elongation ε and curvature κ: at x a
    /// displacement ε x along the beam, κ x²/2 (`half_square` = x²/2) across it, and a rotation κ
    /// x.
    fn superpose_strain(&self, out: &mut Deflection<S>, x: S, half_square: S) {
        let Some(Strain { axial, curvature: [about_y, about_z] }) = self.strain else { return };
        out.displacement.x += axial * x;
        out.displacement.y += about_z * half_square;
        out.displacement.z -= about_y * half_square;
        out.rotation.y += about_y * x;
        out.rotation.z += about_z * x;
    }
}

/// Adds to `out` the deflection by one wrench at the response `shape` of a beam with flexibilities
/// `k`. A rotation about z is +slope in y, a rotation about y is −slope in z.
fn superpose<S: Scalar>(
    out: &mut Deflection<S>,
    k: &Flexibility<S>,
    shape: &ResponseFactors<S>,
    wrench: &Wrench<S>,
) {
    let (f, m) = (&wrench.force, &wrench.moment);
    out.displacement.x += k.axial * f.x * shape.slope_of_moment;
    out.displacement.y +=
        k.about_z * (f.y * shape.deflection_of_force + m.z * shape.deflection_of_moment);
    out.displacement.z +=
        k.about_y * (f.z * shape.deflection_of_force - m.y * shape.deflection_of_moment);
    out.rotation.x += k.twist * m.x * shape.slope_of_moment;
    out.rotation.y += k.about_y * (m.y * shape.slope_of_moment - f.z * shape.slope_of_force);
    out.rotation.z += k.about_z * (m.z * shape.slope_of_moment + f.y * shape.slope_of_force);
    if let Some([k_y, k_z]) = k.coupling {
        // The torsional moment is constant along the beam and bends as a moment does.
        out.displacement.y += k_z * m.x * shape.deflection_of_moment;
        out.displacement.z -= k_y * m.x * shape.deflection_of_moment;
        out.rotation.x += k_y * (m.y * shape.slope_of_moment - f.z * shape.slope_of_force)
            + k_z * (m.z * shape.slope_of_moment + f.y * shape.slope_of_force);
        out.rotation.y += k_y * m.x * shape.slope_of_moment;
        out.rotation.z += k_z * m.x * shape.slope_of_moment;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns ∫ f from 0 to `end`, exact for polynomials of degree 5 between the `breaks`.
    fn integral<const N: usize>(
        end: f64,
        breaks: &[f64],
        f: impl Fn(f64) -> nalgebra::SVector<f64, N>,
    ) -> nalgebra::SVector<f64, N> {
        let mut knots: Vec<f64> = breaks.iter().copied().filter(|s| s.abs() < end.abs()).collect();
        knots.extend([0.0, end]);
        knots.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
        let piece = |pair: &[f64]| {
            let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
            let node = 0.6_f64.sqrt() * half;
            let outer = f(middle - node) + f(middle + node);
            (outer * (5.0 / 9.0) + f(middle) * (8.0 / 9.0)) * half
        };
        knots.windows(2).map(piece).sum()
    }

    /// Runs a check on a beam along +x and one along −x, with every kind of load, and the stations
    /// of its point loads.
    fn for_loaded_beams(check: impl Fn(&Cantilever<f64>, &[f64])) {
        for length in [1.3, -0.9] {
            let stations = [0.3 * length, 0.8 * length, length];
            let point = |k: usize| {
                let turn = k as f64 + 1.0;
                let force = Vector3::new(3.0, -5.0 * turn, 2.0 + turn);
                (stations[k], Wrench { force, moment: Vector3::new(0.7 * turn, -1.1, 0.4 + turn) })
            };
            let points = [point(0), point(1), point(2)];
            let coupling = Some([2e-4, -3e-4]);
            let (axial, about_y, about_z, twist) = (5e-5, 7e-4, 9e-4, 1.1e-3);
            check(
                &Cantilever {
                    length,
                    flexibility: Flexibility { axial, about_y, about_z, twist, coupling },
                    spread: Vector3::new(4.0, -6.0, 9.0),
                    strain: Some(Strain { axial: 1e-4, curvature: [2e-4, -5e-4] }),
                    points: &points,
                },
                &stations,
            );
        }
    }

    #[test]
    fn rotations_are_integrals_of_curvature_and_displacements_of_rotation() {
        for_loaded_beams(|beam, stations| {
            let k = beam.flexibility;
            let [k_y, k_z] = k.coupling.unwrap();
            let strain = beam.strain.unwrap();
            let side = beam.length.signum();
            // Normal force and moments of the loads beyond a section.
            let internal = |x: f64| {
                let rest = beam.length - x;
                let (q, half) = (beam.spread, 0.5 * rest * rest);
                let spread = nalgebra::Vector4::new(q.x * rest, 0.0, -q.z * half, q.y * half);
                let beyond = beam.points.iter().filter(|(s, _)| s.abs() > x.abs());
                beyond.fold(spread, |sum, (s, Wrench { force: f, moment: m })| {
                    let arm = s - x;
                    sum + nalgebra::Vector4::new(f.x, m.x, m.y - f.z * arm, m.z + f.y * arm)
                })
            };
            // Stretch and the three curvatures.
            let rates = |x: f64| {
                let [n, m_x, m_y, m_z]: [f64; 4] = internal(x).into();
                let [about_y, about_z] = strain.curvature;
                nalgebra::Vector4::new(
                    side * k.axial * n + strain.axial,
                    side * (k.twist * m_x + k_y * m_y + k_z * m_z),
                    side * (k.about_y * m_y + k_y * m_x) + about_y,
                    side * (k.about_z * m_z + k_z * m_x) + about_z,
                )
            };
            for part in [0.2, 0.3, 0.55, 0.9, 1.0] {
                let x = part * beam.length;
                let Deflection { displacement, rotation } = beam.at(x);
                let [stretch, turns @ ..]: [f64; 4] = integral(x, stations, rates).into();
                assert!((rotation - Vector3::from(turns)).amax() < 1e-14, "{part}: {rotation}");
                let slopes = |x: f64| {
                    let rotation = beam.at(x).rotation;
                    nalgebra::Vector2::new(rotation.z, -rotation.y)
                };
                let [y, z]: [f64; 2] = integral(x, stations, slopes).into();
                let expected = Vector3::new(stretch, y, z);
                assert!((displacement - expected).amax() < 1e-14, "{part}: {displacement}");
            }
            assert_eq!(beam.tip(), beam.at(beam.length));
        });
    }

    #[test]
    fn the_mean_displacement_is_that_of_all_sections() {
        for_loaded_beams(|beam, stations| {
            let sum = integral(beam.length, stations, |x| beam.at(x).displacement);
            let error = beam.mean_displacement() - sum / beam.length;
            assert!(error.amax() < 1e-14, "{error}");
        });
    }
}
