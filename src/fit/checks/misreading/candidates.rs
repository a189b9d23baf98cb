//! Candidates: the misreadings that a problem and the columns of its table allow.

use super::commands::{of_commands, of_joint_units};
use super::entries::{MIN_MILLIMETRE_LENGTH, lengths_of, of_joint_table};
use super::loads::of_loads;
use super::{Kind, Misreading, counted, power_of_ten};
use crate::fit::checks::row_kind::AXES;
use crate::measurement::Measurements;
use crate::problem::{Effect, ParameterRule, Problem};

/// Units of positions that are taken for millimetres: length \[mm\] and name.
pub(in crate::fit) const POSITION_UNITS: [(f64, &str); 7] = [
    (25.4, "inches"),
    (10.0, "centimetres"),
    (1e-3, "micrometres"),
    (0.1, "tenths of a millimetre"),
    (0.01, "hundredths of a millimetre"),
    (100.0, "decimetres"),
    (304.8, "feet"),
];
/// Trial ratios of one coordinate of the positions to the two others, in millionths.
const TRIAL_RATIOS: [u32; 8] =
    [800_000, 900_000, 950_000, 980_000, 1_020_000, 1_050_000, 1_100_000, 1_250_000];
/// Trial ratios of the measured lengths to those of the arm, in hundredths. A full fit finds values
/// between them.
const TRIAL_SCALES: [i16; 8] = [80, 90, 95, 98, 102, 105, 110, 125];
/// Number of joints before and after the declared carrier of a target, camera or marker that are
/// tried as its carrier.
pub(super) const MAX_OTHER_CARRIERS: usize = 2;
/// Maximum number of rows by which positions are tried as shifted, in either direction.
const MAX_SHIFT: i8 = 3;
/// Number of rows, evenly spaced, at which a trial shift of positions begins.
const SHIFT_PLACES: usize = 12;

/// Returns every misreading that the problem and its table allow.
pub(super) fn candidates(problem: &Problem, table: &Measurements) -> Vec<Misreading> {
    let mut units = of_joint_units(problem, table);
    units.extend(of_units(table));
    units.extend(of_table_units());
    units.extend(of_axes(table));
    let inverse = "poses that are inverse (of the measuring frame in the frame of the target; invert \
                   each 4 × 4 matrix)";
    let inverse = Misreading::of_rows(inverse, |rows| {
        let turns = rows.orientations.iter_mut().flatten();
        for (position, turn) in rows.positions.iter_mut().zip(turns) {
            *turn = turn.inverse();
            *position = -(*turn * *position);
        }
    });
    units.extend(table.orientations.is_some().then_some(inverse));
    let target = "a target of [tool] that is in millimetres, declared in metres";
    let target = Misreading::of_problem(target, |problem| {
        shrink_target(problem);
        Some(())
    });
    units.extend(is_far(problem).then_some(target));
    units.extend(arm_in_millimetres(problem));
    units.extend(of_commands(problem));
    units.extend(of_order(table));
    units.extend(of_whole_order(table));
    units.extend(of_joint_table(problem));
    units.extend(of_loads(problem, table));
    units.extend(of_targets(problem));
    units
}

/// Returns the misreadings of joint columns and joint table alone.
pub(super) fn of_arm(problem: &Problem, table: &Measurements) -> Vec<Misreading> {
    let mut misreadings = of_joint_units(problem, table);
    misreadings.extend(of_table_units());
    misreadings.extend(arm_in_millimetres(problem));
    misreadings.extend(of_commands(problem));
    misreadings.extend(of_joint_table(problem));
    misreadings
}

