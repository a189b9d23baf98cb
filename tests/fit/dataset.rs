//! Data sets built from arrays.

use crate::common::arms::path;
use flexcal::fit::{Options, identify, jacobian};
use flexcal::measurement::{ColumnTable, ColumnValues, Dataset, DatasetBuilder, DatasetError};
use flexcal::nalgebra::Vector3;
use flexcal::problem::Problem;

fn three() -> DatasetBuilder {
    Dataset::builder([[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]], vec![Vector3::x(); 3])
}

#[test]
fn columns_stand_as_given_and_the_others_as_if_a_file_had_none() {
    let data = three()
        .payload(vec![1.0, 2.0, 3.0])
        .session(["a", "b", "a"])
        .held_out([2])
        .build()
        .unwrap();
    let rows = &data.measurements;
    assert_eq!((rows.joints, rows.configuration(1), rows.len()), (2, [0.3, 0.4].as_slice(), 3));
    assert_eq!(rows.payload, Some(vec![1.0, 2.0, 3.0]));
    assert_eq!((rows.session.names.len(), rows.session.of_row.clone()), (2, vec![0, 1, 0]));
    assert_eq!(
        (rows.time.clone(), rows.time_measured, rows.target.clone()),
        (vec![0.0, 1.0, 2.0], false, None)
    );
    assert_eq!((data.split.identification, data.split.held_out), (vec![0, 1], vec![2]));
    assert_eq!(rows.location(2).line, Some(3), "rows count as lines");
    let plain = three().build().unwrap();
    assert_eq!(
        (plain.measurements.session.names, plain.split.held_out),
        (vec![String::new()], vec![])
    );
}

#[test]
fn arrays_that_do_not_fit_are_told() {
    let wrong = |builder: DatasetBuilder| builder.build().unwrap_err();
    let short = DatasetError::Length { column: "sigma", expected: 3, found: 1 };
    assert_eq!(wrong(three().sigma(vec![1e-4])), short);
    assert_eq!(
        wrong(three().time(vec![0.0, f64::NAN, 1.0])),
        DatasetError::NotFinite { column: "time", row: 1 }
    );
    assert_eq!(wrong(three().held_out([3])), DatasetError::NoSuchRow { row: 3, rows: 3 });
    assert!(matches!(
        wrong(three().sigma(vec![1.0, 0.0, 1.0])),
        DatasetError::OutOfRange { row: 1, .. }
    ));
    assert!(matches!(
        wrong(three().approach([[1.0, 0.0], [-1.0, 0.5], [0.0, 0.0]])),
        DatasetError::OutOfRange { column: "approach", row: 1, .. }
    ));
    assert!(matches!(
        wrong(three().temperature(vec![1e160; 3])),
        DatasetError::OutOfRange { row: 0, .. }
    ));
    let ragged = Dataset::builder([vec![0.1, 0.2], vec![0.3]], vec![Vector3::zeros(); 2]);
    assert_eq!(wrong(ragged), DatasetError::Joints { row: 1, expected: 2, found: 1 });
    let positions = Dataset::builder([[0.1]], Vec::new());
    assert_eq!(
        wrong(positions),
        DatasetError::Length { column: "positions", expected: 1, found: 0 }
    );
}

#[test]
fn files_give_the_same_rows_as_measurements_and_split() {
    let problem = Problem::read(&path("problems/lunar-sampler")).unwrap();
    let (data, warnings) = Dataset::read(&problem).unwrap();
    assert!(warnings.is_empty());
    assert_eq!((data.split.identification.len(), data.split.held_out.len()), (28, 50));
}

/// Returns the table of the lunar sampler, column by column.
fn in_memory() -> Vec<(String, ColumnValues)> {
    let text = std::fs::read_to_string(path("problems/lunar-sampler/measurements.csv")).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let rows: Vec<Vec<&str>> = lines.collect();
    let values = |k: usize| match rows.iter().map(|row| row[k].parse()).collect() {
        Ok(numbers) => ColumnValues::Numbers(numbers),
        Err(_) => ColumnValues::Words(rows.iter().map(|row| row[k]).collect()),
    };
    header.iter().enumerate().map(|(k, name)| ((*name).to_owned(), values(k))).collect()
}

