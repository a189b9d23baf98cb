//! Kinds of warnings and their messages.

use std::path::PathBuf;

use thiserror::Error;

use super::near::did_you_mean;
use super::phrases::{
    additional_rows, and_more, covariate_hint, further_rows, image_remedy, plural, repeated_rows,
};

/// Kind of a warning, with its cause and remedy as message.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the message of each variant says what it stands for")]
pub enum WarningKind {
    #[error(
        "unknown column{}; ignored{}",
        did_you_mean(meant.as_deref()), covariate_hint(meant.as_deref(), *is_angle)
    )]
    ColumnIgnored { meant: Option<String>, is_angle: bool },
    #[error(
        "unknown columns; ignored (name in [data.covariates] those that the arm may depend on): {}{}",
        names.join(", "), and_more(*more)
    )]
    ColumnsIgnored { names: Vec<String>, more: usize },
    #[error(
        "the row of {missing} seems to be missing before {before}: the arm is taken to have {joints} \
         joints; add it, or number the rows without a gap"
    )]
    JointLeftOut { missing: String, before: String, joints: usize },
    #[error(
        "no positions are read, though unknown columns seem to be x, y and z: to read them, write \
         {map} in {section}"
    )]
    PositionsNotRead { section: &'static str, map: String },
    #[error(
        "no column of {} has a name of [data.columns]; the table is read by flexcal's names",
        file.display()
    )]
    MapUnused { file: PathBuf },
    #[error(
        "these measurements are paired row by row with the joint table {}; if that is of other \
         measurements, name theirs with --joints",
        file.display()
    )]
    JointTableKept { file: PathBuf },
    #[error("columns that [data.columns] does not name are ignored: {}", names.join(", "))]
    Unmapped { names: Vec<String> },
    #[error(
        "{rows} row{} without a partner in the other table, the first here{}; left out{}{}{}",
        plural(*rows), listed(*rows, others), nearest_in_time_hint(gap.as_deref()),
        match (gap, tolerance) {
            (Some(_), Some(tolerance)) => format!("; tolerance_s = {tolerance} would pair them too"),
            (Some(_), None) => "; check whether both clocks agree, and tolerance_s".to_owned(),
            (None, _) => String::new(),
        },
        spelling_hint(alike.as_ref())
    )]
    WithoutPartner {
        rows: usize,
        others: Vec<String>,
        gap: Option<String>,
        tolerance: Option<String>,
        alike: Option<(usize, [String; 2])>,
    },
    #[error(
        "no column states from which side joints come to a pose, so the motions of this joint table \
         do: at {stops} unmeasured stop{} between measured poses joints turn; columns approach1 … \
         would replace these directions",
        plural(*stops)
    )]
    ApproachesTaken { stops: usize },
    #[error("changed since flexcal wrote it; used all the same")]
    FileChanged,
    #[error("not UTF-8 text; read as Windows-1252 (Latin-1), so check accented letters and signs")]
    ReadAsWindows1252,
    #[error(
        "the file may end inside this row: its last number has fewer digits than those of all other rows, \
         and no line end follows; if the file was cut, save or copy it again"
    )]
    FileCut,
    #[error("{rows} row{} without a measurement, the first here; left out", plural(*rows))]
    RowsMissing { rows: usize },
    #[error(
        "measures exactly 0, 0, 0; if the instrument writes zeros for a lost target, write missing \
         = \"{write}\" in [data.format]"
    )]
    PositionZero { write: String },
    #[error(
        "{value} mm lies {far} m from the middle of the rows, beyond the reach of the arm{}; \
         correct the number{hint}",
        more_rows(*rows)
    )]
    BeyondReach { value: String, far: String, hint: &'static str, rows: usize },
    #[error(
        "{value} px is outside the image of the camera \"{camera}\", image_px = [{}, {}]; {}, \
         which plans and exports use{}",
        image[0], image[1], image_remedy(image, *is_exchanged), more_rows(*rows)
    )]
    OutsideImage {
        value: String,
        camera: String,
        image: [String; 2],
        is_exchanged: bool,
        rows: usize,
    },
    #[error(
        "pixels of the camera \"{camera}\" reach {}, {}, but its centre_px is that of images of \
         {} × {} pixels: if its intrinsics were found at another resolution, multiply focal_px and \
         centre_px by the ratio of the resolutions",
        pixel[0], pixel[1], image[0], image[1]
    )]
    OtherResolution { camera: String, pixel: [String; 2], image: [String; 2] },
    #[error("the search for effects uses positions only, not orientations")]
    OrientationLeftOut,
    #[error(
        "rows are marked in the column split, but held_out selects others; held_out = {{ column \
         = \"split\" }} follows the marks"
    )]
    SplitUnused,
    #[error(
        "the rule has no effect, because \"{by}\" (line {line}) is a later rule for the same \
         parameters; write the more general rule first"
    )]
    RuleOverridden { by: String, line: usize },
    #[error(
        "joint {joint} {}; the joints that move are {}: {}",
        if joint > declared { "is not declared, so the column is ignored" } else { "is fixed, so the column is ignored" },
        moving.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "),
        if joint > declared { "if the arm has one more, a [[joint]] is missing" } else { "if the arm has one more, it is declared as fixed" }
    )]
    JointIgnored { joint: usize, declared: usize, moving: Vec<usize> },
    #[error("unknown column; ignored (write {write})")]
    UnitIgnored { write: String },
    #[error(
        "holds dates and times and is ignored; \"{name}\" = \"time\" in [data.columns] reads them, and \
         effects that depend on time can be found"
    )]
    DatesIgnored { name: String },
    #[error(
        "{rows} row{} pair with the joint table if their clock is set {by} by {hours}, as if summer \
         time began or ended between the rows; correct the times of these rows",
        plural(*rows)
    )]
    ClockJump { rows: usize, hours: String, by: &'static str },
    #[error(
        "the arm moved, by the joint table, at the time of {rows} of {of} measured row{} that have \
         a partner, the first here{}; {}",
        plural(*of), listed(*rows, others),
        offset.as_ref().map_or_else(
            || "check offset_s, and the times of these rows".to_owned(),
            |offset| format!("with offset_s = {offset} in joints it rests then")
        )
    )]
    MovedAtTime { rows: usize, of: usize, others: Vec<String>, offset: Option<String> },
    #[error(
        "{value:?} is not a date and time such as 2024-05-31T14:03:20.5; ignored, and rows \
         count in their order instead (write {write} for \
         seconds)"
    )]
    NotADate { value: String, write: String },
    #[error("{value} is read {order}, as {read}; if that is wrong, write dates as YYYY-MM-DD")]
    DateOrderAssumed { value: String, read: String, order: &'static str },
    #[error(
        "its clock differs from that of the measurements: rows are paired with {offset}, \
         with which they agree; check that both tables are of one measurement"
    )]
    ClockOffsetFound { offset: String },
    #[error(
        "equal to {first} in all digits{}; measurements do not repeat so exactly, and a copied \
         row counts twice: leave the copies out",
        repeated_rows(*rows, others)
    )]
    RowsRepeated { rows: usize, first: String, others: Vec<String> },
    #[error(
        "equal in all digits to {first} of another session (\"{}\" here, \"{}\" there){}; a \
         measurement that is given twice counts twice",
        sessions[0], sessions[1], repeated_rows(*rows, others)
    )]
    RowsOfAnotherSession { rows: usize, sessions: [String; 2], first: String, others: Vec<String> },
    #[error(
        "the same joint angles as {first}, and the same position but for digits below {step} \
         mm{}; one measurement with two numbers of digits counts twice, and standard errors come \
         out too small: keep one of the two",
        repeated_rows(*rows, others)
    )]
    RowsRounded { rows: usize, first: String, step: String, others: Vec<String> },
    #[error(
        "measures the position of {before} in all digits at other joint angles{}; the instrument \
         probably held its last value: remove such rows, or measure them again",
        further_rows(*rows, others)
    )]
    PositionHeld { before: String, rows: usize, others: Vec<String> },
    #[error(
        "\"{name}\" ({rows} row{}) differs from \"{other}\" in case, spaces or hyphens only, and is \
         read as another session with a base of its own; write both alike",
        plural(*rows)
    )]
    SessionsAlike { name: String, other: String, rows: usize },
    #[error(
        "the time falls by {back} s here{} ({}); rows are used in the order of their times",
        additional_rows(*rows),
        match (*is_midnight, *rows) {
            (true, 1) => "through midnight? add 86400 s from this row on",
            (true, _) => "through midnight? add 86400 s from this row on, and as much again from each further one",
            (false, _) => "two series?",
        }
    )]
    TimeGoesBack { rows: usize, back: String, is_midnight: bool },
    #[error(
        "commanded beyond its limits ({limits}) in {rows} row{}, furthest here: {worst}{}; used all the same", plural(*rows),
        other_unit.as_ref().map_or_else(String::new, |unit| format!(", {unit}"))
    )]
    BeyondLimits { rows: usize, worst: String, limits: String, other_unit: Option<String> },
    #[error(
        "{value} looks like radians of {degrees}°, and the key means degrees; write {radians} = \
         {value}, or {degrees} here"
    )]
    LooksLikeRadians { value: String, degrees: String, radians: String },
    #[error(
        "{value} m is long for a part of an arm; if these are millimetres, write {millimetres} \
         = {value}"
    )]
    LooksLikeMillimetres { value: String, millimetres: String },
    #[error(
        "the table has the zeros of standard DH (α of the first row is set, α and a of the last \
         are 0) and is read as \
         modified DH; write dh = \"standard\" or dh = \"modified\" before the first [[joint]]"
    )]
    LooksLikeStandardForm,
    #[error("{value} is {turns} turns; if these are degrees, the columns end in _deg")]
    ManyTurns { value: String, turns: String },
    #[error(
        "{value} s is after the year 5000; if these are milliseconds, divide them by 1000, because \
         time_s means seconds"
    )]
    LooksLikeMilliseconds { value: String },
    #[error(
        "the rows are typically {step} s apart; if these are milliseconds, divide the times by 1000, \
         because time_s means seconds"
    )]
    LongSteps { step: String },
    #[error("all temperatures are {least} °C or more; if these are kelvins, subtract 273.15")]
    Kelvins { least: String },
    #[error(
        "{value} °C is unusual for an arm; check the unit, and whether the column holds another \
         quantity"
    )]
    UnusualTemperature { value: String },
    #[error(
        "{value} in {rows} row{}{}, while all others are {} to {}: a logger writes such a number where it has no \
         reading; leave these rows out, or write what was measured",
        plural(*rows), listed(*rows, others), range[0], range[1]
    )]
    NoReading { value: String, rows: usize, others: Vec<String>, range: [String; 2] },
    #[error(
        "all positions are multiples of {step} mm; such rounding errs by {rounding} mm (1 σ), far \
         more than the declared σ of {sigma} mm: export them with more digits"
    )]
    PositionsRounded { step: String, rounding: String, sigma: String },
    #[error(
        "all temperatures are {least} °C or more, which is hot for an arm; if these are degrees \
         Fahrenheit, convert them: °C = (°F − 32) / 1.8"
    )]
    Fahrenheit { least: String },
    #[error(
        "the hoist forces are usually {usual} N, and [joint.beam.hoist] declares {declared} N; if \
         the column holds kilograms, multiply it by 9.80665"
    )]
    HoistInKilograms { usual: String, declared: String },
    #[error(
        "the hoist pulls downwards, along gravity, but a hoist relieves an arm; check the signs of \
         its direction and of the gravity, both in the base frame"
    )]
    HoistPullsDown,
    #[error(
        "no joint turns by more than {widest}° from zero, and this row turns it most; if the \
         columns are in radians or turns, let their names end in _rad or convert them"
    )]
    FewDegrees { widest: String },
    #[error(
        "the largest number of the column is {value}, {size} for this joint; if they are in {unit}, let \
         its name end in {suffix}"
    )]
    SlideInOtherUnit { value: String, size: &'static str, unit: &'static str, suffix: &'static str },
    #[error(
        "{rows} rows are paired by order with rows of other times, the first here: {partner} was \
         {gap} s off, and another row is nearer; write by = \"time\", or check whether a row is \
         missing or the tables are sorted differently"
    )]
    OrderContradictedByTimes { rows: usize, partner: String, gap: String },
    #[error("{value} °C is hot for a reference temperature; if it is in kelvins, subtract 273.15")]
    HotReference { value: String },
    #[error(
        "no joint turns by more than {widest}° from zero; if the limits are radians, write min_rad \
         and max_rad instead of min_deg and max_deg"
    )]
    LimitsLookLikeRadians { widest: String },
    #[error("{what} of {turns} turns; if it is in degrees, write {write}")]
    AngleLooksLikeDegrees { what: &'static str, turns: String, write: String },
    #[error("columns not taken: {names}; taken: {taken}, of theta, alpha, d, a, min, max")]
    SheetColumns { names: String, taken: String },
    #[error(
        "no length is above {longest} mm; if they are in metres, write d_m and a_m in the header"
    )]
    SheetInMetres { longest: String },
    #[error(
        "a focal length of {focal} px is short for an image that is {width} px wide; if it is in \
         millimetres, divide it by the size of a pixel in millimetres"
    )]
    ShortFocalLength { focal: String, width: String },
    #[error("{mass} kg is heavy for a part of an arm; if these are grams, divide by 1000")]
    LooksLikeGrams { mass: String },
    #[error(
        "{mass} kg is a heavy payload for this arm{}; if these are grams, divide by 1000",
        declared_mass_hint(arm.as_deref())
    )]
    HeavyPayload { mass: String, arm: Option<String> },
    #[error(
        "a gravity of {size} m/s² is {}; the standard value is 9.80665 m/s²",
        if *is_unit { "a direction without a size" } else { "large (is it in mm/s²?)" }
    )]
    UnusualGravity { size: String, is_unit: bool },
    #[error(
        "gravity is 0, so that no weight acts on the joints and links that give way; leave the key \
         out for 9.80665 m/s² downwards"
    )]
    NoGravity,
    #[error(
        "the reference is {distance} K beyond all temperatures of the table ({least} °C to {most} °C), so \
         that parameters at the reference are extrapolated; {}",
        celsius.as_ref().map_or("check the reference".to_owned(), |celsius| {
            format!("if it is in degrees Fahrenheit, write {celsius}")
        })
    )]
    FarReference { celsius: Option<String>, distance: String, least: String, most: String },
    #[error(
        "the columns approach1, approach2, … hold 0 and 1 alone; 0 is an unknown direction, and −1 one \
         from larger values"
    )]
    ApproachWithoutSign,
    #[error(
        "this σ is of positions, and no row measures one, so that no σ is declared; the rows of this \
         table have {write}"
    )]
    SigmaUnused { write: String },
    #[error(
        "{term:?} multiplies an angle by {factor} in a function of angles; q1, q2, … are in \
         radians already"
    )]
    AngleConverted { term: String, factor: String },
    #[error(
        "the radius of gyration √(EI/EA) would be {radius} m, more than the {length} m of the \
         beam; if the bending stiffness is in N·mm², divide it by 1e6"
    )]
    StiffBeam { radius: String, length: String },
    #[error(
        "measured {distance} mm from {first}, which has the same pose and joint angles; one of the \
         two is probably the point of another pose"
    )]
    SamePoseElsewhere { first: String, distance: String },
    #[error(
        "each of the {rows} rows has a session of its own, so nothing is common to two rows; a \
         session is a setting-up of the instrument or arm: leave the column out if it holds times \
         or names of rows"
    )]
    SessionPerRow { rows: usize },
    #[error(
        "each of the {rows} rows has a target of its own, which is fitted by itself; a target is a point of \
         the tool: leave the column out, or name it pose if it names the poses"
    )]
    TargetPerRow { rows: usize },
    #[error(
        "[{}, {}] is far from the middle of image_px = [{}, {}], and near it if one of them is \
         exchanged: write centre_px = [{}, {}], or image_px = [{}, {}] if that is width, height",
        centre[0], centre[1], image[0], image[1], centre[1], centre[0], image[1], image[0]
    )]
    CentreExchanged { centre: [String; 2], image: [String; 2] },
    #[error(
        "the table has the columns reached and miss_mm of commands.csv, whose positions are \
         targets and not measurements; put what the instrument measured into x_mm, y_mm and z_mm, \
         and remove these two columns"
    )]
    TargetsAsMeasurements,
    #[error(
        "the centre of mass is {distance} m from the frame of its joint; if these are \
         millimetres, write com_mm"
    )]
    FarBody { distance: String },
    #[error(
        "{distance} m from the last frame, while all links together are {links} m long; if \
         these are millimetres, write {write}"
    )]
    FarTarget { distance: String, links: String, write: &'static str },
    #[error(
        "the table has no such column, so that the arm carries {mass} kg in every row, although the \
         problem declares where a payload hangs; add the column, or remove payload_at"
    )]
    NoPayloadColumn { mass: String },
    #[error(
        "{length} m is far beyond the arm, whose links together are {links} m long; if these are \
         millimetres, write {write}"
    )]
    FarFixture { length: String, links: String, write: String },
    #[error("the points of the marker lie within {size} mm; if they are in metres, write points_m")]
    TinyMarker { size: String },
    #[error(
        "no distance is longer than {longest} mm, while the links of the arm are together {links} m \
         long; if these are metres, name the column distance_m"
    )]
    ShortDistances { longest: String, links: String },
    #[error(
        "{other} is usually {here}, near the {declared} that the problem declares for {name}, and \
         {name} is usually {usual}: the names of the two columns are probably exchanged"
    )]
    ColumnsExchanged { name: String, usual: String, declared: String, other: String, here: String },
    #[error(
        "the payloads divided by 9.80665 are round numbers ({newtons} N is {kilograms} kg); if the \
         column holds newtons, write kilograms"
    )]
    PayloadInNewtons { newtons: String, kilograms: String },
}

