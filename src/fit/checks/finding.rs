//! Findings: reports of the checks of a fit, with stable codes that programs can act on.

use std::fmt;

use serde::ser::{Serialize, SerializeStruct as _, Serializer};
use serde_json::{Map, Value};

worded! {
    /// Severity of a finding.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
    pub enum Severity: as_str {
        /// Information about fit or data that needs no action.
        Note = "note";
        /// Circumstance that the user should examine; the fit may still be right.
        Warning = "warning";
        /// Reason not to trust the fit: commands end with exit status 1.
        Error = "error";
    }
}

/// Codes of findings on a misfit, whose usual remedy is to check units, signs or priors.
pub(super) const OF_MISFIT: [FindingCode; 4] = [
    FindingCode::MissesMeasurements,
    FindingCode::BeyondPrior,
    FindingCode::BeyondArmSize,
    FindingCode::NoiseBeyondDeclared,
];

/// Codes of findings that name a mistake of the input.
pub(in crate::fit) const MISTAKES: [FindingCode; 8] = [
    FindingCode::Misread,
    FindingCode::ViewsReversed,
    FindingCode::ViewsDoubted,
    FindingCode::ColumnDoubted,
    FindingCode::RowsDoubted,
    FindingCode::RowsChanged,
    FindingCode::OtherSize,
    FindingCode::ScaleContradicted,
];

/// Codes of findings that follow from a mistake of the input. Their usual remedies apply only without
/// one, and commands do not print them beside it.
pub(in crate::fit) const CONSEQUENCES: [FindingCode; 11] = [
    FindingCode::PriorContradicted,
    FindingCode::PriorWidth,
    FindingCode::NoiseBeyondDeclared,
    FindingCode::ResidualBeyondDeclared,
    FindingCode::SigmaOverstated,
    FindingCode::HeldOutWorse,
    FindingCode::HeldOutBeyondPrediction,
    FindingCode::HeldOutNotBetter,
    FindingCode::HeldOutUncertain,
    FindingCode::HeldOutOutliers,
    FindingCode::RowsSetAside,
];

/// Codes of findings for which an exported file is not to be relied upon alone, although no check
/// objects: they contradict the fit, or say that it could not be judged.
pub(in crate::fit) const RESERVATIONS: [FindingCode; 6] = [
    FindingCode::PriorsDecide,
    FindingCode::RowsChanged,
    FindingCode::HeldOutBeyondPrediction,
    FindingCode::HeldOutNotBetter,
    FindingCode::HeldOutUncertain,
    FindingCode::SetUpUndecided,
];

/// States that held-out rows contradict the error bounds of predictions; `None` if they do not.
/// `findings` has code and text of each finding.
pub(in crate::fit) fn doubted_bounds<'a>(
    mut findings: impl Iterator<Item = (&'a str, &'a str)>,
) -> Option<String> {
    let against = FindingCode::HeldOutBeyondPrediction.entry().code;
    let is_against = |(code, _): &(&str, &str)| *code == against;
    let (_, text) = findings.find(is_against)?;
    Some(format!("the error bounds may be too small, for held-out rows contradict them: {text}"))
}

/// Description of a finding code, one row of the table in `docs/findings.md`.
#[derive(Debug, Clone, Copy)]
pub struct FindingEntry {
    /// Code in JSON files; it never changes its meaning.
    pub code: &'static str,
    /// Severity of every finding with this code.
    pub severity: Severity,
    /// Names of the entries in [`Finding::numbers`] of a finding with this code, in their order.
    pub numbers: &'static [&'static str],
    /// Statement that every finding with this code makes, in one sentence.
    pub meaning: &'static str,
    /// Default remedy, used if the check suggests no specific one.
    pub remedy: &'static str,
}

