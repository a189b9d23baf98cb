//! Printed and corrected forms of the misprinted formulas.

/// Form in which a misprinted formula is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Form {
    /// Form as printed in the paper.
    Printed,
    /// Form with the misprint corrected.
    #[default]
    Corrected,
}

worded! {
    /// Misprint of the paper that changes a formula. The function that evaluates the formula
    /// describes it.
    ///
    /// `docs/paper.md` lists the displacement of the end point by each misprint and its effect on a
    /// calibration.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    #[non_exhaustive]
    pub enum Misprint: as_str, place, summary {
        /// Eq. 4: `F_y2` has G₄ₙ l² instead of G₄ₙ l³.
        TipForceLever = "tip-force-lever", "eq. 4", "tip force times l² for l³";
        /// Eq. 4: the hoist stretches link B but does not bend it.
        HoistBending = "hoist-bending", "eq. 4", "the hoist does not bend link B";
        /// Eq. 4, 5, 7: slopes are exchanged, or lack their sign.
        SlopePlaces = "slope-places", "eq. 4, 5, 7", "slopes exchanged, or without their sign";
        /// Eq. 6: q l²/(EA) instead of q l²/(2EA).
        Stretch = "stretch", "eq. 6", "stretch by the link's weight doubled";
        /// Eq. 6: link A carries the weights beyond it, but not the hoist beyond it.
        HoistBeyond = "hoist-beyond", "eq. 6", "link A does not carry the hoist on link B";
        /// Eq. 10: joint 2 has the length of joint 3; no effect on the nominal arm, where both are
        /// equal.
        JointTwoLength = "joint-two-length", "eq. 10", "joint 2 with the length of joint 3";
        /// Eq. 8-10: torsion rotates about `z_i` after Ry(β), but the joint rotates about `z_i`
        /// before it; no effect for β = 0.
        JointAxis = "joint-axis", "eq. 8-10", "joint torsion about z after Ry(β)";
        /// Eq. 16: `U_i` instead of `U_{i+1}`.
        TransferIndex = "transfer-index", "eq. 16", "U_i for U_{i+1}";
        /// Eq. 21: the deflection acts at the root of the link instead of its tip.
        LinkSide = "link-side", "eq. 21", "links deflect about their root";
        /// Eq. 23, 25: the frames before the link transfer the motion to the end point, instead of
        /// those after it.
        LinkTransfer = "link-transfer",
            "eq. 23, 25",
            "V⁻¹ΔV: carried by the frames before the link";
        /// Eq. 28, 29: `dT_i` = `Δ_i` `T_i` instead of `T_i` `Δ_i`.
        GeometricSide = "geometric-side", "eq. 28, 29", "Δ_i T_i for T_i Δ_i";
        /// Eq. 37, 39: the end point's motion stays in the end frame, instead of being rotated into
        /// the measuring frame.
        EndFrame = "end-frame", "eq. 37, 39", "end frame taken for the measuring frame";
        /// Eq. 45: `E_j` lacks β.
        BetaLeftOut = "beta-left-out", "eq. 45", "β is not identified";
    }
}

impl Misprint {
    /// Misprints that the paper contradicts elsewhere, so that its authors cannot have computed
    /// with them.
    ///
    /// Eq. 17 and 18 correct eq. 16. Eq. 21 with 22 is dT = (V Δ V⁻¹) T, which eq. 24 states in the
    /// inertial frame, as the text to eq. 26 says; in eq. 23 and 25 only T or the frame is on the
    /// wrong side. Eq. 33-37 correct eq. 28 and 29. The inertial frame of eq. 26 contradicts the
    /// end frame of eq. 37 and 39. Table 2 identifies the β that the text to eq. 45 omits.
    pub const CONTRADICTED: [Self; 5] = [
        Self::TransferIndex,
        Self::LinkTransfer,
        Self::GeometricSide,
        Self::EndFrame,
        Self::BetaLeftOut,
    ];
}

/// Choice between the printed and the corrected form of each misprinted formula.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Reading {
    forms: [Form; Misprint::EACH.len()],
}

impl Reading {
    /// Returns the form in which the formula with this misprint is evaluated.
    pub fn form(&self, misprint: Misprint) -> Form {
        self.forms[misprint as usize]
    }

    /// Returns true if the formula with this misprint is evaluated as printed.
    pub fn keeps(&self, misprint: Misprint) -> bool {
        self.form(misprint) == Form::Printed
    }

    /// Returns the reading with the formula of one misprint evaluated in the given form.
    #[must_use]
    pub fn with(mut self, misprint: Misprint, form: Form) -> Self {
        self.forms[misprint as usize] = form;
        self
    }
}

/// [`Form::Corrected`] corrects all formulas. [`Form::Printed`] keeps every misprint except
/// [`Misprint::CONTRADICTED`], with which the authors cannot have computed.
impl From<Form> for Reading {
    fn from(form: Form) -> Self {
        let uniform = Self { forms: [form; Misprint::EACH.len()] };
        Misprint::CONTRADICTED
            .into_iter()
            .fold(uniform, |reading, misprint| reading.with(misprint, Form::Corrected))
    }
}

/// The formula of this one misprint is evaluated as printed, all others are corrected.
impl From<Misprint> for Reading {
    fn from(misprint: Misprint) -> Self {
        Self::default().with(misprint, Form::Printed)
    }
}
