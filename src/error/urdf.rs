//! Errors in a URDF, and contradictions between a URDF and a problem.

use thiserror::Error;

use super::near::suggestion;
use super::phrases::and_more;

/// Kind of error in a URDF; [`Location`](super::Location) holds the place.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum UrdfErrorKind {
    #[error("no such file; give a URDF")]
    Missing,
    #[error("the column has no unit; write {write} in the header")]
    SheetUnit { write: String },
    #[error(
        "{found} is no unit of this column; write {write} in the header, and convert the \
         numbers{factor}"
    )]
    SheetOtherUnit { found: String, write: String, factor: String },
    #[error("the table has no column of the twist angle α; add alpha_deg")]
    SheetWithoutAlpha,
    #[error("another column states {key} in this row, too; keep one of the two")]
    SheetTwice { key: &'static str },
    #[error("\"{cell}\" is not a number, nor a coordinate with its constant part such as q2 - 90")]
    SheetCell { cell: String },
    #[error(
        "the row \"{name}\" is no joint; leave it out, and declare what it says in [base] or [tool] of the \
         problem"
    )]
    SheetEnd { name: String },
    #[error(
        "no table of Denavit-Hartenberg parameters: it has no columns such as theta_deg, d_mm, \
         a_mm, alpha_deg"
    )]
    SheetWithoutParameters,
    #[error("not valid XML: {message}")]
    Syntax { message: String },
    #[error("<{element}> is not closed; write </{name}> before </{before}> on line {line}")]
    NotClosed { element: String, name: String, before: String, line: usize },
    #[error(
        "contains a document type declaration, which is refused because it may expand without \
         limit; remove it"
    )]
    DocumentType,
    #[error("not a URDF: its outermost element is <{found}>, not <robot>{}", conversion(found))]
    NotARobot { found: String },
    #[error("<origin> has both rpy and quat_xyzw; keep one of the two")]
    TwoRotations,
    #[error("quat_xyzw \"{text}\" is not a rotation, because its squares do not add up to 1")]
    NotAQuaternion { text: String },
    #[error("a xacro file, not a URDF; expand it first: xacro FILE.xacro > FILE.urdf")]
    Xacro,
    #[error("<{element}> has no attribute {attribute}")]
    NoAttribute { element: String, attribute: &'static str },
    #[error("<joint> has no element <{element}>")]
    NoElement { element: &'static str },
    #[error("the name is empty or contains an invisible character")]
    BadName,
    #[error("another {what} is called \"{name}\"")]
    Repeated { what: &'static str, name: String },
    #[error(
        "\"{text}\" is not {count} finite number{}{}",
        if *count == 1 { "" } else { "s" },
        written_numbers(text, *count)
    )]
    NotNumbers { text: String, count: usize },
    #[error("the file ends within <{element}: it was cut off; get the whole file again")]
    Truncated { element: String },
    #[error("a mass of {text} kg is negative")]
    NegativeMass { text: String },
    #[error("the axis has no direction; write one, such as xyz=\"0 0 1\"")]
    NoAxis,
    #[error(
        "a joint of type \"{kind}\" is not supported{}; supported types: revolute, continuous, \
         prismatic, fixed; choose a chain without it with --base and --tip",
        suggestion(kind, ["revolute", "continuous", "prismatic", "fixed"])
    )]
    Kind { kind: String },
    #[error(
        "no link is called \"{name}\"{}; the links are {}",
        joint_or_suggestion(name, child.as_deref(), known),
        listed(known)
    )]
    NoLink { name: String, known: Vec<String>, child: Option<String> },
    #[error("--tip {name} is given twice; leave one of them out")]
    RepeatedTip { name: String },
    #[error("no joint is called \"{name}\"{}", suggestion(name, known))]
    NoJoint { name: String, known: Vec<String> },
    #[error("the joints follow each other in a cycle of <mimic>")]
    MimicCircle,
    #[error(
        "link \"{link}\" is the child of two joints, \"{first}\" and \"{second}\"; a URDF is a tree"
    )]
    TwoParents { link: String, first: String, second: String },
    #[error("the joints form a loop through link \"{link}\"; a URDF is a tree")]
    Loop { link: String },
    #[error("cannot be converted to a problem: {key}: {why}")]
    AsProblem { key: String, why: String },
    #[error("there are no links; is it an SRDF, whose URDF is another file?")]
    NoLinks,
    #[error("several links have no parent: {}; choose one with --base", listed(roots))]
    Roots { roots: Vec<String> },
    #[error(
        "several links end the tree below \"{base}\": {}; choose one with --tip{}",
        listed(leaves),
        fork.as_ref().map_or_else(String::new, |link| format!(", or {link}, which carries all of them"))
    )]
    Leaves { base: String, leaves: Vec<String>, fork: Option<String> },
    #[error("link \"{tip}\" is not below link \"{base}\", but above it; exchange --base and --tip")]
    EndsExchanged { base: String, tip: String },
    #[error(
        "link \"{tip}\" is not below link \"{base}\"; {}",
        if above.is_empty() {
            "it is the root".to_owned()
        } else {
            format!(
                "above it are {}; for two branches of one trunk write --tip {base} --tip {tip}",
                above.join(", ")
            )
        }
    )]
    NotBelow { base: String, tip: String, above: Vec<String> },
    #[error(
        "no link is called \"{link}\", as [urdf] in problem \"{problem}\" says; give the URDF of which flexcal init made \
         the problem: this one is of robot \"{robot}\""
    )]
    OtherRobot { link: String, problem: String, robot: String },
    #[error(
        "no joint moves between \"{base}\" and \"{tip}\"{}",
        match (base == tip, ends.is_empty(), *links) {
            (true, true, 1) => "; the file holds this link alone: take that of the arm".to_owned(),
            (true, true, _) => "; base and tip are one link: name another one".to_owned(),
            (true, false, _) => format!("; name a link farther out as --tip: {}", ends.join(", ")),
            (false, ..) => String::new(),
        }
    )]
    NothingMoves { base: String, tip: String, ends: Vec<String>, links: usize },
    #[error("the chain has {found} joints; at most {most}")]
    TooManyJoints { found: usize, most: usize },
    #[error(
        "the URDF moves joints {} between \"{base}\" and \"{tip}\", the problem {}; give the \
         URDF of which flexcal init made the problem",
        found.join(", "), expected.join(", ")
    )]
    OtherJoints { base: String, tip: String, found: Vec<String>, expected: Vec<String> },
    #[error(
        "the nominal arm of the problem differs from the URDF at joint \"{joint}\" by {off}; was the \
         problem made from this file? If the file is a calibrated URDF, give the original"
    )]
    OtherArm { joint: String, off: String },
    #[error(
        "no joint after \"{joint}\" has an origin that can hold the identified transform after \
         it ({off}); add a fixed joint behind it to the URDF, and make the problem anew: flexcal init \
         with the link of that joint as --tip"
    )]
    NoRoom { joint: String, off: String },
    #[error(
        "not an arm with the joint layout of Universal Robots: {why}; --format mdh or dh writes \
         the table of any arm, ros-yaml the offsets for ROS, and --urdf ARM.urdf a URDF"
    )]
    NotUr { why: String },
}

