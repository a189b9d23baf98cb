//! Which form of each misprinted formula is used.

/// How a formula is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Form {
    /// As it stands in the paper.
    Printed,
    /// As it must be.
    #[default]
    Corrected,
}

/// A misprint that changes a formula; each is documented where the formula stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Misprint {
    /// Eq. 4: `F_y2` has G₄ₙ l² for G₄ₙ l³.
    TipForceLever,
    /// Eq. 4: the hoist stretches link B but does not bend it.
    HoistBending,
    /// Eq. 4, 5, 7: slopes stand in each other's places, or without their sign.
    SlopePlaces,
    /// Eq. 6: q l²/(EA) for q l²/(2EA).
    Stretch,
    /// Eq. 6: link A carries the weights beyond it, but not the hoist beyond it.
    HoistBeyond,
    /// Eq. 10: joint 2 has the length of joint 3.
    JointTwoLength,
    /// Eq. 8-10: torsion turns about `z_i` after Ry(β), the joint about `z_i` before it; the same for β = 0.
    JointAxis,
    /// Eq. 16: `U_i` for `U_{i+1}`.
    TransferIndex,
    /// Eq. 21: the deflection acts at the link's root, not at its tip.
    LinkSide,
    /// Eq. 23-25: carried to the end point by the frames before the link, not by those after it.
    LinkTransfer,
    /// Eq. 28, 29: `dT_i` = `Δ_i` `T_i` for `T_i` `Δ_i`.
    GeometricSide,
    /// Eq. 37, 39: motions of the end frame are taken for motions in the measuring frame.
    EndFrame,
    /// Eq. 45: `E_j` has no β.
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
