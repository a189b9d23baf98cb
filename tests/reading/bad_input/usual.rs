//! Usual mistakes of newcomers: the message names the cause and the remedy, not what follows.

use flexcal::error::{InputErrorKind, TableErrorKind, WarningKind};

use super::reading::{ARM, check};
use crate::common::arms::parse;
use crate::common::reading::{problem_error, table_error, try_poses, try_table};

/// Returns the kind and the line of the error of a table of the arm.
fn kind(problem: &str, table: &str) -> (TableErrorKind, Option<usize>) {
    let error = table_error(&parse(problem), table);
    let InputErrorKind::Table(kind) = *error.kind else { unreachable!("{}", error.kind) };
    (kind, error.location.line)
}

const ROWS: &str = "q1_deg,x_mm,y_mm,z_mm\n1,1,2,3\n";

#[test]
fn rows_without_a_measurement_name_the_way_to_leave_them_out() {
    let row = |text: &str| kind(ARM, &format!("{ROWS}{text}\n"));
    assert_eq!(row("1,1,,3"), (TableErrorKind::EmptyMeasurement, Some(3)));
    assert_eq!(row("1,---,2,3").0, TableErrorKind::WordForMeasurement { value: "---".to_owned() });
    assert_eq!(row("1,NaN,2,3").0, TableErrorKind::WordForMeasurement { value: "NaN".to_owned() });
    assert_eq!(row("1,1..2,2,3").0, TableErrorKind::NotANumber { value: "1..2".to_owned() });
    assert_eq!(row(",1,2,3").0, TableErrorKind::EmptyCell);
    let summary = TableErrorKind::SummaryRow { word: "Mean".to_owned(), empty: 2 };
    let table = "pose,q1_deg,x_mm,y_mm,z_mm,time_s\n1,1,1,2,3,4\nMean,,1,2,3,\n";
    assert_eq!(kind(ARM, table), (summary, Some(3)));
}

#[test]
fn delimiters_at_the_ends_of_rows_and_lines_of_text_are_named() {
    let trailing = TableErrorKind::TrailingDelimiter { expected: 4, found: 5 };
    assert_eq!(kind(ARM, "q1_deg,x_mm,y_mm,z_mm\n1,1,2,3,\n"), (trailing, Some(2)));
    let text = TableErrorKind::TextLine { expected: 4, found: 1 };
    assert_eq!(kind(ARM, &format!("{ROWS}Page 2 of 3\n")), (text, Some(3)));
    // A row that was cut off begins with a name and has numbers.
    let cut = kind(ARM, "pose,q1_deg,x_mm,y_mm,z_mm\nP,1,1,2,3\nP,1,1\n");
    assert_eq!(cut.0, TableErrorKind::RowLength { expected: 5, found: 3 });
}

#[test]
fn a_header_in_the_middle_hides_no_rows_above_it() {
    let table = format!("// Export\n// {ROWS}1,2,2,3\n\n{ROWS}");
    assert_eq!(kind(ARM, &table), (TableErrorKind::HeaderRepeated, Some(6)));
    // Above the only header there may be a line of names behind a mark.
    let table = format!("// q1_deg,x_mm,y_mm,z_mm\n{ROWS}");
    assert_eq!(try_table(&parse(ARM), &table).unwrap().0.len(), 1);
}

#[test]
fn a_name_that_stands_twice_is_the_missing_one() {
    let missing = |name: &str| TableErrorKind::RepeatedForAnother { missing: name.to_owned() };
    assert_eq!(kind(ARM, "q1_deg,x_mm,y_mm,y_mm\n1,1,2,3\n").0, missing("z_mm"));
    let two = format!("{ARM}[[joint]]\n");
    assert_eq!(kind(&two, "q1_deg,q1_deg,x_mm,y_mm,z_mm\n1,1,1,2,3\n").0, missing("q2_deg"));
    let one = kind(ARM, "q1_deg,q1_deg,x_mm,y_mm,z_mm\n1,1,1,2,3\n").0;
    assert!(matches!(one, TableErrorKind::RepeatedColumn { .. }), "{one}");
}

#[test]
fn a_map_written_the_other_way_round_is_named_at_its_line() {
    let map =
        format!("{ARM}[data.columns]\n'J1' = 'q1_deg'\n'x_mm' = 'X'\n'Y' = 'y_mm'\n'Z' = 'z_mm'\n");
    let (kind, line) = kind(&map, "J1,X,Y,Z\n1,1,2,3\n");
    let reversed = TableErrorKind::MapReversed { theirs: "X".to_owned(), ours: "x_mm".to_owned() };
    assert_eq!((kind, line), (reversed, Some(5)));
    let map = format!("{ARM}[data.columns]\n'X' = 'x_mm'\n");
    let error = try_poses(&parse(&map), "x_mm,y_mm,z_mm\n1,2,3\n").unwrap_err();
    check(&error, "targets", &["rows.csv:1: column q1: missing; add q1_deg or q1_rad"]);
}