impl WarningKind {
    /// Returns true if a column of the table probably holds another unit, or no readings, so that
    /// results from the table are wrong.
    #[doc(hidden)]
    pub const fn doubts_table(&self) -> bool {
        matches!(
            self,
            Self::Kelvins { .. }
                | Self::PositionsNotRead { .. }
                | Self::Fahrenheit { .. }
                | Self::FewDegrees { .. }
                | Self::SlideInOtherUnit { .. }
                | Self::ManyTurns { .. }
                | Self::NoReading { .. }
        )
    }

    /// Returns true if the table has no column of payloads although the problem says where one hangs.
    #[doc(hidden)]
    pub const fn lacks_loads(&self) -> bool {
        matches!(self, Self::NoPayloadColumn { .. })
    }

    /// Returns true if no arm can have been in a state that the table states.
    #[doc(hidden)]
    pub const fn refutes_table(&self) -> bool {
        matches!(self, Self::Kelvins { .. } | Self::BeyondReach { .. })
    }
}

fn declared_mass_hint(arm: Option<&str>) -> String {
    arm.map_or_else(String::new, |arm| format!(", whose declared masses add up to {arm} kg"))
}

/// Returns the remedy for rows without a partner whose names differ from one only in spelling:
/// their number, and the first pair of names. Empty for `None`.
fn spelling_hint(alike: Option<&(usize, [String; 2])>) -> String {
    alike.map_or_else(String::new, |(rows, [name, other])| {
        let differ = if *rows == 1 { "differs" } else { "differ" };
        format!(
            "; {rows} of them {differ} from a partner only in spelling, as {name} and {other}: \
             write the names alike"
        )
    })
}

/// Returns a hint for rows without a partner within the tolerance of a join by time. `gap` is their
/// usual distance in words; the hint is empty for `None`.
pub(super) fn nearest_in_time_hint(gap: Option<&str>) -> String {
    gap.map_or_else(String::new, |gap| {
        format!(" (the nearest row of the joint table is typically {gap} away)")
    })
}

/// Returns the names of rows after the first one, to which a warning points. `rows` counts all
/// rows, the first included.
pub(super) fn listed(rows: usize, others: &[String]) -> String {
    let left = rows.saturating_sub(1 + others.len());
    let left = and_more(left);
    if others.is_empty() { String::new() } else { format!(", then {}{left}", others.join(", ")) }
}

/// Returns a clause that counts the rows which a warning concerns; empty for a single one.
fn more_rows(rows: usize) -> String {
    if rows > 1 { format!(" (the first of {rows} rows)") } else { String::new() }
}
