//! Data sets from plain arrays.

mod common;

use common::arms::path;
use flexcal::measurement::{Dataset, DatasetBuilder, DatasetError};
use flexcal::nalgebra::Vector3;
use flexcal::problem::Problem;

fn three() -> DatasetBuilder {
    Dataset::builder([[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]], vec![Vector3::x(); 3])
}

#[test]
fn columns_stand_as_given_and_the_others_as_if_a_file_had_none() {
    let data = three().payload(vec![1.0, 2.0, 3.0]).session(["a", "b", "a"]).held_out([2]).build().unwrap();
    let rows = &data.measurements;
    assert_eq!((rows.joints, rows.configuration(1), rows.len()), (2, [0.3, 0.4].as_slice(), 3));
    assert_eq!(rows.payload, Some(vec![1.0, 2.0, 3.0]));
    assert_eq!((rows.session.names.len(), rows.session.of_row.clone()), (2, vec![0, 1, 0]));
    assert_eq!((rows.time.clone(), rows.time_measured, rows.target.clone()), (vec![0.0, 1.0, 2.0], false, None));
    assert_eq!((data.split.identification, data.split.held_out), (vec![0, 1], vec![2]));
    assert_eq!(rows.location(2).line, Some(3), "rows count as lines");
    let plain = three().build().unwrap();
    assert_eq!((plain.measurements.session.names, plain.split.held_out), (vec![String::new()], vec![]));
}

#[test]
fn arrays_that_do_not_fit_are_told() {
    let wrong = |builder: DatasetBuilder| builder.build().unwrap_err();
    let short = DatasetError::Length { column: "sigma", expected: 3, found: 1 };
    assert_eq!(wrong(three().sigma(vec![1e-4])), short);
    assert_eq!(wrong(three().time(vec![0.0, f64::NAN, 1.0])), DatasetError::NotFinite { column: "time", row: 1 });
    assert_eq!(wrong(three().held_out([3])), DatasetError::NoSuchRow { row: 3, rows: 3 });
    assert!(matches!(wrong(three().sigma(vec![1.0, 0.0, 1.0])), DatasetError::OutOfRange { row: 1, .. }));
    assert!(matches!(
        wrong(three().approach([[1.0, 0.0], [-1.0, 0.5], [0.0, 0.0]])),
        DatasetError::OutOfRange { column: "approach", row: 1, .. }
    ));
    assert!(matches!(wrong(three().temperature(vec![1e160; 3])), DatasetError::OutOfRange { row: 0, .. }));
    let ragged = Dataset::builder([vec![0.1, 0.2], vec![0.3]], vec![Vector3::zeros(); 2]);
    assert_eq!(wrong(ragged), DatasetError::Joints { row: 1, expected: 2, found: 1 });
    let positions = Dataset::builder([[0.1]], Vec::new());
    assert_eq!(wrong(positions), DatasetError::Length { column: "positions", expected: 1, found: 0 });
}

#[test]
fn files_give_the_same_rows_as_measurements_and_split() {
    let problem = Problem::read(&path("problems/lunar-sampler")).unwrap();
    let (data, warnings) = Dataset::read(&problem).unwrap();
    assert!(warnings.is_empty());
    assert_eq!((data.split.identification.len(), data.split.held_out.len()), (28, 50));
}
