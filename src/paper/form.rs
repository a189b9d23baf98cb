//! Which form of each misprinted formula is used.

/// How a formula is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Form {
    /// As it stands in the paper.
    Printed,
    /// As it must be.
    #[default]
    Corrected,
}

/// A misprint that changes a formula; each is documented where the formula stands.
///
/// Sizes: the largest change of the end point on the lunar sampler over the 40 poses of `tests/golden`, of a deflection of up
/// to 62 mm at nominal geometry, or of 49 mm of geometric error at table 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Misprint {
    /// Eq. 4: `F_y2` has G₄ₙ l² for G₄ₙ l³; 2.8 mm.
    TipForceLever,
    /// Eq. 4: the hoist stretches link B but does not bend it; 3.1 mm.
    HoistBending,
    /// Eq. 4, 5, 7: slopes stand in each other's places, or without their sign; 3.4 mm.
    SlopePlaces,
    /// Eq. 6: q l²/(EA) for q l²/(2EA); 0.0012 mm.
    Stretch,
    /// Eq. 6: link A carries the weights beyond it, but not the hoist beyond it; 28 mm.
    HoistBeyond,
    /// Eq. 10: joint 2 has the length of joint 3; none for the nominal arm, 2.2 mm with the offsets of table 2.
    JointTwoLength,
    /// Eq. 8-10: torsion turns about `z_i` after Ry(β), the joint about `z_i` before it; the same for β = 0, 0.0009 mm at table 2.
    JointAxis,
    /// Eq. 16: `U_i` for `U_{i+1}`; 21 mm.
    TransferIndex,
    /// Eq. 21: the deflection acts at the link's root, not at its tip; 31 mm.
    LinkSide,
    /// Eq. 23-25: carried to the end point by the frames before the link, not by those after it; 49 mm as in eq. 25,
    /// 44 mm as in eq. 24.
    LinkTransfer,
    /// Eq. 28, 29: `dT_i` = `Δ_i` `T_i` for `T_i` `Δ_i`; 101 mm at table 2.
    GeometricSide,
    /// Eq. 37, 39: motions of the end frame are taken for motions in the measuring frame; 92 mm of deflection,
    /// 92 mm of geometric error at table 2.
    EndFrame,
    /// Eq. 45: `E_j` has no β. Those of table 2 move the end point by 21 mm; other parameters make up for most of it where
    /// the axes are parallel: 0.03 mm more are left after eq. 45.
    BetaLeftOut,
}

impl Misprint {
    /// All of them, in the order of the paper.
    pub const ALL: [Self; 13] = [
        Self::TipForceLever,
        Self::HoistBending,
        Self::SlopePlaces,
        Self::Stretch,
        Self::HoistBeyond,
        Self::JointTwoLength,
        Self::JointAxis,
        Self::TransferIndex,
        Self::LinkSide,
        Self::LinkTransfer,
        Self::GeometricSide,
        Self::EndFrame,
        Self::BetaLeftOut,
    ];
}

/// A choice of form for every misprint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Reading {
    forms: [Form; Misprint::ALL.len()],
}

impl Reading {
    /// The form of one misprint.
    pub fn form(&self, misprint: Misprint) -> Form {
        self.forms[misprint as usize]
    }

    /// Whether one misprint is kept.
    pub fn keeps(&self, misprint: Misprint) -> bool {
        self.form(misprint) == Form::Printed
    }

    /// The same with another form of one misprint.
    #[must_use]
    pub fn with(mut self, misprint: Misprint, form: Form) -> Self {
        self.forms[misprint as usize] = form;
        self
    }
}

/// Everything corrected, or everything as printed.
///
/// Where the paper contradicts itself, `Printed` follows the later formula, from which the matrices are built: eq. 17, 18
/// against 16, and eq. 33-37 against 28, 29. Those two misprints have their effect only when chosen by name.
impl From<Form> for Reading {
    fn from(form: Form) -> Self {
        Self { forms: [form; Misprint::ALL.len()] }
            .with(Misprint::TransferIndex, Form::Corrected)
            .with(Misprint::GeometricSide, Form::Corrected)
    }
}
