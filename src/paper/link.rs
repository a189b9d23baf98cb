//! Deflection of a link's tip, eq. 3-7.

use nalgebra::Vector6;

use super::form::{Misprint, Reading};
use super::loads::{LinkLoads, PointLoad, Wrench};

/// Flexibilities of a link; 0 means rigid there. The paper has one EI for both planes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LinkFlexibility {
    /// 1/EA [1/N].
    pub axial: f64,
    /// `1/EI_y` [1/(N·m²)]: bending in z.
    pub about_y: f64,
    /// `1/EI_z` [1/(N·m²)]: bending in y.
    pub about_z: f64,
    /// 1/`GI_p` [1/(N·m²)].
    pub twist: f64,
}

/// Numerators of eq. 4 and 6: deflections for unit flexibility, link frame, tip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkTerms {
    /// EA Δx [N·m].
    pub stretch: f64,
    /// EI Δy [N·m³] and EI dΔy/dx [N·m²].
    pub bend_y: (f64, f64),
    /// EI Δz [N·m³] and EI dΔz/dx [N·m²].
    pub bend_z: (f64, f64),
    /// `GI_p` Δφ [N·m²].
    pub twist: f64,
    /// Whether the link is one of eq. 4 (it carries loads between its ends, as link B) or of eq. 6
    /// (link A).
    pub carries: bool,
}

/// Loads of one bending plane: forces across the link and moments that bend the same way.
struct Plane {
    spread: f64,
    tip: (f64, f64),
    points: fn(&PointLoad) -> (f64, f64),
}

impl LinkTerms {
    /// Stretch, bending in two planes and twist of a cantilever under its loads.
    ///
    /// Δx = [q_x l² + 2 (Σ P_x s + G_x l)] / (2EA) Δy = [q_y l⁴ + 4 (M l² + Σ P_y s² (l − s))] /
    /// (8EI) + [Σ P_y s³ + G_y l³] / (3EI) Δz = [M l² + Σ M_s s² + 2 Σ M_s s (l − s)] / (2EI) Δφ =
    /// [Σ M_x s + M_x l] / (GI_p) slope y = q_y l³ / (6EI) + [Σ P_y s² + G_y l² + 2 M l] / (2EI),
    /// slope z = [Σ M_s s + M l] / (EI) \[Chen2021, eq. 4 for a link that carries loads, eq. 6 for
    /// one that does not\]
    ///
    /// Link frame: q [N/m], point loads P \[N\], `M_s` [N·m] at s \[m\], tip load G \[N\], M [N·m].
    /// The paper's links bend in a vertical plane, so that it needs no forces along z and no
    /// moments of carried masses in the vertical plane; both forms here have all terms in both
    /// planes, which are zero for its arm.
    ///
    /// Printed differently: `TipForceLever`, G l² for G l³ in Δy of eq. 4 (a force × length² among
    /// forces × length³); `HoistBending`, of the hoist only `F_1r` in Δx of eq. 4, though the text
    /// says that `F_1n` and `M_F1` bend the link; `Stretch`, q l²/(EA) in eq. 6; `HoistBeyond`, no
    /// hoist at all in eq. 6.
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
        let own = if !carries && reading.keeps(Misprint::Stretch) { l * l } else { 0.5 * l * l };
        let pulls: f64 = loads.points.iter().map(|p| p.wrench.force.x * p.station).sum();
        let bending: Vec<PointLoad> =
            loads.points.iter().filter(|p| hoist_bends || !p.hoist).copied().collect();
        let twists: f64 = bending.iter().map(|p| p.wrench.moment.x * p.station).sum();
        let lever =
            if carries && reading.keeps(Misprint::TipForceLever) { l * l } else { l * l * l };
        let y = Plane {
            spread: loads.spread.y,
            tip: (tip.force.y, tip.moment.z),
            points: |p| (p.wrench.force.y, p.wrench.moment.z),
        };
        let z = Plane {
            spread: loads.spread.z,
            tip: (tip.force.z, -tip.moment.y),
            points: |p| (p.wrench.force.z, -p.wrench.moment.y),
        };
        // A link along −x: its flexibilities enter with the sign of l.
        let sign = l.signum();
        let scaled = |(deflection, slope): (f64, f64)| (sign * deflection, sign * slope);
        Self {
            stretch: sign * (loads.spread.x * own + pulls + tip.force.x * l),
            bend_y: scaled(y.bend(l, lever, &bending)),
            bend_z: scaled(z.bend(l, lever, &bending)),
            twist: sign * (twists + tip.moment.x * l),
            carries,
        }
    }

    /// `D_A` or `D_B`: differential motion [Δx Δy Δz Δα Δβ Δθ] of the link's tip, \[m\] and
    /// \[rad\], link frame.
    ///
    /// Bending along y turns about z, bending along z about −y: Δθ = slope y, Δβ = −slope z
    /// [Chen2021, eq. 5, 7]
    ///
    /// Printed differently: `SlopePlaces`. Eq. 4 puts the slope of y into Δβ and that of z into Δθ,
    /// and eq. 5 takes them as rotations about y and z; eq. 7 has slope y right and slope z without
    /// its sign. Its Δ, not eq. 6, is what eq. 21-26 use.
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
    /// EI times deflection and slope of the tip; `lever` is what the tip force is multiplied by.
    fn bend(&self, l: f64, lever: f64, points: &[PointLoad]) -> (f64, f64) {
        let (force, moment) = self.tip;
        let mut deflection =
            self.spread * l.powi(4) / 8.0 + force * lever / 3.0 + moment * l * l / 2.0;
        let mut slope = self.spread * l.powi(3) / 6.0 + force * l * l / 2.0 + moment * l;
        for point in points {
            let ((force, moment), s) = ((self.points)(point), point.station);
            deflection += force * (s.powi(3) / 3.0 + s * s * (l - s) / 2.0)
                + moment * (s * s / 2.0 + s * (l - s));
            slope += force * s * s / 2.0 + moment * s;
        }
        (deflection, slope)
    }
}
