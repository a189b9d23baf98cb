//! Closed forms of \[Chen2021\], equation by equation: a baseline and a check of the model.
//!
//! \[Chen2021\] Chen Gang, Sun Fenglei, Li Tong, Shao Wen: "Accuracy Compensation for a Lunar
//! Sampling Manipulator with Elastic Deformation", J. Nanjing Univ. of Aeronautics & Astronautics
//! 53(1), 2021, 1-10, doi 10.16356/j.1005-2615.2021.01.001 (Chinese).
//!
//! | equations | here |
//! |---|---|
//! | 1-2 frames | [`Mdh`], [`Chain`] |
//! | 3-7 deflection of links | [`Loads`], [`LinkTerms`] |
//! | 8-11 torsion of joints | [`joint`] |
//! | 12-27 transfer to the end point | [`transfer`](fn@transfer), [`joint_transfer`], [`link_transfer`], [`Elastic`] |
//! | 28-38 geometric errors | [`geometric`] |
//! | 39-41 end-point error | [`EndPoint`] |
//! | 42-45 least squares, iteration | [`least_squares`], [`stiffness`], [`identify`](fn@identify), `PseudoInverse` |
//! | tables 1-3 | [`published`] |
//!
//! The module shares no physics with [`model`](crate::model): forces are resolved in the frames of
//! the rigid arm, and every effect is of first order.
//!
//! # Misprints
//! Each misprinted formula takes a [`Reading`], which selects for each [`Misprint`] the printed or
//! the corrected [`Form`]. The difference is documented at the formula, its size in
//! `docs/paper.md`. Misprints outside the formulas:
//!
//! - Table 1 has `α_2` = −90°, table 2 has 90°: two conventions for the sign of θ₂ to θ₄, metres
//!   apart for the same angles. Table 2 identifies Δβ₁ = Δθ₂ = 0.304°, as a minimum-norm step does
//!   at −90°, where both rotate the arm alike; at 90° it gives opposite values. "Bends toward +y"
//!   (§2.1) also implies −90°. Against it: parallel axes would give Δd₂ = Δd₃ = Δd₄, but table 2
//!   has 16, 5 and 8 mm. The closed forms accept any α.
//! - Tables 1 and 2 print a in degrees and a, d in mm; they are metres (otherwise the reach is 3.7
//!   mm).
//! - Table 1 prints d₃ = −a₃, the length of link A; with table 2 it is −0.10 m, presumably −a₂.
//! - §2.1.1 calls both components of the camera position `r_cx`; its moment is `M_c` = −`m_c` g
//!   `r_cz`, as the frames require.
//! - Eq. 8 has l₅, the length of a link 5 that an arm of four joints lacks. Joints enter by
//!   l/(`GI_p`) = 1/k alone.
//! - Eq. 13 to 16 lack their products and sums over the joints; eq. 17 has them.
//! - Eq. 26 is "in the inertial frame", where eq. 25 and 27 to 39 have the end frame.
//! - The text to table 3 prints 88.63 %, but its numbers give 1 − 5.5416/48.9644 = 88.68 %.
//! - Table 2 identifies Δθ₄ and Δβ₄ from positions. The end point of eq. 2 lies on axis 4, where
//!   both columns of `J_g` vanish; they are identifiable only with the target off the axis, as in
//!   [`Chain`].

mod end_point;
mod form;
pub mod geometric;
mod identify;
pub mod joint;
mod kinematics;
mod link;
mod loads;
mod parameters;
pub mod published;
mod residuals;
mod stiffness;
mod transfer;

pub use end_point::EndPoint;
pub use form::{Form, Misprint, Reading};
pub use identify::{Identified, IdentifyError, Options, identify};
pub use kinematics::{Chain, Mdh};
pub use link::LinkTerms;
pub use loads::Loads;
pub use parameters::{Flexibility, Parameters};
pub use residuals::Measured;
pub use stiffness::{StiffnessStage, least_squares};
pub(crate) use transfer::Elastic;
pub use transfer::{inertial_link_transfer, joint_transfer, link_transfer, transfer};