#[test]
fn dates_of_spreadsheets_are_no_numbers() {
    for cell in ["18. Mrz", "Mar-18", "1-May"] {
        let date = TableErrorKind::SpreadsheetDate { value: cell.to_owned() };
        assert_eq!(kind(ARM, &format!("{ROWS}1,{cell},2,3\n")).0, date);
    }
}

#[test]
fn keys_in_wrong_company_are_named_as_such() {
    for (text, words) in [
        (
            "name = 'a'\n[[joints]]\n[[joint.body]]\nmass_kg = 1\n",
            "2: joints: unknown key (did you mean joint?)",
        ),
        ("name = 'a'\n[[joint]]\nmin_mm = 0\n", "or kind = \"prismatic\" if the joint slides"),
        ("name = 'a'\n[[joint]]\nkind = 'prismatic'\nmax_deg = 9\n", "or kind = \"revolute\""),
        (
            "name = 'a'\n[[joint]]\n[base]\nrpy_deg = [0, 0, 0]\nrotation_deg = [0, 0, 0]\n",
            "5: base.rotation_deg: given already as rpy_deg",
        ),
        (
            "name = 'a'\n[[joint]]\n[base]\nxyz_m = [0, 0, 0]\nrotation_deg = [0, 0, 0]\n",
            "beside them is rpy_deg or rpy_rad",
        ),
        (
            "name = 'a'\n[[joint]]\n[[joint]]\nmimic = { joint = 2 }\nmin_deg = 1\n",
            "joint 2 cannot follow itself",
        ),
        (
            "name = 'a'\n[[joint]]\n[[joint]]\nmimic = { joint = 1 }\nmin_deg = 1\n",
            "5: joint[2].min_deg: does not belong here: joint 2 follows another joint",
        ),
        (
            "name = 'a'\n[[joint]]\n[[joint]]\nkind = 'fixed'\nxyz_m = [0, 0, 1]\na_m = 1\n",
            "joint 2 is placed by xyz_m and rpy_deg",
        ),
        (
            "name = 'a'\nrobust = 'huber'\n[[joint]]\n",
            "write the line [robust] and below it loss = \"huber\"",
        ),
        ("name = 'a'\n[joint]\na_m = 1\n[joint]\na_m = 1\n", "as in [[joint]], the first one too"),
        (
            "name = 'a'\n[[joint]]\n[parameters]\nfiles = ['rows.csv']\n",
            "parameters.files: does not belong here: [parameters] holds names of parameters",
        ),
    ] {
        check(&problem_error(text), text, &["problem.toml:", words]);
    }
}

#[test]
fn conditions_and_loads_in_other_units_are_asked_about() {
    let warned = |text: &str| {
        let warnings = parse(text).plausibility_warnings();
        warnings
            .into_iter()
            .map(|warning| (warning.location.line, warning.kind))
            .collect::<Vec<_>>()
    };
    let gravity = |value: &str| warned(&format!("gravity_m_s2 = [0, 0, {value}]\n{ARM}"));
    assert_eq!(gravity("-1.62"), []);
    for (value, is_unit) in [("-1", true), ("-9806.65", false)] {
        let size = value.trim_start_matches('-').to_owned();
        assert_eq!(gravity(value), [(Some(1), WarningKind::UnusualGravity { size, is_unit })]);
    }
    let hot = WarningKind::HotReference { value: "293.15".to_owned() };
    let text = format!("{ARM}[data]\nreference_temperature_C = 293.15\n");
    assert_eq!(warned(&text), [(Some(4), hot)]);
    let elastic = |stiffness: &str, bending: &str| {
        warned(&format!(
            "{ARM}[[joint]]\nalpha_deg = 90\nstiffness_N_m_per_rad = {stiffness}\n[[joint]]\na_m = 0.7\n\
             [joint.beam]\nname = 'tube'\nmass_kg = 1\nEA_N = 1.6e7\nEIy_N_m2 = {bending}\n\
             [[joint.body]]\nmass_kg = 2\n"
        ))
    };
    assert_eq!(elastic("9e3", "2.4e3"), []);
    let stiff = elastic("9e3", "2.4e9");
    assert!(matches!(stiff.as_slice(), [(Some(6), WarningKind::StiffBeam { .. })]), "{stiff:?}");
}