/// Returns the misreading that long lengths of joints are in millimetres, declared in metres, with
/// the target; `None` if all are short.
fn arm_in_millimetres(problem: &Problem) -> Option<Misreading> {
    let words = "lengths of joints that are in millimetres, declared in metres";
    let is_long = |length: &f64| length.abs() > MIN_MILLIMETRE_LENGTH;
    let mut lengths = problem.joints.iter().cloned();
    let has_long = lengths.any(|mut joint| lengths_of(&mut joint).iter().any(|of| is_long(of)));
    let misreading = Misreading::of_problem(words, move |problem| {
        let lengths = problem.joints.iter_mut().flat_map(lengths_of);
        lengths.filter(|length| is_long(length)).for_each(|length| *length *= 1e-3);
        shrink_target(problem);
        Some(())
    });
    has_long.then_some(misreading)
}

/// Returns true if the columns of positions were read in metres, or in millimetres if `metres` is
/// false. Returns true for both if the unit is not known.
fn are_in(table: &Measurements, metres: bool) -> bool {
    table.position_unit.is_none_or(|unit| (unit >= 1.0) == metres)
}

/// Returns the misreadings of the unit of all positions.
fn of_units(table: &Measurements) -> Vec<Misreading> {
    let unit = |words: &str, factor: f64, kind: fn(f64) -> Kind| {
        let words = format!("positions that are {words}");
        Misreading::of_positions(words, move |at| *at *= factor).of_kind(kind(factor))
    };
    let mut units = Vec::new();
    if are_in(table, false) {
        units.push(unit("metres, declared as millimetres", 1e3, Kind::UsualUnit));
    }
    if are_in(table, true) {
        units.push(unit("millimetres, declared as metres", 1e-3, Kind::UsualUnit));
    }
    for (factor, name) in POSITION_UNITS.into_iter().filter(|_| are_in(table, false)) {
        // Where the declared unit is not known, micrometres are millimetres taken for metres.
        if !are_in(table, true) || name != "micrometres" {
            let kind = if name == "inches" { Kind::UsualUnit } else { Kind::Unit };
            units.push(unit(&format!("{name}, declared as millimetres"), factor, kind));
        }
    }
    units
}

/// Returns the misreadings of the unit of all lengths of the joint table.
fn of_table_units() -> impl Iterator<Item = Misreading> {
    // No sheet states lengths of an arm in micrometres.
    let units = POSITION_UNITS.into_iter().filter(|(_, name)| *name != "micrometres");
    let units = units.flat_map(|unit| [(unit, true), (unit, false)]);
    units.map(|((factor, name), has_targets)| {
        let targets = if has_targets { " and of the target" } else { "" };
        let words = format!(
            "lengths of the joint table{targets} that are in {name}, declared as millimetres \
             (multiply them by {factor})"
        );
        let of_table = Misreading::of_problem(words, move |problem| {
            let lengths = problem.joints.iter_mut().flat_map(lengths_of);
            lengths.for_each(|length| *length *= factor);
            if has_targets {
                problem.tool.target *= factor;
                problem.targets.iter_mut().for_each(|target| target.at *= factor);
            }
            Some(())
        });
        of_table.in_group("unit of the joint table")
    })
}

/// Returns the misreadings of the axes of positions, and of the scale of all.
fn of_axes(table: &Measurements) -> Vec<Misreading> {
    let of_axis = |words: String, axis: usize, factor: f64| {
        Misreading::of_positions(words, move |position| position[axis] *= factor)
    };
    let in_millimetres = are_in(table, false);
    let powers = if in_millimetres {
        [(3, "metres", "millimetres"), (1, "centimetres", "millimetres")]
    } else {
        [(-3, "millimetres", "metres"), (-2, "centimetres", "metres")]
    };
    let mut units = Vec::new();
    for (axis, name) in AXES.into_iter().enumerate() {
        units.extend(powers.map(|(power, found, declared)| {
            let words = format!("{name} alone that is in {found}, declared in {declared}");
            of_axis(words, axis, power_of_ten(power)).in_group(format!("unit of {name}"))
        }));
    }
    for (axis, name) in AXES.into_iter().enumerate().filter(|_| in_millimetres) {
        let words = format!("{name} alone that is in inches, declared in millimetres");
        units.push(of_axis(words, axis, POSITION_UNITS[0].0));
    }
    let ratios = |axis| TRIAL_RATIOS.map(|millionths| Misreading::of_axis_scale(axis, millionths));
    units.extend((0..3).flat_map(ratios));
    units.push(Misreading::mirrored(None));
    units.extend(TRIAL_SCALES.map(Misreading::of_scale));
    units
}