/// Returns instructions for converting a file with this outermost element to a URDF.
fn conversion(found: &str) -> &'static str {
    match found {
        "mujoco" => {
            "; a MuJoCo model (MJCF): convert it first, for example with the Python package \
             mjcf-urdf-simple-converter"
        }
        "sdf" => "; an SDFormat model (SDF): convert it first, for example with sdf2urdf of pysdf",
        "launch" => {
            "; a launch file: give the URDF that it names (a xacro has to be expanded first)"
        }
        "COLLADA" => "; a mesh (COLLADA): give the URDF that refers to it",
        _ => "",
    }
}

/// Returns the link of the joint that is called `name`, if there is one, or else the most similar
/// name.
fn joint_or_suggestion(name: &str, child: Option<&str>, known: &[String]) -> String {
    match child {
        Some(child) => format!(" (that is a joint; its link is {child})"),
        None => suggestion(name, known),
    }
}

/// Maximum number of names in a list.
const MAX_LISTED_NAMES: usize = 30;

/// Returns names separated by commas, and the number of further names if there are more than
/// [`MAX_LISTED_NAMES`].
fn listed(names: &[String]) -> String {
    let more = and_more(names.len().saturating_sub(MAX_LISTED_NAMES));
    names.iter().take(MAX_LISTED_NAMES).map(String::as_str).collect::<Vec<_>>().join(", ") + &more
}

/// Returns the numbers of an attribute as a URDF has them, if only their separators, brackets or
/// decimal commas differ; otherwise an empty text.
fn written_numbers(text: &str, count: usize) -> String {
    let plain = text.replace(['[', ']', '(', ')', '{', '}'], " ");
    let numbers = |text: &str| {
        let words: Vec<&str> = text.split_whitespace().collect();
        let are_numbers = words.iter().all(|word| word.parse::<f64>().is_ok_and(f64::is_finite));
        (words.len() == count && are_numbers).then(|| words.join(" "))
    };
    let spaced = numbers(&plain.replace([',', ';'], " "));
    if let Some(numbers) = spaced {
        return format!("; separate numbers by spaces alone: \"{numbers}\"");
    }
    if let Some(numbers) = numbers(&plain.replace(',', ".")) {
        return format!("; write decimal points: \"{numbers}\"");
    }
    let is_unit = |c: char| c.is_alphabetic() || c == '°';
    let words: Vec<&str> =
        plain.split_whitespace().map(|word| word.trim_end_matches(is_unit)).collect();
    let have_units = words.join(" ") != plain && numbers(&words.join(" ")).is_some();
    if have_units { "; write metres and radians, without units".to_owned() } else { String::new() }
}