#[test]
fn payloads_sessions_and_targets_that_are_no_measurements_are_asked_about() {
    let body = format!("{ARM}[[joint.body]]\nmass_kg = 30\n");
    let warned = |column: &str, cell: &dyn Fn(usize) -> String| {
        let rows = (0..12).map(|row| format!("{row},1,2,3,{}\n", cell(row)));
        let table = format!("q1_deg,x_mm,y_mm,z_mm,{column}\n{}", rows.collect::<String>());
        let warnings = try_table(&parse(&body), &table).unwrap().1;
        warnings.into_iter().map(|warning| warning.kind).collect::<Vec<_>>()
    };
    assert_eq!(warned("payload_kg", &|row| row.to_string()), []);
    let heavy = warned("payload_kg", &|row| (500 * row).to_string());
    assert!(matches!(heavy.as_slice(), [WarningKind::HeavyPayload { arm: Some(_), .. }]));
    assert_eq!(warned("session", &|row| (row % 2).to_string()), []);
    let each = warned("session", &|row| format!("s{row}"));
    assert_eq!(each, [WarningKind::SessionPerRow { rows: 12 }]);
    let repeats = |second: &str| {
        let table = format!("pose,{ROWS}").replace("\n1", "\nP1,1") + second + "\n";
        try_table(&parse(ARM), &table).unwrap().1.len()
    };
    assert_eq!(
        [repeats("P1,1,1.2,2,3"), repeats("P2,1,900,2,3"), repeats("P1,1,900,2,3")],
        [0, 0, 1]
    );
    let commands = warned("reached,miss_mm", &|_| "true,0".to_owned());
    assert!(commands.contains(&WarningKind::TargetsAsMeasurements), "{commands:?}");
}

#[test]
fn a_rule_that_a_later_rule_replaces_is_named() {
    let warned = |rules: &str| {
        let text = format!("name = 'arm'\n[[joint]]\na_m = 1\n[parameters]\n{rules}\n");
        let warnings = parse(&text).plausibility_warnings();
        warnings
            .into_iter()
            .map(|warning| (warning.location.line, warning.kind))
            .collect::<Vec<_>>()
    };
    let [one, all] =
        ["'joint1.theta' = { fixed = true }", "'joint*.*' = { sigma_deg = 1, sigma_mm = 1 }"];
    assert_eq!(warned(&format!("{all}\n{one}")), []);
    let kind = WarningKind::RuleOverridden { by: "joint*.*".to_owned(), line: 6 };
    assert_eq!(warned(&format!("{one}\n{all}")), [(Some(5), kind)]);
}

#[test]
fn limits_in_another_unit_are_asked_about() {
    let arm = parse(&format!("{ARM}min_rad = -140\nmax_rad = 3\n"));
    let (turns, write) = ("22".to_owned(), "min_deg".to_owned());
    let expected = WarningKind::AngleLooksLikeDegrees { what: "a limit", turns, write };
    let kinds: Vec<_> = arm.plausibility_warnings().into_iter().map(|of| of.kind).collect();
    assert_eq!(kinds, [expected]);
    let long = parse(&format!("{ARM}kind = 'prismatic'\nmax_m = 500\n"));
    let words = long.plausibility_warnings().iter().map(ToString::to_string).collect::<Vec<_>>();
    assert!(words[0].contains("joint[1].max_m: 500 m is long"), "{words:?}");
    let rail = format!("{ARM}kind = 'prismatic'\nmin_m = 0\nmax_m = 6\n");
    let said = |arm: &str, unit: &str, most: f64| {
        let row = |k: u32| format!("{},{k},2,3\n", most * f64::from(k) / 11.0);
        let rows: String = (0..12).map(row).collect();
        let table = format!("q1_{unit},x_mm,y_mm,z_mm\n{rows}");
        let (_, warnings) = try_table(&parse(arm), &table).unwrap();
        warnings.iter().map(|of| of.kind.to_string()).collect::<Vec<_>>().join("; ")
    };
    let free = format!("{ARM}kind = 'prismatic'\n");
    for (arm, unit, most, words) in [
        (&free, "m", 450.0, "column is 450 m, much for this joint; if they are in millimetres"),
        (&rail, "mm", 4.5, "column is 4.5 mm, little for this joint; if they are in metres"),
    ] {
        assert!(said(arm, unit, most).contains(words), "{}", said(arm, unit, most));
    }
    for (arm, unit, most) in [(&free, "m", 4.5), (&free, "mm", 0.5), (&rail, "mm", 4500.0)] {
        assert!(!said(arm, unit, most).contains("for this joint"), "{unit}");
    }
    for (command, expected) in [("5994.3", Some("999 times the limit")), ("6.3", None)] {
        let table = format!("q1_m,x_mm,y_mm,z_mm\n{command},1,2,3\n");
        let (_, warnings) = try_table(&parse(&rail), &table).unwrap();
        let hint = warnings.iter().find_map(|warning| match &warning.kind {
            WarningKind::BeyondLimits { other_unit, .. } => Some(other_unit.as_deref()),
            _ => None,
        });
        assert_eq!(
            hint.unwrap().map(|hint| hint.starts_with(expected.unwrap())),
            expected.map(|_| true)
        );
    }
}
