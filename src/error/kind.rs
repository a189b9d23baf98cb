//! Kinds of input errors and their messages.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::near::{instead, meant, question};
use super::shortened;
use super::urdf::UrdfErrorKind;

/// Kind of an input error.
///
/// The message of each variant states the cause and the remedy. [`Location`](super::Location) holds
/// the place.
#[derive(Debug, Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the message of each variant says what it stands for")]
pub enum InputErrorKind {
    // Errors of files.
    #[error("no such file; give a problem.toml or the folder that holds one")]
    ProblemMissing,
    #[error(
        "no such file; give the TRUTH.toml that describes the simulation, or the folder that holds one"
    )]
    TruthMissing,
    #[error(
        "no such file; give a STUDY.toml or the folder that holds one; docs/study.md says how to write one"
    )]
    StudyMissing,
    #[error("no such file: {}; paths are relative to the study's folder", path.display())]
    StudyFileMissing { path: PathBuf },
    #[error(
        "a study draws and fits positions; this problem measures points, distances or surfaces: `simulate` and `identify` do"
    )]
    StudyOfContacts,
    #[error("no such file: {}; paths in `files` are relative to the problem's folder", path.display())]
    DataFileMissing { path: PathBuf },
    #[error("no such file; paths on the command line are relative to the current folder")]
    GivenFileMissing,
    #[error("cannot be read: {source}")]
    Unreadable { source: io::Error },
    #[error("larger than {most} MiB; is it the right file?")]
    FileTooLarge { most: u64 },
    #[error(
        "the line is longer than {most} KiB; is it a table with its rows on lines of their own?"
    )]
    LineTooLong { most: u64 },
    #[error("{found} {what}; at most {most}")]
    TooMany { what: &'static str, found: usize, most: usize },
    #[error("not UTF-8 text; save the file as UTF-8")]
    NotUtf8,
    #[error("the header is not UTF-8 text; save the file as UTF-8")]
    HeaderNotUtf8,
    #[error("UTF-16 text, by its byte-order mark; save the file as UTF-8")]
    Utf16,
    #[error("not valid TOML: {message}{}", near(near_text))]
    Syntax { message: String, near_text: String },

    // Errors of keys.
    #[error("unknown key{}; known here: {}", meant(key, known), known.join(", "))]
    UnknownKey { key: String, known: Vec<String> },
    #[error("missing; write {write}{}", instead("", near.as_deref()))]
    MissingKey { write: String, near: Option<String> },
    #[error("expected {expected}, found {found}")]
    WrongType { expected: &'static str, found: &'static str },
    #[error("{noun} needs a unit; write {write}")]
    NeedsUnit { noun: &'static str, write: String },
    #[error("{noun} is not given in {suffix}; write {write}")]
    WrongUnit { noun: &'static str, suffix: String, write: String },
    #[error("given already as {first}; keep one of the two")]
    GivenTwice { first: String },
    #[error("\"{word}\" is none of {}", known.join(", "))]
    UnknownWord { word: String, known: &'static [&'static str] },

    // Errors of values.
    #[error("{value} is not a finite number")]
    NotFinite { value: String },
    #[error("{value} is larger than 1e150, the largest number that can be reckoned with")]
    MagnitudeTooLarge { value: String },
    #[error(
        "holds a character that is not seen (U+{code:04X}: a control character, or a mark of writing direction); leave it out"
    )]
    Hidden { code: u32 },
    #[error("{value} is not a whole number of at least {least}")]
    NotWhole { value: String, least: u64 },
    #[error("{value} is too large; at most {most}")]
    TooLarge { value: u64, most: u64 },
    #[error("a vector has 3 numbers, found {found}")]
    NotAVector { found: usize },
    #[error("expected 2 numbers, found {found}")]
    NotAPair { found: usize },
    #[error("{value} is below zero")]
    Negative { value: f64 },
    #[error("{value} is not above zero")]
    NotPositive { value: f64 },
    #[error("{value} is not above zero; leave the key out where nothing gives way")]
    StiffnessNotPositive { value: f64 },
    #[error("{value} is not between 0 and 1")]
    NotAFraction { value: f64 },
    #[error("a direction has a length; [0, 0, 0] has none")]
    NoDirection,
    #[error("empty; write at least one character")]
    Empty,

    // Errors of the arm.
    #[error(
        "\"{name}\" cannot name a folder; leave out / \\ : * ? \" < > | and spaces or dots at either end"
    )]
    NotAFolderName { name: String },
    #[error("an arm has at least one joint; add a section [[joint]]")]
    NoJoints,
    #[error("a beam lies along its joint's a, which is 0 here; give a_m or a_mm")]
    BeamWithoutLength,
    #[error(
        "a beam lies along a before its joint; write the table in the modified form (without dh = \"standard\")"
    )]
    BeamInStandardForm,
    #[error(
        "a standard table has one chain and one tool, behind its last row; write it in the modified form (without dh = \"standard\")"
    )]
    NotInStandardForm,
    #[error("{what} takes one chain of joints; this arm is a tree")]
    NotAChain { what: &'static str },
    #[error(
        "{what} takes one tool behind the last joint; this arm has a [[target]], or its tool on another joint"
    )]
    NotOneTool { what: &'static str },
    #[error(
        "joint {joint} cannot stand on joint {parent}: list it behind the joint that it stands on"
    )]
    ParentListedLater { joint: usize, parent: u64 },
    #[error(
        "the branch of joint {parent} has ended; list everything that stands on a joint right behind it"
    )]
    BranchEnded { parent: u64 },
    #[error("a fixed joint follows no other; leave mimic out, or give the joint another kind")]
    FixedJointMimics,
    #[error("joint {joint} takes no command of its own that another could follow")]
    LeaderNotCommanded { joint: u64 },
    #[error("\"{name}\" cannot name a beam, for parameters go by it; leave out . * [ ] and spaces")]
    NotABeamName { name: String },
    #[error("\"{name}\" names other parameters; choose another name")]
    ReservedName { name: String },
    #[error("another beam is called \"{name}\"; choose another name")]
    RepeatedBeamName { name: String },

    // Errors of points, anchors, surfaces and targets.
    #[error("\"{name}\" cannot name {what}, for parameters go by it; leave out . * [ ] and spaces")]
    NotAFixtureName { what: &'static str, name: String },
    #[error("the rows name no target; each of them measures one of {}: add a column target", targets.join(", "))]
    TargetsUnnamed { targets: Vec<String> },
    #[error("another {what} is called \"{name}\" (line {line}); choose another name")]
    RepeatedFixture { what: &'static str, name: String, line: usize },
    #[error(
        "no {what} is called \"{name}\"{}; {}",
        meant(name, known),
        list("there are", known, "none is declared")
    )]
    UnknownFixture { what: &'static str, name: String, known: Vec<String> },
    #[error(
        "nobody knows where {parameter} is, so it can neither be held nor have a prior; write {write}"
    )]
    UnknownPlaceHeld { parameter: String, write: &'static str },
    #[error("nobody knows where the {what} \"{name}\" is; declare about where: {write}")]
    PlaceUnknown { what: &'static str, name: String, write: &'static str },
    #[error("a distance is between two different points, found {found}")]
    NotTwoPoints { found: usize },
    #[error(
        "the {what} \"{name}\" is measured by {rows} row{} alone, which says nothing: its own place takes {numbers} numbers; \
         measure it again in other configurations, or declare where it is", plural(*rows)
    )]
    TooFewContacts { what: &'static str, name: String, rows: usize, numbers: usize },
    #[error("{has} without {lacks}; write both or neither")]
    IncompleteObservation { has: &'static str, lacks: &'static str },
    #[error("nothing is measured in this row: every column that could hold something is empty")]
    NothingMeasured,
    #[error(
        "the column means nothing in this problem, which does not declare {write}; declare what the column speaks of"
    )]
    NotDeclared { write: &'static str },
    #[error("rows of several kinds are weighed against each other; write {write} in [data]")]
    NoSigmaOfKind { write: String },

    // Errors of effects.
    #[error("an effect is one key, as in `gear-ratio = {{ joint = 2 }}`; found {found}")]
    NotOneEffect { found: usize },
    #[error("needs arguments; write {write}")]
    NeedsArguments { write: String },
    #[error("unknown effect{}; known: {}", meant(name, *known), known.join(", "))]
    UnknownEffect { name: String, known: &'static [&'static str] },
    #[error("no joint {joint}; the arm has {joints}, counted from 1")]
    UnknownJoint { joint: u64, joints: usize },
    #[error("no beam is called \"{link}\"; there {}", list("is", links, "are none"))]
    UnknownLink { link: String, links: Vec<String> },
    #[error("a joint is coupled to another one; for joint {joint} alone write gear-ratio")]
    CoupledToItself { joint: usize },
    #[error(
        "\"{name}\" cannot name a covariate: it is one of flexcal's own columns, or holds one of [ ] , * ?"
    )]
    NoCovariateName { name: String },
    #[error(
        "no covariate is called \"{name}\"; [data.covariates] {}",
        list("has", known, "has none")
    )]
    UnknownCovariate { name: String, known: Vec<String> },
    #[error("every row names a fixed point in the column nest; none is of the arm")]
    NestsAlone,
    #[error("the row names no position to go to: contacts, distances and tilts are no targets")]
    NoTarget,
    #[error("write joint = … or base = true, one of them")]
    NotOnePlace,
    #[error("no order; write at least one, as in [1]")]
    NoOrders,
    #[error(
        "{order} is no order; write a number of cycles a revolution, above 0 and up to {highest}"
    )]
    NotAnOrder { order: f64, highest: f64 },
    #[error("order {order} stands twice")]
    RepeatedOrder { order: u32 },
    #[error("declared already on line {line}")]
    RepeatedEffect { line: usize },
    #[error("order {order} of this joint is declared already on line {line}")]
    RepeatedHarmonic { order: u32, line: usize },
    #[error(
        "joint {joint} is fixed and takes no command; leave the effect out, or free the joint's own parameters"
    )]
    NoCommand { joint: usize },
    #[error("joint {joint} has no link that could bend: its a is 0")]
    NoLink { joint: usize },
    #[error("joint {joint} has no slide that could bend: it is not prismatic")]
    NoSlide { joint: usize },
    #[error("joint {joint} does not turn: it is not revolute")]
    NotRevolute { joint: usize },
    #[error("the end of a spring lies on the joint's axis, where its pull has no moment")]
    OnTheAxis,
    #[error(
        "nothing gives way about the axis of joint {joint} that a compensator could relieve; give the joint its \
         stiffness_N_m_per_rad, or declare joint-compliance = {{ joint = {joint} }} too"
    )]
    NothingToRelieve { joint: usize },
    #[error("joint {joint} has a compensator already on line {line}")]
    RepeatedCompensator { joint: usize, line: usize },
    #[error("no beam has a hoist; add a section [joint.beam.hoist]")]
    NoHoist,
    #[error(
        "the loads act on the bent arm already; with this effect write equilibrium = \"undeflected\" in [statics]"
    )]
    InEquilibriumAlready,
    #[error("{name} enters where another parameter is already")]
    SiteOccupied { name: String },
    #[error(
        "{name} is driven, and only the coordinate of a moving joint and a shift of the measurement may be"
    )]
    RegressorNotAllowed { name: String },
    #[error("{name} enters where the arm has nothing")]
    SiteAbsent { name: String },
    #[error("the measurements cannot show this effect; they need {write}")]
    NeedsColumn { write: &'static str },

    // Errors of rules in [parameters].
    #[error("a name with dots stands in quotes: \"{name}\" = {{ … }}")]
    UnquotedName { name: String },
    #[error("says nothing; write free = true, fixed = true, or a sigma, min or max")]
    EmptyRule,
    #[error("a fixed parameter takes nothing else; leave out {other}")]
    FixedAndMore { other: String },
    #[error("{lower} is above {upper}")]
    LimitsCross { lower: String, upper: String },

    #[error(
        "the pattern matches no parameter of this arm{}; {}",
        meant(pattern, known),
        list("they are", known, "it has none")
    )]
    MatchesNothing { pattern: String, known: Vec<String> },
    #[error(
        "the pattern matches no parameter of this arm; those of {effects} are there once an [[effect]] declares it, \
         as in {write}"
    )]
    EffectNotDeclared { effects: String, write: String },
    #[error("{parameter} takes {suffixes}; give that too, or a rule of its own")]
    QuantityMissing { parameter: String, suffixes: &'static str },
    #[error("no parameter that the pattern matches takes {suffixes}; leave it out")]
    QuantityUseless { suffixes: &'static str },

    // Errors of constraints.
    #[error("a constraint speaks of angles, lengths, stiffnesses and rigidities only")]
    NotConstrainable,
    #[error(
        "no terms; write the parameters and their coefficients, as in {{ \"A.EI\" = 1.0, \"B.EI\" = -1.0 }}"
    )]
    NoTerms,
    #[error("a coefficient of 0 says nothing; leave the parameter out")]
    NoCoefficient,
    #[error("no limit; write at_least or at_most (with a unit for lengths and angles)")]
    NoLimit,
    #[error(
        "no such parameter{}; {}",
        meant(name, known),
        list("there are", known, "the arm has none")
    )]
    UnknownParameter { name: String, known: Vec<String> },
    #[error(
        "does not add up with {other}: angles, lengths and logarithms of stiffnesses go in constraints of their own"
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
        "the nominal arm has no equilibrium under its loads here; check stiffnesses and masses"
    )]
    NoEquilibrium,

    // Errors in the truth of a simulation.
    #[error(
        "a range is two numbers, the lower one first; for a fixed value write [{value}, {value}]"
    )]
    OneNumber { value: f64 },
    #[error("a range is two numbers, the lower one first; found {found}")]
    NotARange { found: usize },
    #[error("no strength; write {write}")]
    NoStrength { write: String },
    #[error("the test rig is always in equilibrium; write 1")]
    AlwaysInEquilibrium,
    #[error("needs temperatures; write {write}")]
    NeedsTemperature { write: &'static str },
    #[error(
        "the problem holds out session \"{session}\", and a simulation has no sessions; use column or fraction"
    )]
    NoSessions { session: String },

    // Errors of studies.
    #[error("stands in the list already")]
    Repeated,
    #[error("the list is empty; write at least one value")]
    EmptyList,
    #[error(
        "a study of misprints is done at once, with neither shares nor parts; leave out --shard and merge"
    )]
    NotOfFits,
    #[error("the study says how many poses there are; leave it out")]
    PosesOfStudy,
    #[error(
        "the model makes no measurements with effects that the problem does not declare; write data = \"rig\""
    )]
    NeedsRig,
    #[error(
        "{solver} does not keep the bounds and constraints of the problem; write bounded, interior-point or auto"
    )]
    SolverIgnoresBounds { solver: &'static str },
    #[error("no parameter of the kind that {strategy} varies is free in the problem; leave it out")]
    NothingToVary { strategy: &'static str },

    #[error(transparent)]
    Urdf(#[from] UrdfErrorKind),

    // Errors of held-out rows.
    #[error("give one of column, fraction (with seed) or session")]
    NotOneHeldOut,
    #[error(
        "no row is said to be held out; write held_out = {{ fraction = 0.3, seed = 1 }} in [data], or add a column split"
    )]
    NoHeldOut,
    #[error("no rows are left to fit: {cause}")]
    NoIdentificationRows { cause: NoRows },
    #[error("no rows are held out: {cause}")]
    NoHeldOutRows { cause: NoRows },
    #[error(
        "no held-out row measures a position, and pose accuracy is of positions: hold out rows with x_mm, y_mm and z_mm, measured by \
         whatever is to judge the arm; identify tells the errors of contacts, distances and tilts"
    )]
    NoPositionsHeldOut,
    #[error(
        "no session is called \"{session}\"; there {}",
        list("is", sessions, "is no column session")
    )]
    UnknownSession { session: String, sessions: Vec<String> },

    // Errors of measurement tables.
    #[error("no measurements; name them in `files`")]
    NoDataFiles,
    #[error("{} is named twice; its rows would count twice", path.display())]
    RepeatedFile { path: PathBuf },
    #[error("several joints are called \"{name}\"; write {}", write.join(" and "))]
    SharedJointName { name: String, write: Vec<String> },
    #[error("named twice on the command line; its rows would count twice")]
    GivenFileRepeated,
    #[error("the file is empty; it begins with a header line such as q1_deg,x_mm,y_mm,z_mm")]
    EmptyTable,
    #[error("no rows below the header")]
    NoRowsBelowHeader,
    #[error("an Excel workbook; save its sheet as CSV")]
    Workbook,
    #[error("columns are set apart by {found:?}; write delimiter = \"{found}\" in [data.format]")]
    OtherDelimiter { found: char },
    #[error("a decimal comma goes with another delimiter than a comma")]
    DecimalDelimiter,
    #[error("{} has no such column{}; {}", file.display(), meant(name, known), in_quotes(known))]
    NoSuchColumn { file: PathBuf, name: String, known: Vec<String> },
    #[error("{} has several columns of this name; say which by its place, as in \"#{place}\"", file.display())]
    AmbiguousColumn { file: PathBuf, place: usize },
    #[error(
        "the table has a column {name} of its own, and none that is {write}; is that meant here?"
    )]
    MappedNameTaken { name: String, write: String },
    #[error("not a column that flexcal knows{}", question(meant.as_deref()))]
    UnknownMeaning { meant: Option<String> },
    #[error("the position of every row is the one that stands for nothing measured")]
    AllMissing,
    #[error("qx, qy, qz, qw are no rotation: their squares do not add up to 1")]
    NotAQuaternion,
    #[error(
        "orientation is to be fitted, and the measurements hold none; add rx_deg, ry_deg, rz_deg or qx, qy, qz, qw"
    )]
    NoOrientation,
    #[error(
        "orientation is weighed against position; write position_sigma_mm too, or a column sigma_mm"
    )]
    NoPositionSigma,
    #[error("\"{value}\" is neither a number nor a time such as 2024-05-31T14:03:20.5")]
    NotATime { value: String },
    #[error(
        "\"{value}\" is not a number; where numbers have a decimal comma, write decimal = \",\" in [data.format]"
    )]
    DecimalComma { value: String },
    #[error("missing; add {write}{}", instead("column ", near.as_deref()))]
    MissingColumn { write: String, near: Option<String> },
    #[error(
        "not a column that is known; a letter off {meant}: write that, or a name that is not so near"
    )]
    MistypedColumn { meant: String },
    #[error("given already as column {first}; keep one of the two")]
    RepeatedColumn { first: String },
    #[error("{}; give every file the same columns", difference(other, *has))]
    ColumnsDiffer { other: PathBuf, has: bool },
    #[error("{found} values for {expected} rows")]
    ColumnLength { expected: usize, found: usize },
    #[error("the row has {found} fields, the header {expected}")]
    RowLength { expected: usize, found: usize },
    #[error("a quote is opened and never closed")]
    OpenQuote,
    #[error("the cell is empty")]
    EmptyCell,
    #[error("\"{value}\" is not a number")]
    NotANumber { value: String },
    #[error("{value} is not a direction; write -1, 0 or 1")]
    NotADirection { value: f64 },
    #[error("\"{word}\" is neither identification nor validation")]
    UnknownSplit { word: String },
}

