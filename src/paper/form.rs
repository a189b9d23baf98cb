//! Printed and corrected forms of the misprinted formulas.

/// Form in which a formula is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Form {
    /// Form as printed in the paper.
    Printed,
    /// Form with the misprint corrected.
    #[default]
    Corrected,
}

/// Misprint that changes a formula; each is documented at its formula.
///
/// `docs/paper.md` lists the displacement of the end point by each misprint and its effect on a
/// calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Misprint {
    /// Eq. 4: `F_y2` has G₄ₙ l² instead of G₄ₙ l³.
    TipForceLever,
    /// Eq. 4: the hoist stretches link B but does not bend it.
    HoistBending,
    /// Eq. 4, 5, 7: slopes are exchanged, or lack their sign.
    SlopePlaces,
    /// Eq. 6: q l²/(EA) instead of q l²/(2EA).
    Stretch,
    /// Eq. 6: link A carries the weights beyond it, but not the hoist beyond it.
    HoistBeyond,
    /// Eq. 10: joint 2 has the length of joint 3; no effect on the nominal arm, where both are
    /// equal.
    JointTwoLength,
    /// Eq. 8-10: torsion rotates about `z_i` after Ry(β), but the joint rotates about `z_i` before
    /// it; no effect for β = 0.
    JointAxis,
    /// Eq. 16: `U_i` instead of `U_{i+1}`.
    TransferIndex,
    /// Eq. 21: the deflection acts at the root of the link instead of its tip.
    LinkSide,
    /// Eq. 23, 25: the frames before the link transfer the motion to the end point, instead of
    /// those after it.
    LinkTransfer,
    /// Eq. 28, 29: `dT_i` = `Δ_i` `T_i` instead of `T_i` `Δ_i`.
    GeometricSide,
    /// Eq. 37, 39: the end point's motion stays in the end frame, instead of being rotated into the
    /// measuring frame.
    EndFrame,
    /// Eq. 45: `E_j` lacks β.
    BetaLeftOut,
}

impl Misprint {
    /// All misprints, in the order of the paper.
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

    /// Misprints that the paper contradicts elsewhere, so that its authors cannot have executed
    /// them.
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

    /// Returns the name in results, the equations and a short description.
    const fn words(self) -> (&'static str, &'static str, &'static str) {
        match self {
            Self::TipForceLever => ("tip-force-lever", "eq. 4", "tip force times l² for l³"),
            Self::HoistBending => ("hoist-bending", "eq. 4", "the hoist does not bend link B"),
            Self::SlopePlaces => {
                ("slope-places", "eq. 4, 5, 7", "slopes exchanged, or without their sign")
            }
            Self::Stretch => ("stretch", "eq. 6", "stretch by the link's weight doubled"),
            Self::HoistBeyond => {
                ("hoist-beyond", "eq. 6", "link A does not carry the hoist on link B")
            }
            Self::JointTwoLength => {
                ("joint-two-length", "eq. 10", "joint 2 with the length of joint 3")
            }
            Self::JointAxis => ("joint-axis", "eq. 8-10", "joint torsion about z after Ry(β)"),
            Self::TransferIndex => ("transfer-index", "eq. 16", "U_i for U_{i+1}"),
            Self::LinkSide => ("link-side", "eq. 21", "links deflect about their root"),
            Self::LinkTransfer => {
                ("link-transfer", "eq. 23, 25", "V⁻¹ΔV: carried by the frames before the link")
            }
            Self::GeometricSide => ("geometric-side", "eq. 28, 29", "Δ_i T_i for T_i Δ_i"),
            Self::EndFrame => {
                ("end-frame", "eq. 37, 39", "end frame taken for the measuring frame")
            }
            Self::BetaLeftOut => ("beta-left-out", "eq. 45", "β is not identified"),
        }
    }

    /// Returns the name in results.
    pub const fn as_str(self) -> &'static str {
        self.words().0
    }

    /// Returns the equations that contain the misprint.
    pub const fn place(self) -> &'static str {
        self.words().1
    }

    /// Returns a short description.
    pub const fn summary(self) -> &'static str {
        self.words().2
    }
}

/// Choice of the form of every misprinted formula.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Reading {
    forms: [Form; Misprint::ALL.len()],
}

impl Reading {
    /// Returns the form of one misprint.
    pub fn form(&self, misprint: Misprint) -> Form {
        self.forms[misprint as usize]
    }

    /// Returns true if a misprint is kept, so that its formula has the printed form.
    pub fn keeps(&self, misprint: Misprint) -> bool {
        self.form(misprint) == Form::Printed
    }

    /// Returns the reading with the given form for one misprint.
    #[must_use]
    pub fn with(mut self, misprint: Misprint, form: Form) -> Self {
        self.forms[misprint as usize] = form;
        self
    }
}

/// All formulas corrected, or all misprints kept that the authors can have executed. `Printed`
/// keeps every misprint except [`Misprint::CONTRADICTED`], which apply only if chosen by name.
impl From<Form> for Reading {
    fn from(form: Form) -> Self {
        let uniform = Self { forms: [form; Misprint::ALL.len()] };
        Misprint::CONTRADICTED
            .into_iter()
            .fold(uniform, |reading, misprint| reading.with(misprint, Form::Corrected))
    }
}

/// One misprint kept, all other formulas corrected.
impl From<Misprint> for Reading {
    fn from(misprint: Misprint) -> Self {
        Self::default().with(misprint, Form::Printed)
    }
}
