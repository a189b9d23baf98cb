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
/// How much each moves the end point of the lunar sampler, and what it does to a calibration,
/// stands in `docs/paper.md`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
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
    /// Eq. 10: joint 2 has the length of joint 3; nothing where both are as long, as in the nominal
    /// arm.
    JointTwoLength,
    /// Eq. 8-10: torsion turns about `z_i` after Ry(β), the joint about `z_i` before it; the same
    /// for β = 0.
    JointAxis,
    /// Eq. 16: `U_i` for `U_{i+1}`.
    TransferIndex,
    /// Eq. 21: the deflection acts at the link's root, not at its tip.
    LinkSide,
    /// Eq. 23, 25: carried to the end point by the frames before the link, not by those after it.
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

    /// Those that the paper itself contradicts elsewhere: nobody who ran its formulas can have kept
    /// them.
    ///
    /// Eq. 17 and 18 are right against 16; eq. 21 with 22 is dT = (V Δ V⁻¹) T, which eq. 24 states
    /// in the inertial frame, as the text to eq. 26 says, so that in eq. 23 and 25 only T or the
    /// frame is on the wrong side; eq. 33-37 are right against 28 and 29; the inertial frame of eq.
    /// 26 is against the end frame of eq. 37 and 39; and table 2 identifies the β that the text to
    /// eq. 45 leaves out.
    pub const CONTRADICTED: [Self; 5] = [
        Self::TransferIndex,
        Self::LinkTransfer,
        Self::GeometricSide,
        Self::EndFrame,
        Self::BetaLeftOut,
    ];

    /// Name in results, where it stands, and what it says in a few words.
    const fn words(self) -> (&'static str, &'static str, &'static str) {
        match self {
            Self::TipForceLever => ("tip-force-lever", "eq. 4", "tip force times l² for l³"),
            Self::HoistBending => ("hoist-bending", "eq. 4", "the hoist does not bend link B"),
            Self::SlopePlaces => {
                ("slope-places", "eq. 4, 5, 7", "slopes exchanged, or without their sign")
            }
            Self::Stretch => ("stretch", "eq. 6", "stretch by own weight twice"),
            Self::HoistBeyond => {
                ("hoist-beyond", "eq. 6", "link A does not feel the hoist on link B")
            }
            Self::JointTwoLength => {
                ("joint-two-length", "eq. 10", "joint 2 with the length of joint 3")
            }
            Self::JointAxis => ("joint-axis", "eq. 8-10", "joints give way about z after Ry(β)"),
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

    /// Name in results.
    pub const fn as_str(self) -> &'static str {
        self.words().0
    }

    /// The equations that it stands in.
    pub const fn place(self) -> &'static str {
        self.words().1
    }

    /// What it says, in a few words.
    pub const fn summary(self) -> &'static str {
        self.words().2
    }
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

/// Everything corrected, or everything as printed that the authors can have run: `Printed` keeps
/// every misprint but those of [`Misprint::CONTRADICTED`], which have their effect only when chosen
/// by name.
impl From<Form> for Reading {
    fn from(form: Form) -> Self {
        let all = Self { forms: [form; Misprint::ALL.len()] };
        Misprint::CONTRADICTED
            .into_iter()
            .fold(all, |reading, misprint| reading.with(misprint, Form::Corrected))
    }
}

/// One misprint kept, everything else corrected.
impl From<Misprint> for Reading {
    fn from(misprint: Misprint) -> Self {
        Self::default().with(misprint, Form::Printed)
    }
}