/// Reason why one part of the split is empty.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[expect(missing_docs, reason = "the message of each variant says what it stands for")]
#[non_exhaustive]
pub enum NoRows {
    #[error("column {column} says {word} in every row")]
    Column { column: String, word: &'static str },
    #[error("every row is of session \"{session}\"")]
    Session { session: String },
    #[error(
        "the {rows} rows have {configurations} joint configurations, too few for fraction {fraction}"
    )]
    Fraction { rows: usize, configurations: usize, fraction: String },
}

/// Kind of a warning, with its cause and remedy as message.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the message of each variant says what it stands for")]
pub enum WarningKind {
    #[error("not a column that is known{}; ignored{}", question(meant.as_deref()), covariate(meant.as_deref()))]
    ColumnIgnored { meant: Option<String> },
    #[error("columns that [data.columns] does not name are ignored: {}", names.join(", "))]
    Unmapped { names: Vec<String> },
    #[error("nothing was measured in {rows} row{}, the first here: left out", plural(*rows))]
    RowsMissing { rows: usize },
    #[error(
        "orientations take no part in the search for effects: its fits and its evidence are of positions"
    )]
    OrientationLeftOut,
    #[error(
        "rows are marked in the column split, and held_out divides them otherwise; held_out = {{ column = \"split\" }} follows the marks"
    )]
    SplitUnused,
    #[error("joint {joint} takes no q; ignored")]
    JointIgnored { joint: usize },
    #[error("not a column that is known; ignored (write {write})")]
    UnitIgnored { write: String },
    #[error(
        "{value:?} is no date and time such as 2024-05-31T14:03:20.5; ignored, so that the order of the rows is the time (write {write} for \
         seconds)"
    )]
    NotADate { value: String, write: String },
    #[error("the same as {first} to the last digit{}; measurements do not repeat so exactly, and a copy counts twice", repeated_rows(*rows, others))]
    RowsRepeated { rows: usize, first: String, others: Vec<String> },
    #[error("the time goes back by {back} s from the row before{}; rows are taken in the order of their times", additional_rows(*rows))]
    TimeGoesBack { rows: usize, back: String },
    #[error(
        "commanded beyond its limits ({limits}) in {rows} row{}, furthest here: {worst}; used all the same", plural(*rows)
    )]
    BeyondLimits { rows: usize, worst: String, limits: String },
    #[error("{value} is {turns} turns; if these are degrees, the columns end in _deg")]
    ManyTurns { value: String, turns: String },
    #[error("all temperatures are {least} °C or more; if these are kelvins, take 273.15 off")]
    Kelvins { least: String },
    #[error(
        "{distance} m away from the last frame, and all links together are {links} m long; if these are millimetres, write target_mm"
    )]
    FarTarget { distance: String, links: String },
}