/// Returns the misreadings of targets: a target on the frame of another joint near the declared
/// one, and two exchanged targets.
fn of_targets(problem: &Problem) -> Vec<Misreading> {
    let carriers: Vec<usize> = if problem.targets.is_empty() {
        vec![problem.tool.joint]
    } else {
        problem.targets.iter().map(|target| target.joint).collect()
    };
    let name = |target: usize| problem.targets.get(target).map(|of| of.name.clone());
    let mut misreadings = Vec::new();
    for (target, &carrier) in carriers.iter().enumerate() {
        let others = carrier.saturating_sub(MAX_OTHER_CARRIERS)..=carrier + MAX_OTHER_CARRIERS;
        let others = others.filter(|&joint| joint != carrier && joint < problem.joints.len());
        misreadings.extend(others.map(|joint| {
            let frame = format!("on the frame of joint {0} (joint = {0})", joint + 1);
            let located = name(target).map(|name| format!("the target \"{name}\" {frame}"));
            let correct = move |problem: &mut Problem| {
                match problem.targets.get_mut(target) {
                    Some(target) => target.joint = joint,
                    None => problem.tool.joint = joint,
                }
                Some(())
            };
            Misreading::of_problem(format!("the target {frame}"), correct).located(located)
        }));
        for with in target + 1..problem.targets.len() {
            let names = [target, with].map(|target| name(target).unwrap_or_default());
            let located = format!(
                "the words \"{}\" and \"{}\" exchanged in the column target",
                names[0], names[1]
            );
            let exchanged = Misreading::of_rows("two targets that are exchanged", move |rows| {
                let Some(words) = &mut rows.target else { return };
                let place = |name: &String| words.names.iter().position(|word| word == name);
                if let (Some(first), Some(second)) = (place(&names[0]), place(&names[1])) {
                    for word in &mut words.of_row {
                        *word = match *word {
                            word if word == first => second,
                            word if word == second => first,
                            word => word,
                        };
                    }
                }
            });
            misreadings.push(exchanged.located(Some(located)));
        }
    }
    misreadings
}

/// Returns true if the target of `[tool]` is declared so far from its frame that it may be in
/// millimetres; false for a problem with several targets.
pub(super) fn is_far(problem: &Problem) -> bool {
    problem.targets.is_empty() && problem.tool.target.norm() > MIN_MILLIMETRE_LENGTH
}

/// Reads a target of `[tool]` that [`is_far`] in millimetres.
fn shrink_target(problem: &mut Problem) {
    if is_far(problem) {
        problem.tool.target *= 1e-3;
    }
}

/// Returns the misreadings in which positions are shifted by rows against the configurations.
pub(super) fn of_order(table: &Measurements) -> Vec<Misreading> {
    let shifts = (-MAX_SHIFT..=MAX_SHIFT).filter(|&by| by != 0);
    let step = shift_step(table.len());
    let places = (0..table.len()).step_by(step).take(SHIFT_PLACES);
    let of_place = |from: usize| shifts.clone().map(move |by| Misreading::shifted(by, from));
    places.flat_map(of_place).collect()
}

