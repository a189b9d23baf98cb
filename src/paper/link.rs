//! Deflection of a link's tip, eq. 3-7 of the paper.

use nalgebra::Vector6;

use super::form::{Misprint, Reading};
use super::loads::{LinkLoads, PointLoad, Wrench};

/// Flexibilities of a link; 0 is rigid. In the paper EI is equal in both planes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LinkFlexibility {
    /// Axial flexibility 1/EA [1/N].
    pub axial: f64,
    /// Flexibility `1/EI_y` [1/(N·m²)] of bending about y, which deflects the link along z.
    pub about_y: f64,
    /// Flexibility `1/EI_z` [1/(N·m²)] of bending about z, which deflects the link along y.
    pub about_z: f64,
    /// Torsional flexibility 1/`GI_p` [1/(N·m²)].
    pub twist: f64,
}

/// Tip deflections of a link times their rigidities, link frame: the numerators of eq. 4 and 6.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkTerms {
    /// Elongation EA Δx [N·m].
    pub stretch: f64,
    /// Bending along y: deflection EI Δy [N·m³] and slope EI dΔy/dx [N·m²] of the tip.
    pub bend_y: (f64, f64),
    /// Bending along z: deflection EI Δz [N·m³] and slope EI dΔz/dx [N·m²] of the tip.
    pub bend_z: (f64, f64),
    /// Twist `GI_p` Δφ [N·m²].
    pub twist: f64,
    /// True for a link that carries loads between its ends (link B, eq. 4); false otherwise (link
    /// A, eq. 6).
    pub carries: bool,
}

/// Loads in one bending plane. Pairs hold the force along y or z and the moment that bends the link
/// towards positive y or z.
struct Plane {
    spread: f64,
    tip: (f64, f64),
    point_load: fn(&PointLoad) -> (f64, f64),
}

impl LinkTerms {
    /// Computes elongation, bending in two planes and twist of a cantilever under its loads.
    ///
    /// ```text
    /// Δx = [q_x l² + 2 (Σ P_x s + G_x l)] / (2EA)
    /// Δy = [q_y l⁴ + 4 (M l² + Σ P_y s² (l − s))] / (8EI) + [Σ P_y s³ + G_y l³] / (3EI)
    /// Δz = [M l² + Σ M_s s² + 2 Σ M_s s (l − s)] / (2EI)
    /// Δφ = [Σ M_x s + M_x l] / (GI_p)
    /// slope y = q_y l³ / (6EI) + [Σ P_y s² + G_y l² + 2 M l] / (2EI)
    /// slope z = [Σ M_s s + M l] / (EI)
    /// ```
    /// \[Chen2021, eq. 4 for a link that carries loads, eq. 6 for one that does not\]
    ///
    /// In the link frame: q [N/m], point loads P \[N\] and `M_s` [N·m] at s \[m\], tip load G
    /// \[N\], M [N·m]. The links of the paper bend in a vertical plane, so that it omits forces
    /// along z and moments of carried masses in the vertical plane. Here both planes have all
    /// terms, which vanish for its arm.
    ///
    /// Printed differently: `TipForceLever`, G l² instead of G l³ in Δy of eq. 4; `HoistBending`,
    /// the hoist enters eq. 4 only by `F_1r` in Δx, although the text says that `F_1n` and `M_F1`
    /// bend the link; `Stretch`, q l²/(EA) in eq. 6; `HoistBeyond`, no hoist in eq. 6.
    pub fn new(loads: &LinkLoads, reading: &Reading) -> Self {
        let l = loads.length;
        let carries = !loads.points.is_empty();
        let hoist_bends = !reading.keeps(Misprint::HoistBending);
        let tip = if carries || !reading.keeps(Misprint::HoistBeyond) {
            Wrench {
                force: loads.tip.force + loads.tip_hoist.force,
                moment: loads.tip.moment + loads.tip_hoist.moment,
            }
        } else {
            loads.tip
        };
        let weight_arm =
            if !carries && reading.keeps(Misprint::Stretch) { l * l } else { 0.5 * l * l };
        let pulls: f64 = loads.points.iter().map(|p| p.wrench.force.x * p.station).sum();
        let bending: Vec<PointLoad> =
            loads.points.iter().filter(|p| hoist_bends || !p.hoist).copied().collect();
        let twists: f64 = bending.iter().map(|p| p.wrench.moment.x * p.station).sum();
        let lever =
            if carries && reading.keeps(Misprint::TipForceLever) { l * l } else { l * l * l };
        let y = Plane {
            spread: loads.spread.y,
            tip: (tip.force.y, tip.moment.z),
            point_load: |p| (p.wrench.force.y, p.wrench.moment.z),
        };
        let z = Plane {
            spread: loads.spread.z,
            tip: (tip.force.z, -tip.moment.y),
            point_load: |p| (p.wrench.force.z, -p.wrench.moment.y),
        };
        // For a link along −x, flexibilities enter with the sign of l.
        let sign = l.signum();
        let scaled = |(deflection, slope): (f64, f64)| (sign * deflection, sign * slope);
        Self {
            stretch: sign * (loads.spread.x * weight_arm + pulls + tip.force.x * l),
            bend_y: scaled(y.tip_deflection(l, lever, &bending)),
            bend_z: scaled(z.tip_deflection(l, lever, &bending)),
            twist: sign * (twists + tip.moment.x * l),
            carries,
        }
    }

