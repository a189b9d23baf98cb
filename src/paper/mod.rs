//! The paper's closed forms, equation by equation, in plain numbers: a baseline and a check.
//!
//! \[Chen2021\] Chen Gang, Sun Fenglei, Li Tong, Shao Wen: "Accuracy Compensation for a Lunar Sampling Manipulator with
//! Elastic Deformation", J. Nanjing Univ. of Aeronautics & Astronautics 53(1), 2021, 1-10,
//! doi 10.16356/j.1005-2615.2021.01.001 (Chinese).
//!
//! | equations | here |
//! |---|---|
//! | 1-2 frames | [`Mdh`], [`Chain`] |
//! | 3-7 deflection of links | [`Loads`], [`LinkTerms`] |
//! | 8-11 torsion of joints | [`joint`] |
//! | 12-27 transfer to the end point | [`transfer`], [`joint_transfer`], [`link_transfer`], [`Elastic`] |
//! | 28-38 geometric errors | [`geometric`] |
//! | 39-41 end-point error | [`EndPoint`] |
//! | 42-45 least squares, iteration | [`least_squares`], [`identify`], [`crate::least_squares::solver::PseudoInverse`] |
//!
//! Shares no physics with the model: forces are resolved in the frames of the rigid arm and every effect is of first order.
//!
//! # Misprints
//! Each formula that is misprinted takes a [`Reading`], which says for each [`Misprint`] whether the [`Form`] is the
//! printed or the corrected one; the difference stands where the formula does. Misprints that are not formulas:
//!
//! - Table 1 has `α_2` = −90°, table 2 has 90°: two conventions for the sign of θ₂ to θ₄. Table 2 is the one used here;
//!   with table 1 the same angles move the arm the other way, which is metres.
//! - Tables 1 and 2 print a in degrees and a, d in mm; they are metres: a reach of 3.7 mm otherwise.
//! - §2.1.1 calls both components of the camera's place `r_cx`; its moment is `M_c` = −`m_c` g `r_cz`. The frames decide.
//! - The text to table 3 prints 88.63 % where its numbers give 1 − 5.5416/48.9644 = 88.68 %.
//! - Table 2 identifies Δθ₄ and Δβ₄ from positions. The end point of eq. 2 lies on axis 4, where both columns of `J_g` are
//!   zero; they can be seen only with the target off the axis, as in [`Chain`].

mod end_point;
mod form;
pub mod geometric;
mod identify;
pub mod joint;
mod kinematics;
mod link;
mod loads;
mod parameters;
mod residuals;
mod transfer;

pub use end_point::EndPoint;
pub use form::{Form, Misprint, Reading};
pub use identify::{Identified, IdentifyError, Options, StiffnessStage, identify, least_squares, stiffness};
pub use kinematics::{Chain, Mdh};
pub use link::{LinkFlexibility, LinkTerms};
pub use loads::{JointLoads, LinkLoads, Loads, PointLoad, Wrench};
pub use parameters::{Flexibility, Parameters};
pub use residuals::{GeometryResiduals, Measured};
pub use transfer::{Elastic, joint_transfer, link_transfer, link_transfer_of_eq24, transfer};