/// Returns the misreadings of the order of all rows: one of two joined tables is sorted by the text
/// of its row numbers, which differs from the order of the numbers from ten rows on, or it is
/// reversed.
fn of_whole_order(table: &Measurements) -> Vec<Misreading> {
    if table.len() < 10 {
        return Vec::new();
    }
    // `source` has the row whose position belongs to each row.
    let ordered = |words: String, source: Vec<usize>| {
        Misreading::of_order(words, move |table, chosen| {
            let mut rows = table.select(chosen);
            rows.positions = chosen.iter().map(|&row| table.positions[source[row]]).collect();
            rows
        })
    };
    let mut misreadings = Vec::new();
    for first in [0, 1] {
        // The numbers of the rows, from `first` on, in the order of their texts.
        let mut numbers: Vec<usize> = (first..first + table.len()).collect();
        numbers.sort_by_key(usize::to_string);
        let of_joints: Vec<usize> = numbers.iter().map(|number| number - first).collect();
        let mut of_positions = vec![0; table.len()];
        of_joints.iter().enumerate().for_each(|(place, &row)| of_positions[row] = place);
        for (what, source) in [("positions", of_positions), ("joint angles", of_joints)] {
            let words = format!(
                "{what} whose rows are sorted by the text of their numbers (1, 10, 11, …, 2; join \
                 the tables by name or number, not by order)"
            );
            let order = ordered(words, source).of_kind(Kind::TextOrder);
            misreadings.push(order.in_group("order of texts"));
        }
    }
    let mut source: Vec<usize> = (0..table.len()).collect();
    let of_arm: Vec<usize> =
        (0..table.len()).filter(|&row| table.observation(row).is_of_arm()).collect();
    of_arm.iter().zip(of_arm.iter().rev()).for_each(|(&row, &opposite)| source[row] = opposite);
    misreadings.push(ordered("positions in the opposite order of the rows".to_owned(), source));
    misreadings
}

/// Returns the number of rows between two rows at which a trial shift begins, for a table of `rows`
/// rows.
pub(super) fn shift_step(rows: usize) -> usize {
    (rows / SHIFT_PLACES).max(1)
}

/// Returns the chosen rows of a table that have a row `by` rows later, and these rows. Rows before
/// `from` are their own. The last rows before it have none if theirs are taken by rows behind it.
fn moved(
    table: &Measurements,
    chosen: &[usize],
    (by, from): (i8, usize),
) -> (Vec<usize>, Vec<usize>) {
    let source = |row: usize| {
        let shifted = row.checked_add_signed(by.into())?;
        let is_taken = row < from && row.saturating_add_signed(isize::from(-by)) >= from;
        match row {
            _ if is_taken => None,
            row if row < from => Some(row),
            _ => (shifted < table.len()).then_some(shifted),
        }
    };
    chosen.iter().filter_map(|&row| Some((row, source(row)?))).unzip()
}

/// Returns the misreadings that payloads belong to the configuration of the row before or after.
pub(super) fn of_shifted_payloads(table: &Measurements) -> Vec<Misreading> {
    let shifted = |by: i8| {
        let side = if by > 0 { "before" } else { "after" };
        let rows = counted(by.unsigned_abs(), "row");
        let words = format!("payloads that belong to the configuration {rows} {side}");
        let shifted = Misreading::of_order(words, move |table, chosen| {
            let (chosen, sources) = moved(table, chosen, (by, 0));
            let mut rows = table.select(&chosen);
            let of_table = table.payload.as_ref();
            rows.payload = of_table.map(|of| sources.into_iter().map(|row| of[row]).collect());
            rows
        });
        shifted.in_group("shift of payloads")
    };
    [-1, 1].into_iter().filter(|_| table.payload.is_some()).map(shifted).collect()
}

impl Misreading {
    /// Creates the misreading that positions belong to the configuration `by` rows before theirs, from
    /// a row on.
    pub(super) fn shifted(by: i8, from: usize) -> Self {
        let side = if by > 0 { "before" } else { "after" };
        // Behind it the configuration at `from` is the first with another position.
        let first = from.saturating_add_signed(isize::from(by.min(0))) + 1;
        let start =
            if from > 0 { format!(", from row {first} of the table on") } else { String::new() };
        let rows = counted(by.unsigned_abs(), "row");
        let words = format!("positions that belong to the configuration {rows} {side}{start}");
        let shift = Self::of_order(words, move |table, chosen| {
            let (chosen, sources) = moved(table, chosen, (by, from));
            let mut rows = table.select(&chosen);
            rows.positions = sources.into_iter().map(|row| table.positions[row]).collect();
            rows
        });
        shift.of_kind(Kind::Shifted(by, from)).in_group("shift")
    }

