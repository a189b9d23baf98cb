//! Kinds of input errors and their messages.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use super::NoRows;
use super::near::{
    is_it_rather, key_suggestion, known_words, name_suggestion, pattern_suggestion, suggestion,
};
use super::phrases::{
    behind_camera_remedy, decimal_comma_hint, fixtures_of, format_remedy, held_out_example,
    joined_list, missed, near_quote, path_hint, plural, renumbered, stiffness_units, with_remedy,
};
use super::study::StudyErrorKind;
use super::table::TableErrorKind;
use super::urdf::UrdfErrorKind;

/// Kind of an input error.
///
/// The message of each variant states the cause and the remedy. [`Location`](super::Location) holds
/// file and line.
#[derive(Debug, Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the message of each variant says what it stands for")]
pub enum InputErrorKind {
    // The following errors concern files.
    #[error("no such file; {remedy}")]
    ProblemMissing { remedy: String },
    #[error(
        "no such file; give the TRUTH.toml that describes the simulation and that you write \
         (docs/truth.md), or its folder"
    )]
    TruthMissing,
    #[error(
        "no such file: {}; paths in `files` are relative to the problem's folder{}",
        path.display(), path_hint(path)
    )]
    DataFileMissing { path: PathBuf },
    #[error("no such file; paths on the command line are relative to the current folder")]
    GivenFileMissing,
    #[error("cannot be read: {source}")]
    Unreadable { source: io::Error },
    #[error("larger than {most} MiB; is it the right file?")]
    FileTooLarge { most: u64 },
    #[error("the line is longer than {most} KiB; is this a table with one row per line?")]
    LineTooLong { most: u64 },
    #[error("{found} {what}; at most {most}")]
    TooMany { what: &'static str, found: usize, most: usize },
    #[error("not UTF-8 text; save the file as UTF-8")]
    NotUtf8,
    #[error("the header is not UTF-8 text; save the file as UTF-8")]
    HeaderNotUtf8,
    #[error("UTF-16 text, by its byte-order mark; save the file as UTF-8")]
    Utf16,
    #[error("{found}, not {expected}{}", format_remedy(found, expected))]
    OtherFormat { found: &'static str, expected: &'static str },
    #[error("not valid TOML: {message}{}{}", near_quote(near_text), with_remedy(*remedy))]
    Syntax { message: String, near_text: String, remedy: Option<&'static str> },

    // The following errors concern keys.
    #[error(
        "unknown key{}; known here: {}",
        key_suggestion(key, meant.as_deref(), known), known.join(", ")
    )]
    UnknownKey { key: String, meant: Option<String>, known: Vec<String> },
    #[error("does not belong here: {place}")]
    MisplacedKey { place: String },
    #[error("missing; write {write}{}", is_it_rather("", near.as_deref()))]
    MissingKey { write: String, near: Option<String> },
    #[error("a section is expected here; write {write}")]
    NotASection { write: String },
    #[error("expected {expected}, found {found}{remedy}")]
    WrongType { expected: &'static str, found: &'static str, remedy: String },
    #[error("{noun} needs a unit; write {write}")]
    NeedsUnit { noun: &'static str, write: String },
    #[error("{noun} is not given in {suffix}; write {write}")]
    WrongUnit { noun: &'static str, suffix: String, write: String },
    #[error("given already as {first}; keep one of the two")]
    GivenTwice { first: String },
    #[error("\"{word}\" is none of {}", known_words(word, known))]
    UnknownWord { word: String, known: &'static [&'static str] },

    // The following errors concern values.
    #[error("{value} is not a finite number")]
    NotFinite { value: String },
    #[error("{value} is larger than 1e150, the largest number that flexcal accepts")]
    MagnitudeTooLarge { value: String },
    #[error(
        "contains an invisible character (U+{code:04X}: a control character, or a direction \
         mark); remove it"
    )]
    Hidden { code: u32 },
    #[error(
        "a \\ in double quotes begins an escape sequence, here of U+{code:04X}; in a path write / \
         in its place, or put the path in single quotes, as in 'C:\\temp\\new.csv'"
    )]
    EscapedPath { code: u32 },
    #[error("{value} is not a whole number of at least {least}")]
    NotWhole { value: String, least: u64 },
    #[error("{value} is too large; at most {most}")]
    TooLarge { value: u64, most: u64 },
    #[error(
        "a vector has 3 numbers, found {found}{}{}",
        if *found == 4 && !has_close_commas { " (rotations are rotation vectors, not quaternions)" } else { "" },
        decimal_comma_hint(*has_close_commas)
    )]
    NotAVector { found: usize, has_close_commas: bool },
    #[error("expected 2 numbers, found {found}{}", decimal_comma_hint(*has_close_commas))]
    NotAPair { found: usize, has_close_commas: bool },
    #[error(
        "expected {expected} numbers ({names}), found {found}; write 0 for a coefficient that the \
         lens does not have, or leave the key out if it has none"
    )]
    Coefficients { expected: usize, names: String, found: usize },
    #[error("{value} is below zero")]
    Negative { value: f64 },
    #[error("{value} is not above zero")]
    NotPositive { value: f64 },
    #[error("{value} is not above zero; for a rigid part leave the key out")]
    StiffnessNotPositive { value: f64 },
    #[error(
        "{value} is not between 0 and 1{}",
        if (1.0..=100.0).contains(value) { "; write 0.3 for 30 %" } else { "" }
    )]
    NotAFraction { value: f64 },
    #[error("[0, 0, 0] has no direction; write a vector that is not zero")]
    NoDirection,
    #[error("empty; write at least one character")]
    Empty,

    // The following errors concern the arm.
    #[error(
        "\"{name}\" cannot name a folder; leave out / \\ : * ? \" < > | and spaces or dots at \
         either end"
    )]
    NotAFolderName { name: String },
    #[error("an arm has at least one joint; add a section [[joint]]")]
    NoJoints,
    #[error("a beam lies along its joint's a, which is 0 here; give a_m or a_mm")]
    BeamWithoutLength,
    #[error(
        "a beam lies along a before its joint; write the table in the modified form (without dh \
         = \"standard\")"
    )]
    BeamInStandardForm,
    #[error(
        "a standard table describes one chain with one tool after its last row; write the table \
         in the modified form (without dh = \"standard\")"
    )]
    NotInStandardForm,
    #[error("{what} needs a single chain of joints, and this arm is a tree")]
    NotAChain { what: &'static str },
    #[error(
        "{what} needs one tool on the last joint, and this arm has a [[target]], or its tool on \
         another joint"
    )]
    NotOneTool { what: &'static str },
    #[error(
        "joint {joint} cannot be mounted on joint {parent}: list it after the joint that carries it"
    )]
    ParentListedLater { joint: usize, parent: u64 },
    #[error(
        "the branch of joint {parent} has ended; list everything that a joint carries directly \
         after it"
    )]
    BranchEnded { parent: u64 },
    #[error("a fixed joint cannot follow another one; leave mimic out, or write another kind")]
    FixedJointMimics,
    #[error(
        "joint {joint} cannot follow itself; name the joint that it follows, or leave mimic out"
    )]
    MimicsItself { joint: usize },
    #[error(
        "joint {joint} takes no command that another joint could follow; name a commanded joint"
    )]
    LeaderNotCommanded { joint: u64 },
    #[error(
        "\"{name}\" cannot name a beam, because its parameters contain the name; leave out . * \
         [ ] and spaces"
    )]
    NotABeamName { name: String },
    #[error("\"{name}\" is the name of other parameters; choose another name")]
    ReservedName { name: String },
    #[error("another beam is called \"{name}\"; choose another name")]
    RepeatedBeamName { name: String },

    // The following errors concern points, anchors, surfaces and targets.
    #[error(
        "\"{name}\" cannot name {what}, because parameter names contain it; leave out . * [ ] \
         and spaces"
    )]
    NotAFixtureName { what: &'static str, name: String },
    #[error(
        "the rows name no target; each of them measures one of {}: add a column target",
        targets.join(", ")
    )]
    TargetsUnnamed { targets: Vec<String> },
    #[error("another {what} is called \"{name}\" (line {line}); choose another name")]
    RepeatedFixture { what: &'static str, name: String, line: usize },
    #[error(
        "no {what} is called \"{name}\"{}; {}",
        suggestion(name, known),
        fixtures_of(what, known)
    )]
    UnknownFixture { what: &'static str, name: String, known: Vec<String> },
    #[error(
        "the place of {parameter} is not declared, so it can neither be fixed nor have a prior; \
         write {write}"
    )]
    UnknownPlaceHeld { parameter: String, write: &'static str },
    #[error(
        "the place of the {what} \"{name}\" is not declared; declare it approximately: {write}"
    )]
    PlaceUnknown { what: &'static str, name: String, write: &'static str },
    #[error("a distance needs two different points, found {found}")]
    NotTwoPoints { found: usize },
    #[error(
        "the {what} \"{name}\" is measured by {rows} row{} only, which do not determine its \
         {numbers} unknown coordinates; \
         measure it again in other configurations, or declare where it is", plural(*rows)
    )]
    TooFewContacts { what: &'static str, name: String, rows: usize, numbers: usize },
    #[error("{has} without {lacks}; write both or neither")]
    IncompleteObservation { has: &'static str, lacks: &'static str },
    #[error("{word} is no point of the marker, whose points are numbered from 0 to {last}")]
    NoSuchPoint { word: String, last: usize },
    #[error(
        "the point is behind the camera; {}", behind_camera_remedy((*fits, *few), *miss, readings)
    )]
    PointBehindCamera { fits: Option<bool>, miss: Option<f64>, few: usize, readings: Vec<String> },
    #[error(
        "the points of the images of camera \"{camera}\" fit no pose of marker \"{marker}\": \
         {}, and by {:.1} px with {}",
        missed(px[0]), px[1], renumbered(*crossed)
    )]
    PointsRenumbered { camera: String, marker: String, px: [f64; 2], crossed: Option<[usize; 2]> },
    #[error(
        "the views do not determine the poses of camera \"{camera}\" and marker \"{marker}\": {why}; \
         add such views, or declare at_m and rotation_deg of one of them"
    )]
    ViewsUndecided { camera: String, marker: String, why: &'static str },
    #[error("nothing is measured in this row: every column that could hold something is empty")]
    NothingMeasured,
    #[error("the column has no meaning in this problem; declare {write}")]
    NotDeclared { write: &'static str },
    #[error("rows of several kinds need their standard deviations; write {write} in [data]")]
    NoSigmaOfKind { write: String },

    // The following errors concern effects.
    #[error(
        "an effect is one key, as in `gear-ratio = {{ joint = 2 }}`; found {found}{}",
        with_remedy(remedy.as_deref())
    )]
    NotOneEffect { found: usize, remedy: Option<String> },
    #[error("needs arguments; write {write}")]
    NeedsArguments { write: String },
    #[error("unknown effect{}; known: {}", suggestion(name, *known), known.join(", "))]
    UnknownEffect { name: String, known: &'static [&'static str] },
    #[error("no joint {joint}; the arm has {joints}, counted from 1")]
    UnknownJoint { joint: u64, joints: usize },
    #[error("no beam is called \"{link}\"; there {}", joined_list("is", links, "are none"))]
    UnknownLink { link: String, links: Vec<String> },
    #[error(
        "a joint cannot be coupled to itself; for an error of joint {joint} alone write gear-ratio"
    )]
    CoupledToItself { joint: usize },
    #[error(
        "\"{name}\" cannot name a covariate: it is a column name of flexcal, or contains one of \
         [ ] , * ?"
    )]
    NoCovariateName { name: String },
    #[error(
        "no covariate is called \"{name}\"; [data.covariates] {}",
        joined_list("has", known, "has none")
    )]
    UnknownCovariate { name: String, known: Vec<String> },
    #[error(
        "every row measures a fixed point (column nest) and none the arm; add rows of the arm \
         with an empty cell"
    )]
    NestsAlone,
    #[error("the row has no target position; contacts, distances and tilts cannot be commanded")]
    NoTarget,
    #[error("write either joint = … or base = true")]
    NotOnePlace,
    #[error("no order; write at least one, as in [1]")]
    NoOrders,
    #[error(
        "{order} is not a valid order; write a number of cycles per revolution above 0 and up \
         to {highest}"
    )]
    NotAnOrder { order: f64, highest: f64 },
    #[error("order {order} is listed twice; keep one")]
    RepeatedOrder { order: u32 },
    #[error("declared already on line {line}")]
    RepeatedEffect { line: usize },
    #[error("order {order} of this joint is declared already on line {line}")]
    RepeatedHarmonic { order: u32, line: usize },
    #[error(
        "joint {joint} is fixed and takes no command; leave the effect out, or free the joint's \
         geometric parameters"
    )]
    NoCommand { joint: usize },
    #[error("joint {joint} has no link that can bend, because its a is 0")]
    NoLink { joint: usize },
    #[error("joint {joint} carries no bodies with a mass; declare them as [[joint.body]]")]
    NoBodies { joint: usize },
    #[error("joint {joint} has no slide that can bend, because it is not prismatic")]
    NoSlide { joint: usize },
    #[error("joint {joint} does not rotate, because it is not revolute")]
    NotRevolute { joint: usize },
    #[error(
        "the end of a spring lies on the joint's axis, where its force has no moment; move the \
         point"
    )]
    OnTheAxis,
    #[error(
        "joint {joint} is rigid, so a compensator has no effect on it; give the joint its \
         stiffness_N_m_per_rad, or declare joint-compliance = {{ joint = {joint} }} too"
    )]
    NothingToRelieve { joint: usize },
    #[error("joint {joint} has a compensator already on line {line}")]
    RepeatedCompensator { joint: usize, line: usize },
    #[error("no beam has a hoist; add a section [joint.beam.hoist]")]
    NoHoist,
    #[error(
        "the loads already act on the deflected arm; with this effect write equilibrium = \
         \"undeflected\" in [statics]"
    )]
    InEquilibriumAlready,
    #[error("column {column} of the formula: {mistake}")]
    Formula { column: usize, mistake: String },
    #[error(
        "{formula} has no finite value in row {row} ({place}); keep arguments of log and sqrt \
         positive, and denominators away from 0"
    )]
    FormulaNotFinite { formula: String, row: usize, place: String },
    #[error("{reason}")]
    LawSite { reason: String },
    #[error("\"{name}\" cannot name {noun}; write a word of letters, digits and _")]
    NotAWord { name: String, noun: &'static str },
    #[error("no formula of this law uses {name}; leave it out, or write it into a term")]
    UnusedParameter { name: String },
    #[error("no formula; write at least one, as in [\"sin(q2)\"]")]
    NoTermsOfLaw,
    #[error("the start {start} lies outside of its bounds")]
    StartOutOfBounds { start: f64 },
    #[error("the measurements contain no information about this effect; they need {write}")]
    NeedsColumn { write: &'static str },

    // The following errors concern rules in [parameters].
    #[error("a name with dots needs quotes: \"{name}\" = {{ … }}")]
    UnquotedName { name: String },
    #[error("the rule is empty; write free = true, fixed = true, or a sigma, min or max")]
    EmptyRule,
    #[error("a fixed parameter has no other settings; leave out {other}")]
    FixedAndMore { other: String },
    #[error("{lower} is above {upper}")]
    LimitsCross { lower: String, upper: String },

    #[error(
        "the pattern matches no parameter of this arm{}; {}",
        pattern_suggestion(pattern, known),
        joined_list("they are", known, "it has none")
    )]
    MatchesNothing { pattern: String, known: Vec<String> },
    #[error("parameters are named by the number of the joint, not by its name; write \"{write}\"")]
    NamedByFrame { write: String },
    #[error(
        "the pattern matches no parameter of this arm; parameters of {effects} exist if an \
         [[effect]] declares it, \
         as in {write}"
    )]
    EffectNotDeclared { effects: String, write: String },
    #[error("{parameter} needs {suffixes}; add that, or write a separate rule for it")]
    QuantityMissing { parameter: String, suffixes: &'static str },
    #[error("{suffixes} does not apply to any parameter that the pattern matches; leave it out")]
    QuantityUseless { suffixes: &'static str },

    // The following errors concern constraints.
    #[error("a constraint may contain only angles, lengths, stiffnesses and rigidities")]
    NotConstrainable,
    #[error(
        "no terms; write the parameters and their coefficients, as in {{ \"A.EI\" = 1.0, \
         \"B.EI\" = -1.0 }}"
    )]
    NoTerms,
    #[error("a coefficient of 0 has no effect; leave the parameter out")]
    NoCoefficient,
    #[error("no limit; write at_least or at_most (with a unit for lengths and angles)")]
    NoLimit,
    #[error("no values satisfy this: the sum of the logarithms is at most {reach:.0} in size")]
    UnreachableLimit { reach: f64 },
    #[error(
        "no such parameter{}; {}",
        name_suggestion(name, known),
        joined_list("there are", known, "the arm has none")
    )]
    UnknownParameter { name: String, known: Vec<String> },
    #[error(
        "cannot be added to {other}; write separate constraints for angles, for lengths and for \
         logarithms of stiffnesses"
    )]
    MixedKinds { other: String },
    #[error("{parameter} takes {write}")]
    LimitOfAnotherKind { parameter: String, write: &'static str },
    #[error("no parameter is free, so there is nothing to identify; {write}")]
    NothingFree { write: &'static str },
    #[error(
        "none of its parameters is free; free one in [parameters], or leave the constraint out"
    )]
    NothingConstrained,

    #[error(
        "the nominal arm has no equilibrium under its loads here; check gravity, stiffnesses and \
         masses"
    )]
    NoEquilibrium,
    #[error(
        "the nominal arm has no equilibrium under its loads here; the mass of {name}, {mass} kg, is \
         {how}: check its unit (kg)"
    )]
    HeavyMass { name: String, mass: String, how: String },
    #[error(
        "the nominal arm has no equilibrium under its loads here; {joint} may be too soft: gravity \
         on the masses beyond it has a moment of up to {moment} N·m, which could turn it by up to {angle} \
         rad; {}",
        stiffness_units(angle)
    )]
    SoftJoint { joint: String, moment: String, angle: String },

    // The following errors concern the truth of a simulation.
    #[error("as large as the nominal value; write the deviation from nominal, not the value")]
    AbsoluteDeviation,
    #[error(
        "a range has two numbers, the lower one first; for a fixed value write [{value}, {value}]"
    )]
    OneNumber { value: f64 },
    #[error("a range has two numbers, the lower one first; found {found}")]
    NotARange { found: usize },
    #[error("no strength; write {write}")]
    NoStrength { write: String },
    #[error("the test rig always computes the equilibrium; write 1")]
    AlwaysInEquilibrium,
    #[error("needs temperatures; write {write}")]
    NeedsTemperature { write: &'static str },
    #[error(
        "the problem holds out session \"{session}\", and a simulation has no sessions; use \
         column or fraction"
    )]
    NoSessions { session: String },

    #[error(transparent)]
    Table(#[from] TableErrorKind),
    #[error(transparent)]
    Study(#[from] StudyErrorKind),
    #[error(transparent)]
    Urdf(#[from] UrdfErrorKind),

    // The following errors concern held-out rows.
    #[error(
        "give one of column, fraction (with seed) or session, as in held_out = {}, or held_out = \
         \"none\" to fit all rows",
        held_out_example(word.as_deref())
    )]
    NotOneHeldOut { word: Option<String> },
    #[error(
        "no held-out rows are declared; write held_out = {{ fraction = 0.3, seed = 1 }} in \
         [data], or add a column split"
    )]
    NoHeldOut,
    #[error("no rows are left to fit: {cause}")]
    NoIdentificationRows { cause: NoRows },
    #[error("no rows are held out: {cause}")]
    NoHeldOutRows { cause: NoRows },
    #[error(
        "no session is called \"{session}\"; there {}",
        joined_list("is", sessions, "is no column session")
    )]
    UnknownSession { session: String, sessions: Vec<String> },
}

impl InputErrorKind {
    /// Returns the input that a file was expected to be, from the error that it would have if it
    /// did not exist.
    pub(crate) fn expected_file(&self) -> &'static str {
        match self {
            Self::Urdf(_) => {
                "a URDF; export the arm as a URDF, or give the table of a data sheet as CSV with \
                 units in the header (theta_deg, d_mm, a_mm, alpha_deg) or as TOML \
                 (docs/own_arm.md, \"From a data sheet\")"
            }
            Self::TruthMissing => "a TRUTH.toml",
            Self::Study(_) => "a STUDY.toml",
            _ => "a problem.toml; PROBLEM is that file or its folder",
        }
    }
}
