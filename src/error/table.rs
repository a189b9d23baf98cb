//! Errors in tables of measurements.

use std::path::PathBuf;

use thiserror::Error;

use super::clock_offset::{ClockOffset, clock_offset_remedy};
use super::near::{did_you_mean, is_it_rather, suggestion};
use super::phrases::{
    column_difference, compared_keys, decimal_comma_remedy, in_quotes, missing_column_remedy,
    missing_date_hint, plural, with_remedy,
};
use super::warning::{listed, nearest_in_time_hint};

/// Declaration in `[data]` that joins a joint table to the measurements, for messages.
pub(crate) const JOINED: &str =
    "joints = { files = [\"…\"], by = \"name\" } (or \"order\" or \"time\")";

/// Kind of error in a table of measurements; [`Location`](super::Location) holds the place.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the message of each variant says what it stands for")]
pub enum TableErrorKind {
    #[error("no measurements; name them in `files`")]
    NoDataFiles,
    #[error("{} is named twice; its rows would count twice", path.display())]
    RepeatedFile { path: PathBuf },
    #[error(
        "several joints are called \"{name}\" ({}); give each a different name, or write {}",
        places.join(", "), write.join(" and ")
    )]
    SharedJointName { name: String, places: Vec<String>, write: Vec<String> },
    #[error("named twice on the command line; its rows would count twice")]
    GivenFileRepeated,
    #[error("the file is empty; it begins with a header line such as q1_deg,x_mm,y_mm,z_mm")]
    EmptyTable,
    #[error(
        "the pose {name} is already on line {line}, and a measured row asks for it; name each pose of \
         the joint table differently{}",
        if *timed { ", or pair by times if the measurements have them, too: by = \"time\"" } else { "" }
    )]
    RepeatedPose { name: String, line: usize, timed: bool },
    #[error(
        "no row of the measurements has a partner in the joint table{}{}{}",
        nearest_in_time_hint(gap.as_deref()),
        compared_keys(keys.as_ref()),
        if offset.is_some() {
            clock_offset_remedy(*offset)
        } else {
            "; check the column of the join (pose or time), whether both clocks agree, and \
             tolerance_s"
                .to_owned()
        }
    )]
    NothingJoined { gap: Option<String>, keys: Option<[String; 2]>, offset: Option<ClockOffset> },
    #[error(
        "{left} of {rows} measured rows have no partner in the joint table, because tolerance_s is \
         too small: the nearest row is typically {gap} away, and rows of the joint table are \
         {step} apart; write tolerance_s = {tolerance} in joints"
    )]
    ToleranceTooSmall { left: usize, rows: usize, gap: String, step: String, tolerance: String },
    #[error(
        "the times of the {table} are whole minutes, those of the other table are not: a \
         spreadsheet drops seconds; export the times with their seconds, or write by = \"order\" \
         if row by row both tables belong together"
    )]
    SecondsLost { table: &'static str },
    #[error(
        "{left} of {rows} measured rows have no partner in the joint table{}{}{}",
        nearest_in_time_hint(gap.as_deref()),
        compared_keys(keys.as_deref()),
        if offset.is_some() {
            clock_offset_remedy(*offset)
        } else {
            ", and no other offset of the clocks certainly pairs them; check whether both clocks \
             agree, offset_s and tolerance_s, and leave out rows that the joint table does not log"
                .to_owned()
        }
    )]
    MostUnpaired {
        left: usize,
        rows: usize,
        gap: Option<String>,
        keys: Option<Box<[String; 2]>>,
        offset: Option<ClockOffset>,
    },
    #[error(
        "{same} of {rows} measured rows have the same partner, {partner}, an end of the joint \
         table; check whether both clocks agree, and tolerance_s{}{}",
        compared_keys(keys.as_deref()),
        clock_offset_remedy(*offset)
    )]
    CommonPartner {
        same: usize,
        rows: usize,
        partner: String,
        keys: Option<Box<[String; 2]>>,
        offset: Option<ClockOffset>,
    },
    #[error(
        "the rows of both tables are typically {gap} apart, less than tolerance_s allows, and \
         may belong to different poses{}",
        clock_offset_remedy(Some(*offset))
    )]
    ClocksDiffer { gap: String, offset: ClockOffset },
    #[error(
        "the joint table has {logged} rows for {rows} measured rows, and by = \"order\" pairs the \
         first with the first, so that all pairs behind a row without a partner are wrong; write \
         by = \"time\" or by = \"name\", or keep one row for each measured row"
    )]
    OtherRowsToPair { logged: usize, rows: usize },
    #[error(
        "by = \"order\" pairs {} with {}, and most of these names occur in both tables; write by = \
         \"name\", or sort the tables alike",
        pair[0], pair[1]
    )]
    OrderContradicted { pair: [String; 2] },
    #[error(
        "{left} of {rows} measured rows have no partner of the same name in the joint table, but \
         most differ from one only in {difference}, as {} and {}; if these belong together, write \
         the names alike, or join the tables by time",
        pair[0], pair[1]
    )]
    NamesWrittenOtherwise { left: usize, rows: usize, difference: &'static str, pair: [String; 2] },
    #[error(
        "no held-out row measures a position, and pose accuracy is of positions: hold out rows \
         with x_mm, y_mm and z_mm, measured by \
         whatever is to judge the arm; identify reports the errors of \
         points in images, contacts, distances and tilts"
    )]
    NoPositionsHeldOut,
    #[error(
        "held_out = \"none\" holds out no pose that could judge the arm; write held_out = {{ fraction \
         = 0.3, seed = 1 }}"
    )]
    NothingHeldOut,
    #[error(
        "the identified arm has no equilibrium under the loads of this row{}; check the columns of \
         loads (payload_kg, hoist_N) and their units",
        if *others == 0 { String::new() } else { format!(" and of {others} more") }
    )]
    LoadsTooLarge { others: usize },
    #[error("no rows below the header")]
    NoRowsBelowHeader,
    #[error(
        "the table has poses and no measurement; {}",
        if *is_result {
            "residuals.csv is a result of identify: give the table of its measurements"
        } else {
            "measure these poses, then add the columns x_mm, y_mm and z_mm"
        }
    )]
    NotMeasured { is_result: bool },
    #[error("the words are commanded and read; another table of joints is {write}")]
    JointTable { write: String },
    #[error(
        "missing; add {write}, or, if another table holds the joints, write {JOINED} in [data]"
    )]
    NoJoints { write: String },
    #[error(
        "the columns are separated by {found:?}; write delimiter = \"{found}\" in [data.format]"
    )]
    OtherDelimiter { found: char },
    #[error("a decimal comma needs another delimiter than the comma; write delimiter = \";\"")]
    DecimalDelimiter,
    #[error(
        "numbers can begin with {mark:?} too, and their rows would be lost; write a mark that no \
         row begins with"
    )]
    CommentOfNumbers { mark: String },
    #[error(
        "{} has no such column{}; {}{}",
        file.display(),
        suggestion(name, known),
        in_quotes(known),
        with_remedy(remedy.as_deref())
    )]
    NoSuchColumn { file: PathBuf, name: String, known: Vec<String>, remedy: Option<String> },
    #[error(
        "{} has several columns with this name; select one by its place, as in \"#{place}\"",
        file.display()
    )]
    AmbiguousColumn { file: PathBuf, place: usize },
    #[error("the table has another column {name} and lacks {write}; is {write} meant here?")]
    MappedNameTaken { name: String, write: String },
    #[error(
        "the map is written theirs = ours, and \"{ours}\" is a name of flexcal; write \
         \"{theirs}\" = \"{ours}\""
    )]
    MapReversed { theirs: String, ours: String },
    #[error("not a column of flexcal{}", did_you_mean(meant.as_deref()))]
    UnknownMeaning { meant: Option<String> },
    #[error(
        "every row has the position that marks missing measurements; check missing in [data.format]"
    )]
    AllMissing,
    #[error(
        "no row depends on the arm: camera \"{camera}\" and marker \"{marker}\" both stand on \
         \"world\", as all cameras and markers of the rows do; declare the frame that carries \
         one of them, as in on = \"tool\""
    )]
    NothingMoves { camera: String, marker: String },
    #[error(
        "{rows} rows of different poses measure exactly 0, 0, 0, the first here{}; if the \
         instrument writes zeros for a lost target, write missing = \"{write}\" in [data.format]",
        listed(*rows, others)
    )]
    LostTargets { rows: usize, others: Vec<String>, write: String },
    #[error(
        "u and v are at most {largest} in all rows, as normalised image coordinates are: write pixels, \
         u_px = cx + fx u and v_px = cy + fy v, with the distortion applied"
    )]
    NormalisedPixels { largest: String },
    #[error(
        "all numbers of joints and positions are whole, up to {turns} turns and {metres} m: the \
         decimal points were lost, as by a spreadsheet of another locale; export the table again"
    )]
    DecimalsLost { turns: String, metres: String },
    #[error("{value} px is no place in an image; correct the row, or leave it out")]
    NoPlaceInImage { value: String },
    #[error(
        "qx, qy, qz, qw are not a rotation, because their squares do not add up to 1; check the \
         columns"
    )]
    NotAQuaternion,
    #[error(
        "orientations are to be fitted, and the measurements contain none; add rx_deg, ry_deg, \
         rz_deg or qx, qy, qz, qw"
    )]
    NoOrientation,
    #[error(
        "fitting orientations needs the standard deviation of positions; write \
         position_sigma_mm too, or a column sigma_mm"
    )]
    NoPositionSigma,
    #[error(
        "in \"{value}\" day and month may stand in either order; write the year first \
         (2024-05-31 14:03:20), day first with dots (31.05.2024), the month by name (31-May-2024), \
         or month first with AM or PM"
    )]
    AmbiguousDate { value: String },
    #[error(
        "the date of this time of day is empty in its column; write the date, or leave the row out"
    )]
    DateMissing,
    #[error(
        "\"{value}\" is neither a number nor a time such as 2024-05-31T14:03:20.5{}",
        missing_date_hint(value)
    )]
    NotATime { value: String },
    #[error(
        "\"{value}\" is not a number; if numbers have a decimal comma, write decimal = \",\" in \
         [data.format]"
    )]
    DecimalComma { value: String },
    #[error(
        "\"{value}\" is a text, not a number; if the numbers of a file have decimal commas, read it \
         so: pandas.read_csv(FILE, decimal=\",\")"
    )]
    TextInMemory { value: String },
    #[error(
        "\"{value}\" has a decimal point, and [data.format] says decimal = \",\"; write the \
         number with a comma and without \
         thousands separators, or correct decimal"
    )]
    DecimalPoint { value: String },
    #[error("missing; add {write}{}", missing_column_remedy(write, near.as_deref(), unknown))]
    MissingColumn { write: String, near: Option<String>, unknown: Vec<String> },
    #[error("unknown column, one letter away from {meant}; write {meant}, or a less similar name")]
    MistypedColumn { meant: String },
    #[error("given already as column {first}; keep one of the two")]
    RepeatedColumn { first: String },
    #[error(
        "{}; give every file the same columns (a column without values may be left out of all)",
        column_difference(other, *has)
    )]
    ColumnsDiffer { other: PathBuf, has: bool },
    #[error(
        "the name stands in the header twice, and {missing} is missing; if the second one is \
         {missing}, correct its name"
    )]
    RepeatedForAnother { missing: String },
    #[error("{found} values, and {expected} in the first column; each needs one value a row")]
    ColumnLength { expected: usize, found: usize },
    #[error(
        "the row has {found} fields, the header {expected}, and the file ends here without a \
         line end: it was probably cut off; copy or export it again, or remove this line"
    )]
    RowCut { expected: usize, found: usize },
    #[error("the row has {found} fields, the header {expected}{}", decimal_comma_remedy(*found, *expected))]
    RowLength { expected: usize, found: usize },
    #[error(
        "the row has {found} cells, the header {expected}, and the cells beyond the header are \
         empty: the row ends with a delimiter; remove it from the ends of the rows, or give the \
         header a name for the last column"
    )]
    TrailingDelimiter { expected: usize, found: usize },
    #[error(
        "the line begins with a word and has {found} cell{}, the header {expected}; if it is no row \
         of the table (the title or foot of a page, with a repeated header below), remove it",
        plural(*found)
    )]
    TextLine { expected: usize, found: usize },
    #[error("a quote is opened and not closed")]
    OpenQuote,
    #[error("the row is empty; delete it")]
    EmptyRow,
    #[error("the cell is empty; fill it in, or leave the row out")]
    EmptyCell,
    #[error("the cell is empty; write {write}")]
    EmptyWord { write: &'static str },
    #[error(
        "\"{value}\" is an error of a spreadsheet; correct its formula (or widen the column, if it \
         shows ####), or leave the row out"
    )]
    SpreadsheetError { value: String },
    #[error(
        "\"{value}\" {what}; write {write}{}",
        if *of_format { ", or change the number format of the column" } else { "" }
    )]
    OtherNotation { value: String, what: &'static str, write: String, of_format: bool },
    #[error(
        "none of the columns needed is here (the table has {}): is it another sheet or file? \
         Needed are {needed}",
        found.join(", ")
    )]
    NoneOfColumns { found: Vec<String>, needed: String },
    #[error(
        "the cells of this row are separated by {found:?}, those of the header by {header:?}; make \
         them alike"
    )]
    SeparatedOtherwise { found: char, header: char },
    #[error("\"{value}\" is {meant}")]
    NumberAsTime { value: String, meant: String },
    #[error(
        "the cell is empty; if nothing was measured here, write missing = \"\" in [data.format], \
         and such rows are left out"
    )]
    EmptyMeasurement,
    #[error(
        "\"{value}\" is not a number; if it stands for a point that was not measured, write \
         missing = \"{value}\" in [data.format], and such rows are left out"
    )]
    WordForMeasurement { value: String },
    #[error(
        "the row begins with \"{word}\" and has {empty} empty cells; if it is a summary and no \
         row of the table, remove it, or write comment = \"{word}\" in [data.format]; if it is a point that \
         the instrument measures without the arm, name the point in a column nest"
    )]
    SummaryRow { word: String, empty: usize },
    #[error(
        "\"{value}\" is a date that a spreadsheet made of a number; import the column as text, \
         and export the table again"
    )]
    SpreadsheetDate { value: String },
    #[error(
        "\"{value}\" has separators of thousands; write the number without them, as in 1874.383"
    )]
    ThousandsSeparator { value: String },
    #[error(
        "\"{value}\" is a number with a unit; remove {unit} from the cells, because the names of \
         the columns hold the units"
    )]
    NumberWithUnit { value: String, unit: String },
    #[error(
        "the header is repeated here; remove this line, or write the second table to a file of its \
         own and name both in `files`"
    )]
    HeaderRepeated,
    #[error(
        "the row begins with {mark}; if it is a comment, write comment = \"{mark}\" in \
         [data.format], otherwise it has {found} fields and the header {expected}"
    )]
    CommentRow { mark: &'static str, found: usize, expected: usize },
    #[error(
        "the first line holds numbers instead of the names of the columns; write a header line \
         above it, such as q1_deg,q2_deg,x_mm,y_mm,z_mm, or select the columns by their places in \
         [data.columns], as in {select}"
    )]
    NoHeader { select: &'static str },
    #[error("the numbers of joints in column names begin with 1; rename q0 to q1, q1 to q2, …")]
    JointsFromZero,
    #[error("\"{value}\" is not a number")]
    NotANumber { value: String },
    #[error("\"{value}\" is a sign without a number; write {value}1, or 0 for none")]
    SignAlone { value: String },
    #[error("\"{value}\" contains {found}; {remedy}")]
    Typographic { value: String, found: String, remedy: &'static str },
    #[error(
        "\"{value}\" is a unit, not a number; remove the line of units below the header, because \
         the names of the columns hold the units"
    )]
    UnitRow { value: String },
    #[error("{value} is not a direction; write -1, 0 or 1")]
    NotADirection { value: f64 },
    #[error(
        "\"{value}\" is not a direction; write 1 where the joint came from smaller values, -1 where \
         it came from larger ones, and 0 if that is not known"
    )]
    DirectionInWords { value: String },
    #[error("\"{value}\" has the exponent of Fortran; write {write}")]
    FortranExponent { value: String, write: String },
    #[error("\"{value}\" are degrees, minutes and seconds; write degrees with decimals: {write}")]
    Sexagesimal { value: String, write: String },
    #[error(
        "a table with bars, as in Markdown; remove the bars at both ends of the lines and the line \
         of dashes below the header, and write delimiter = \"|\" in [data.format]"
    )]
    MarkdownTable,
    #[error(
        "the table is transposed: its first column holds the names and each further one a pose; \
         transpose it, so that the first line is {first},…"
    )]
    Transposed { first: String },
    #[error(
        "the joints of the table are counted from 2 ({first} to {last}), those of the arm from 1; if \
         {first} is joint 1, rename each column to the number before"
    )]
    JointsFromTwo { first: String, last: String },
    #[error(
        "columns are missing: {}; if the table has them under other names, write in {section}: \
         {map}",
        missing.join(", ")
    )]
    MissingColumns { missing: Vec<String>, section: &'static str, map: String },
    #[error(
        "`files` and joints.files both name {}; `files` names what the instrument measured, \
         joints.files the table with the joint coordinates",
        path.display()
    )]
    JoinedWithItself { path: PathBuf },
    #[error(
        "\"{word}\" is neither identification nor validation, the two words of this column{}{}",
        is_it_rather("", *meant),
        if *is_session { "; to hold out a session write held_out = { session = \"…\" } with its name" } else { "" }
    )]
    UnknownSplit { word: String, meant: Option<&'static str>, is_session: bool },
}

impl TableErrorKind {
    /// Returns the offset of the clocks with which the rows of two tables have partners, if the error
    /// states one.
    pub(crate) fn clock_offset(&self) -> Option<ClockOffset> {
        match self {
            Self::NothingJoined { offset, .. }
            | Self::MostUnpaired { offset, .. }
            | Self::CommonPartner { offset, .. } => *offset,
            Self::ClocksDiffer { offset, .. } => Some(*offset),
            _ => None,
        }
    }
}