    /// Returns a clause that names the offset of the clocks with which positions belong to the
    /// configurations of their rows; empty unless tables are joined by time.
    pub(super) fn clock_hint(&self, table: &Measurements) -> String {
        let Kind::Shifted(by, 0) = self.kind else { return String::new() };
        let offset = table.clock_offsets.iter().find(|(rows, _)| *rows == by);
        offset.map_or_else(String::new, |(_, seconds)| {
            let seconds = (seconds * 1e3).round() / 1e3;
            format!(
                " (joined by time: the clocks may differ; with offset_s = {seconds} in joints they \
                 belong to that of their own row)"
            )
        })
    }

    /// Creates the misreading that two coordinates of positions are exchanged, or that one has the
    /// wrong sign if both are the same; `None` if the free base makes all alike.
    pub(super) fn mirrored(axes: Option<[usize; 2]>) -> Self {
        let words = match axes {
            None => "two of x, y and z that are exchanged, or one of the other sign".to_owned(),
            Some([axis, with]) if axis == with => {
                format!("{} of the positions that has the other sign", AXES[axis])
            }
            Some([axis, with]) => {
                format!("{} and {} of the positions that are exchanged", AXES[axis], AXES[with])
            }
        };
        let [first, second] = axes.unwrap_or([0, 1]);
        let sign = if first == second { -1.0 } else { 1.0 };
        let mirrored = Self::of_positions(words, move |position| {
            position.swap_rows(first, second);
            position[first] *= sign;
        });
        mirrored.of_kind(Kind::Mirrored).in_group("mirrored")
    }

    /// Returns all misreadings of the hand of the measuring frame, for a base that is held or known.
    pub(super) fn all_mirrored() -> impl Iterator<Item = Self> {
        let pairs = (0..3).flat_map(|first| (first..3).map(move |second| [first, second]));
        pairs.map(|axes| Self::mirrored(Some(axes)))
    }

    /// Creates the misreading that all positions are on another scale, by a ratio in hundredths.
    fn of_scale(percent: i16) -> Self {
        let ratio = f64::from(percent);
        let words = "positions on another scale than the joint table (scale factor of the \
                     instrument, or a joint table of another size of this arm)";
        Self::of_positions(words, move |position| *position *= 100.0 / ratio)
            .of_kind(Kind::Scale)
            .in_group("scale")
            .with_size(
                ("tracker-scale.error", Some(Effect::TrackerScale)),
                move |x| ratio / 100.0 * (1.0 + x),
                move |size| format!("{words}: {size:.4} times as large"),
            )
    }

    /// Creates the misreading that the base stands elsewhere, if the problem holds it.
    pub(super) fn held_base() -> Self {
        let words = "a base that stands elsewhere than declared (free it in [parameters]: \"base.*\" \
                     = { free = true })";
        Self::of_problem(words, |problem| {
            free(problem, &["base*"]);
            Some(())
        })
        .of_kind(Kind::HeldBase)
    }

    /// Creates the misreading that the target lies elsewhere, if the problem holds it.
    pub(super) fn held_target() -> Self {
        let words = "a target that lies elsewhere than [tool] declares (correct it there, or free it \
                     in [parameters]: \"tool.*\" = { free = true })";
        let patterns = ["tool*.x", "tool*.y", "tool*.z"];
        Self::of_problem(words, move |problem| {
            free(problem, &patterns);
            Some(())
        })
        .of_kind(Kind::HeldTarget)
    }
}

/// Frees parameters of a problem.
fn free(problem: &mut Problem, patterns: &[&str]) {
    for pattern in patterns {
        let rule = ParameterRule::free((*pattern).to_owned(), problem);
        problem.parameters.push(rule);
    }
}