macro_rules! finding_codes {
    ($($(#[$doc:meta])* $name:ident: $severity:ident $code:literal [$($number:literal),*] $meaning:literal, $remedy:literal;)*) => {
        /// Code of a finding, one for each circumstance that a check reports.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[non_exhaustive]
        pub enum FindingCode {
            $(#[doc = $meaning] $name,)*
        }

        impl FindingCode {
            /// All codes, in the order of `docs/findings.md`.
            pub const EACH: &[Self] = &[$(Self::$name),*];

            /// Returns the description of the code.
            #[doc(hidden)]
            pub const fn entry(self) -> FindingEntry {
                match self {
                    $(Self::$name => FindingEntry {
                        code: $code,
                        severity: Severity::$severity,
                        numbers: &[$($number),*],
                        meaning: $meaning,
                        remedy: $remedy,
                    },)*
                }
            }
        }
    };
}

finding_codes! {
    TooFewEquations: Error "too-few-equations" ["of", "coordinates", "parameters"]
        "The whole fit, a base or a tool has fewer measured coordinates than parameters without a \
         prior.",
        "measure more different poses, or give priors";
    BaseNotDetermined: Error "base-not-determined" ["of", "poses"]
        "The measured points of a base leave its pose open, as points on a line do.",
        "measure more poses of this session, or give its base a prior";
    ViewsUndecided: Error "views-undecided" ["kind", "parameters", "coordinates", "turn", "across"]
        "The views of a camera leave its pose or that of the marker open, and no prior gives it: \
         the camera does not turn about two axes, or sees a flat marker from the front only.",
        "add views with the camera turned against the marker by 30° and more about two axes that \
         are not parallel, or declare the place of the camera or of the marker (at_m, \
         rotation_deg)";
    Misread: Error "misread" ["explanations", "before", "after"]
        "With another reading of the table or the problem, less than a fifth of the error \
         remains, or no more than noise.",
        "correct units, signs, order or convention in the table or the problem";
    StrategyMisfit: Error "strategy-misfit" ["before", "after"]
        "Another reading of the input would explain the error, but strategy joint leaves less than a \
         fifth of it without one.",
        "fit with strategy joint";
    ViewsReversed: Error "views-reversed" ["views", "before", "after"]
        "Some views number the points of a marker from the other end.",
        "reverse the column point in these views or leave them out; a board that looks different \
         after half a turn prevents it";
    ViewsDoubted: Error "views-doubted" ["rows", "reduced_chi2_without"]
        "A few views of a camera cause most of the misfit: the arm moved while the image was taken, \
         or the joints are those of another image.",
        "leave these views out, or correct their joints";
    ColumnDoubted: Error "column-doubted" ["columns", "before", "after"]
        "The fit is far off, and a column of the table stands still, is filled down, is sorted by \
         itself, or is not followed by the positions.",
        "correct the column, or leave its rows out";
    RowsDoubted: Error "rows-doubted" ["rows", "of", "before", "after"]
        "The fit is far off, and the nominal arm fits most rows without the others.",
        "correct these rows, or leave them out";
    PositionsComputed: Error "positions-computed" ["rms"]
        "The registered nominal arm predicts the positions to 10 µm per metre of its reach and a \
         fifth of σ, as no built arm does.",
        "measure the positions with an instrument; those that the controller shows are computed \
         from the joint angles";
    MissesMeasurements: Error "misses-measurements" ["kind", "rms", "spread"]
        "The fitted arm misses the measurements by more than 2 % of their spread and more than \
         100 σ.",
        "check units, signs of joints, and whether base and session are declared";
    NoBetterThanNominal: Error "no-better-than-nominal" ["kind", "before", "after"]
        "The fitted arm is as far from contacts, distances or tilts as the nominal arm, and more \
         than 1000 σ off.",
        "check units, signs of joints, and the names in the table";
    OtherSize: Error "other-size" ["measured", "expected"]
        "The spread of the measured points differs from that of the nominal arm by more than a \
         factor of 2.",
        "check units, and what the columns hold";
    NotConverged: Error "not-converged" ["termination"]
        "The fit did not converge.",
        "check units, signs of joints, sessions and priors, or take another solver";
    HeldOutNotConverged: Error "held-out-not-converged" ["termination"]
        "The fit of bases and tools of held-out sessions did not converge.",
        "check these sessions, or hold out other rows";
    TwoSolutions: Error "two-solutions" ["parameter", "estimate", "second", "excess", "probability", "apart", "configuration"]
        "A second arm, more than 3 standard errors from the fitted one, explains the measurements \
         too: its probability is above 0.1 %.",
        "measure poses in which the two differ, or give priors that decide between them";
    BeyondPrior: Error "beyond-prior" ["parameter", "sigmas"]
        "A parameter of the arm, or a number of a point, anchor, surface, camera or marker, \
         deviates from nominal by more than 5 times the σ of its prior.",
        "check axes of the measuring frame, signs of joints, units, and the prior";
    ScaleContradicted: Error "scale-contradicted" ["error", "sigmas", "lengths"]
        "All fitted lengths of the arm together deviate from nominal by one factor, more than \
         0.3 % and more than 5 standard deviations beyond their priors, or more than 1 % and 3.5 \
         standard deviations.",
        "check the lengths that scale the measurements, or the joint table";
    BeyondArmSize: Error "beyond-arm-size" ["parameter", "sizes"]
        "A parameter deviates by more than the size of the arm, half a turn, or a factor of 100.",
        "give it a prior, or check units and the table's columns";
    HeldOutCopied: Error "held-out-copied" ["rows"]
        "Every held-out row is an identification row again, so that held-out errors judge nothing.",
        "hold out rows that were not fitted";
    HeldOutMissed: Error "held-out-missed" ["kind", "median", "spread"]
        "Half of the held-out rows are missed by more than 2 % of the spread of the fitted ones \
         and more than 100 σ.",
        "check whether these rows belong together, and whether the fitted poses cover them";
    HeldOutWorse: Error "held-out-worse" ["kind", "before", "after"]
        "The fitted arm misses held-out rows by more than 1.5 times what the nominal arm misses \
         them by.",
        "more poses, fewer free parameters or smaller priors are needed";
    PriorContradicted: Error "prior-contradicted" ["rule", "factor", "sigma_ratio"]
        "The data refute the σ of a rule of `[parameters]`: with a σ 3 and more times as large \
         the residual falls by more than half.",
        "declare a larger σ, or check the nominal values and their units";
    NoiseBeyondDeclared: Error "noise-beyond-declared" ["noise_factor", "sigma_taken"]
        "Residuals and priors indicate a noise variance of more than 1000 times the declared one.",
        "look for what the model lacks with flexcal loop, or check the unit of the declared σ";
    PayloadAtTarget: Error "payload-at-target" ["before", "after"]
        "The measurements indicate that the payload hangs at the identified target; the problem \
         does not declare its place.",
        "declare payload_at = \"target\" in [tool], or its place as payload_at_m";
    OrientationMisfit: Error "orientation-misfit" ["rms", "sigma", "conventions"]
        "The fitted arm misses the measured orientations by more than 2° and 20 σ, or their \
         scatter is more than 31 times their declared σ.",
        "check the convention of the orientation columns and their frames";
    LensContradicted: Error "lens-contradicted" ["parameters", "before", "after"]
        "Held intrinsics of a camera cause most of the misfit, or of that within the views: with \
         them free it falls by three quarters of what exceeds noise, and beyond chance (F test, \
         probability below 0.0001).",
        "free them in [parameters] (\"camera*.f*\" = { free = true } …), or declare better ones";
    ExcludedRowsFitted: Error "excluded-rows-fitted" ["rows", "of", "reduced_chi2"]
        "Rows that a loop excluded from the choice of effects count in full in its last fit, whose \
         χ²/ν is larger than noise explains.",
        "correct these rows or leave them out, or limit their influence with a section [robust]";
    FartherSolution: Warning "farther-solution" ["parameter", "estimate", "second", "excess", "probability", "apart", "configuration"]
        "A second arm explains the measurements too, but deviates from the nominal arm 19 times as \
         much and more: its probability is below 5 %.",
        "measure poses in which the two differ, or give priors that decide between them";
    PriorsDecide: Warning "priors-decide" ["poses", "coordinates", "parameters"]
        "The poses measure fewer coordinates than parameters are fitted, so that priors decide \
         part of the result.",
        "measure more different poses";
    NarrowPoses: Warning "narrow-poses" ["columns", "alike"]
        "A joint stands still in all fitted rows, or no joint turns by more than 10°, so that the \
         fit says little about other poses.",
        "if the arm will move beyond these values, measure poses in which all joints move \
         (flexcal plan chooses them)";
    RowsChanged: Warning "rows-changed" ["row", "place", "before", "after"]
        "From a row on, one place of the model (target, base, camera, marker, a joint's zero position, or \
         the whole arm) is different: this change explains more than four fifths of what noise does \
         not, neither another order of the rows nor a drift does; the whole arm is named only if \
         both parts then fit within the declared noise. The same of two such changes, or of a target \
         that sits elsewhere in rows between others.",
        "check what changed between these rows, and fit the rows before and after by themselves";
    NominalFarOff: Warning "nominal-far-off" ["kind", "rms", "spread", "explanations"]
        "The nominal arm misses the measurements by more than a tenth of their spread.",
        "check units, signs of joints, and whether the numbers are of this convention of frames";
    GivesWayUpwards: Warning "gives-way-upwards" ["parameter", "compliance", "sigmas"]
        "A joint gives way against its load: its compliance as a whole is negative by more than 5 \
         standard errors.",
        "check the sign of gravity_m_s2, the places of masses and payload, and whether a spring, \
         counterweight or hoist is missing";
    CommandsRounded: Warning "commands-rounded" ["step_deg", "rounding", "rms"]
        "The commands of each joint are multiples of a step, and rounding to these steps would \
         leave an error of the size of the residual.",
        "log the joint angles with more digits";
    SigmaOverstated: Warning "sigma-overstated" ["sigma", "rms"]
        "The declared σ of the leading kind of rows (positions, if there are any) is more than \
         30 times what the fit leaves.",
        "check the unit of σ: micrometres under a key in millimetres make it 1000 times too large";
    EarlierEstimateContradicted: Warning "earlier-estimate-contradicted" ["cause", "probability", "widened"]
        "New rows contradict the earlier estimate that is the prior, with a false alarm in at \
         most one of 100 fits.",
        "find what happened to the arm since (flexcal watch tells); if the prior is of a fleet, \
         find how this arm differs from it";
    HeldOutRepeated: Warning "held-out-repeated" ["rows", "of"]
        "Some held-out rows are identification rows again.",
        "hold out rows that were not fitted";
    HeldOutPosesFitted: Warning "held-out-poses-fitted" ["rows", "of"]
        "More than half of the held-out rows are of poses that identification rows measure too.",
        "hold out poses that are not fitted, as held_out = { fraction = 0.3, seed = 1 } does";
    HeldOutOutliers: Warning "held-out-outliers" ["rows", "of"]
        "Some held-out rows are farther from the prediction than its σ allows.",
        "look for mistyped numbers and signs there; where there are none, run flexcal loop";
    HeldOutBeyondPrediction: Warning "held-out-beyond-prediction" ["chi2", "coordinates", "p_value"]
        "The held-out residuals are larger than the σ and the covariance of the fit predict \
         (probability below 0.001).",
        "look for what the model lacks with flexcal loop, or measure poses like the held-out ones";
    HeldOutNotBetter: Warning "held-out-not-better" ["kind", "before", "after"]
        "The fit made the error of held-out rows worse than that of the nominal arm, beyond \
         chance.",
        "measure more poses, free fewer parameters, or give narrower priors";
    HeldOutUncertain: Warning "held-out-uncertain" ["kind", "ratio"]
        "Pixels that were not fitted are missed by more than three times as much as those fitted, \
         and the covariance of the fit allows it: the images do not tell enough.",
        "measure more poses (flexcal plan chooses them)";
    SetUpUndecided: Warning "set-up-undecided" ["kind", "coordinates", "turn", "across"]
        "Measured poses with orientations leave coordinates of tool and base open against each \
         other, because the tool turns about one axis only or not at all: the arm may be right, \
         the place of what was measured on the hand is not known.",
        "turn the tool by 30° and more about two axes that are not parallel, or hold or declare \
         these coordinates";
    BoundInUnidentifiedDirection: Warning "bound-in-unidentified-direction" ["parameter", "bound", "deviation", "partners"]
        "A fit rests on a bound or constraint along a direction that the data hardly see, and \
         parameters follow it.",
        "fix one of these parameters, or give them priors";
    LimitContradicted: Warning "limit-contradicted" ["limits", "before", "after"]
        "Bounds or constraints cause most of a misfit that contradicts the declared σ: without \
         them less than half of the error remains.",
        "check these limits";
    HeldParameter: Warning "held-parameter" ["parameter", "alike", "before", "after"]
        "A parameter of the geometry that the problem holds explains most of a misfit that \
         contradicts the declared σ: free, it takes away more than four fifths of what noise does \
         not explain, two of them 19 twentieths, or the six of a base together more than half. The same of the held numbers \
         of a point, an anchor or a surface, which leave less than a twentieth.",
        "free this parameter in [parameters]";
    InfluentialRows: Warning "influential-rows" ["rows", "reduced_chi2_without"]
        "A few rows cause most of the misfit.",
        "look at these rows; a section [robust] limits their influence";
    RowsSetAside: Warning "rows-set-aside" ["rows", "of", "depends_on", "p_value"]
        "A robust loss sets many rows aside, and time, session, a joint or a load decides which.",
        "look for the cause with flexcal loop, or check these rows";
    HeldOutBaseNotDetermined: Warning "held-out-base-not-determined" ["of", "poses"]
        "The held-out points of a session do not determine its base or tool, so that its held-out \
         errors say little.",
        "measure more poses of this session, or give its base a prior";
    UnsteadyPoint: Warning "unsteady-point" ["point", "times", "share"]
        "The predictions at one touched point scatter far more than at the others, and along one \
         direction.",
        "check whether the point moved or gave way; if it moved, declare a further [[point]] and \
         name that one in the rows after the move";
    Outliers: Note "outliers" ["rows", "of"]
        "Some identification rows are farther from the fit than noise explains.",
        "look at these rows; a section [robust] limits their influence";
    PriorWidth: Note "prior-width" ["rule", "declared", "estimated"]
        "The fitted deviations indicate a prior σ that is more than twice as large, or less than \
         half.",
        "declare the estimated σ, or leave the prior as it is where it is known better";
    ResidualBeyondDeclared: Note "residual-beyond-declared" ["noise_factor", "sigma_taken"]
        "Residuals and priors indicate a noise variance above the declared one, by a factor of up \
         to 1000.",
        "look for what the model lacks with flexcal loop, or declare a larger σ";
    NotToldApart: Note "not-told-apart" ["what", "parameters"]
        "The rows alone leave a quantity open: the pose of the base, the scale, a focal length, \
         or parameters that move the same way.",
        "hold some of the parameters, or measure what determines them";
}

/// Circumstance that a check of a fit reports.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Code, which determines the severity.
    pub code: FindingCode,
    /// Numbers and words of this case, each with its name from [`FindingEntry::numbers`]; SI units.
    pub numbers: Vec<(&'static str, Value)>,
    /// Statement about this case, without the remedy.
    pub text: String,
    /// Suggested remedy; empty if there is none.
    pub remedy: String,
}

impl Finding {
    /// Creates a finding with the default remedy of its code; `numbers` are in the order of
    /// [`FindingEntry::numbers`].
    pub(crate) fn new<const N: usize>(
        code: FindingCode,
        numbers: [Value; N],
        text: String,
    ) -> Self {
        let entry = code.entry();
        let numbers = entry.numbers.iter().copied().zip(numbers).collect();
        Self { code, numbers, text, remedy: entry.remedy.to_owned() }
    }

    /// Returns the finding with its remedy replaced by one specific to this case.
    #[must_use]
    pub(crate) fn with_remedy(self, remedy: impl Into<String>) -> Self {
        Self { remedy: remedy.into(), ..self }
    }

    /// Returns the finding with its remedy replaced if there is one specific to this case.
    #[must_use]
    pub(crate) fn with_remedy_of(self, remedy: Option<String>) -> Self {
        match remedy {
            Some(remedy) => self.with_remedy(remedy),
            None => self,
        }
    }

    /// Replaces a remedy that suggests `flexcal loop` by one that applies after a loop; other
    /// remedies stay.
    pub(crate) fn set_remedy_after_loop(&mut self) {
        let remedy = match self.code {
            FindingCode::HeldOutBeyondPrediction => {
                "measure poses like the held-out ones and fit them too"
            }
            FindingCode::NoiseBeyondDeclared => "check the unit of the declared σ",
            FindingCode::ResidualBeyondDeclared => {
                "declare a larger σ if the instrument is less accurate"
            }
            FindingCode::RowsSetAside => "check these rows",
            FindingCode::HeldOutOutliers => {
                "numbers or signs are mistyped there, or what the loop found begins at another time \
                 or is not the right cause"
            }
            _ => return,
        };
        self.remedy = format!("flexcal loop does not remove this: {remedy}");
    }

    /// Returns the severity of the finding, which its code determines.
    pub const fn severity(&self) -> Severity {
        self.code.entry().severity
    }

    /// Returns the number or word with the name `name`; `None` if the finding has none.
    #[doc(hidden)]
    pub fn value(&self, name: &str) -> Option<&Value> {
        self.numbers.iter().find(|(known, _)| *known == name).map(|(_, value)| value)
    }

    /// Returns the number with the name `name`; `None` if it is missing or a word.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.value(name)?.as_f64()
    }

    /// Returns the whole number with the name `name`, or the length of this list; `None` if it is
    /// neither.
    pub(crate) fn count(&self, name: &str) -> Option<usize> {
        let value = self.value(name)?;
        let listed = value.as_array().map(Vec::len);
        listed.or_else(|| usize::try_from(value.as_u64()?).ok())
    }

    /// Returns the word with the name `name`; `None` if it is missing or a number.
    pub fn word(&self, name: &str) -> Option<&str> {
        self.value(name)?.as_str()
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.remedy.is_empty() {
            return f.write_str(&self.text);
        }
        write!(f, "{}; {}", self.text, self.remedy)
    }
}

impl Serialize for Finding {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let numbers: Map<String, Value> =
            self.numbers.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
        let mut object = serializer.serialize_struct("Finding", 5)?;
        object.serialize_field("code", self.code.entry().code)?;
        object.serialize_field("severity", self.severity().as_str())?;
        object.serialize_field("numbers", &numbers)?;
        object.serialize_field("text", &self.text)?;
        object.serialize_field("remedy", &self.remedy)?;
        object.end()
    }
}