#[test]
fn a_table_in_memory_is_read_as_the_file_is() {
    let problem = Problem::read(&path("problems/lunar-sampler")).unwrap();
    let (file, _) = Dataset::read(&problem).unwrap();
    let read = |columns| {
        let table = ColumnTable::new("memory", columns)?;
        Dataset::read_columns(table, &problem)
    };
    let (memory, _) = read(in_memory()).unwrap();
    assert_eq!(memory.split, file.split);
    let (memory, file) = (memory.measurements, file.measurements);
    assert_eq!(
        (&memory.configurations, &memory.positions),
        (&file.configurations, &file.positions)
    );
    assert_eq!(
        (&memory.time, &memory.approach, &memory.origin),
        (&file.time, &file.approach, &file.origin)
    );
    let with = |name: &str, values: ColumnValues| {
        let mut columns = in_memory();
        columns.iter_mut().find(|(column, _)| column == name).unwrap().1 = values;
        read(columns)
    };
    let texts = in_memory().into_iter().map(|(name, values)| match &*name {
        "x_mm" => (name, ColumnValues::Words(vec!["1874,383"; memory.len()].into_iter().collect())),
        _ => (name, values),
    });
    let said = read(texts.collect()).unwrap_err().to_string();
    assert!(said.contains("is a text, not a number") && said.contains("read_csv"), "{said}");
    let replaced = |name: &str, values| with(name, values).unwrap_err().to_string();
    let numbers = |row: usize, value: f64| {
        let mut numbers = vec![0.5; 78];
        numbers[row] = value;
        ColumnValues::Numbers(numbers)
    };
    let words = |row: usize, word| {
        ColumnValues::Words((0..78).map(|k| if k == row { word } else { "1" }).collect())
    };
    // A row without a measured position is left out.
    let (gap, warnings) = with("x_mm", numbers(5, f64::NAN)).unwrap();
    assert_eq!(gap.measurements.len() + 1, memory.len());
    assert!(warnings[0].to_string().starts_with("memory:7: 1 row without a measurement"));
    let told = [
        (replaced("q1_deg", numbers(5, f64::NAN)), "memory:7: column q1_deg: NaN is not a finite"),
        (replaced("x_mm", numbers(77, 1e200)), "memory:79: column x_mm: 1e200 is larger than"),
        (replaced("x_mm", words(0, "a,\"b")), "memory:2: column x_mm: \"a,\"b\" is a text"),
        (replaced("split", words(1, "")), "memory:2: column split: \"1\" is neither"),
        (replaced("z_mm", words(3, "")), "memory:5: column z_mm: the cell is empty"),
        (
            replaced("z_mm", ColumnValues::Numbers(vec![0.0])),
            "memory: column z_mm: 1 values, and 78 in the first column",
        ),
    ];
    for (found, expected) in told {
        assert!(found.starts_with(expected), "{found}, not {expected}");
    }
}

#[test]
fn jacobians_are_the_derivatives_of_predictions() {
    let problem = Problem::read(&path("problems/lunar-sampler")).unwrap();
    let (data, _) = Dataset::read(&problem).unwrap();
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let rows = data.measurements.select(&[0, 7, 40]);
    let all = jacobian(&problem, Some(&found), &rows).unwrap();
    let step = 1e-5;
    for joint in 0..rows.joints {
        let moved = |by: f64| {
            let mut rows = rows.clone();
            rows.configurations.iter_mut().skip(joint).step_by(rows.joints).for_each(|q| *q += by);
            found.predict(&problem, &rows).unwrap()
        };
        for ((jacobian, ahead), behind) in all.iter().zip(moved(step)).zip(moved(-step)) {
            let difference = (ahead - behind) / (2.0 * step);
            assert!(
                (jacobian.column(joint) - difference).norm() < 1e-8,
                "joint {joint}: {jacobian} {difference}"
            );
        }
    }
}