fn repeated_rows(rows: usize, named: &[String]) -> String {
    let (further, left) = (rows.saturating_sub(1), rows.saturating_sub(1 + named.len()));
    let left = if left > 0 { format!(" and {left} more") } else { String::new() };
    let named = named.join(", ");
    match further {
        0 => String::new(),
        1 => format!(", and 1 further row repeats another ({named})"),
        _ => format!(", and {further} further rows repeat others ({named}{left})"),
    }
}

fn additional_rows(rows: usize) -> String {
    if rows > 1 {
        format!(", and in {} further row{}", rows - 1, plural(rows - 1))
    } else {
        String::new()
    }
}

/// Returns the hint for a column that does not resemble a known one.
fn covariate(meant: Option<&str>) -> &'static str {
    if meant.is_none() { " (what may bear on the arm is named in [data.covariates])" } else { "" }
}

fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

fn near(text: &str) -> String {
    if text.is_empty() { String::new() } else { format!(", near `{text}`") }
}

fn difference(other: &Path, has: bool) -> String {
    let says = if has { "has it, this file does not" } else { "does not have it" };
    format!("{} {says}", other.display())
}

/// Returns names in quotes, as in `there are "a", "b"`.
fn in_quotes(names: &[String]) -> String {
    let names: Vec<String> =
        names.iter().map(|name| format!("\"{}\"", shortened(name, 40))).collect();
    list("there are", &names, "its header is empty")
}

fn list(verb: &str, names: &[String], none: &str) -> String {
    if names.is_empty() { none.to_owned() } else { format!("{verb} {}", names.join(", ")) }
}