    /// Returns `D_A` or `D_B`, the differential motion [Δx Δy Δz Δα Δβ Δθ] of the tip \[m, rad\],
    /// link frame.
    ///
    /// Bending along y rotates about z, bending along z about −y: Δθ = slope y, Δβ = −slope z
    /// [Chen2021, eq. 5, 7].
    ///
    /// Printed differently (`SlopePlaces`): eq. 4 uses the slope of y as Δβ and that of z as Δθ,
    /// and eq. 5 takes them as rotations about y and z. Eq. 7 has slope y right, but slope z
    /// without its sign. Eq. 21-26 use its Δ instead of eq. 6.
    pub fn motion(&self, flexibility: &LinkFlexibility, reading: &Reading) -> Vector6<f64> {
        let slope_y = flexibility.about_z * self.bend_y.1;
        let slope_z = flexibility.about_y * self.bend_z.1;
        let (about_y, about_z) = match (reading.keeps(Misprint::SlopePlaces), self.carries) {
            (false, _) => (-slope_z, slope_y),
            (true, true) => (slope_y, slope_z),
            (true, false) => (slope_z, slope_y),
        };
        Vector6::new(
            flexibility.axial * self.stretch,
            flexibility.about_z * self.bend_y.0,
            flexibility.about_y * self.bend_z.0,
            flexibility.twist * self.twist,
            about_y,
            about_z,
        )
    }
}

impl Plane {
    /// Returns EI times the deflection \[N·m³\] and EI times the slope \[N·m²\] of the tip in the
    /// plane. `l` is the length of the link \[m\], and `lever` is l³, by which the tip force is
    /// multiplied, or l² as printed.
    fn tip_deflection(&self, l: f64, lever: f64, points: &[PointLoad]) -> (f64, f64) {
        let (force, moment) = self.tip;
        let mut deflection =
            self.spread * l.powi(4) / 8.0 + force * lever / 3.0 + moment * l * l / 2.0;
        let mut slope = self.spread * l.powi(3) / 6.0 + force * l * l / 2.0 + moment * l;
        for point in points {
            let ((force, moment), s) = ((self.point_load)(point), point.station);
            deflection += force * (s.powi(3) / 3.0 + s * s * (l - s) / 2.0)
                + moment * (s * s / 2.0 + s * (l - s));
            slope += force * s * s / 2.0 + moment * s;
        }
        (deflection, slope)
    }
}
