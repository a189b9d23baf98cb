//! Outliers and heavy tails are named and do not count as structure.

use flexcal::residual_tests::{ResidualTests, Test};
use nalgebra::{DVector, Vector3};

use super::linear::{Linear, count, find, heavy_tails, outliers};

#[test]
fn outliers_are_named_and_are_not_structure() {
    let mut linear = Linear::new(60, 20, None, 8);
    let mut data = linear.noise();
    let clean = linear.leaves(data.clone());
    assert!(linear.check(&clean).outliers.is_empty());
    Linear::displace(&mut data, |pose| match pose {
        12 => Vector3::new(60.0, 20.0, 0.0),
        40 => Vector3::new(0.0, -12.0, 10.0),
        _ => Vector3::zeros(),
    });
    let residual = linear.leaves(data);
    let findings = linear.check(&residual);
    let check = outliers(&findings);
    println!("{check}");
    assert!(check.failed());
    assert_eq!(check.test, Test::Outliers { worst: Some(12) });
    assert!(check.to_string().starts_with("pose 13 is an outlier: "));
    assert_eq!(findings.outliers, [12, 40]);
    assert!(!findings.is_structured(), "{:?}", findings.strongest());
}

#[test]
fn left_out_poses_leave_no_trace() {
    let mut linear = Linear::new(60, 20, Some(0.5), 9);
    let mut data = linear.noise();
    let p_values = |findings: &ResidualTests| -> Vec<f64> {
        let rest = findings
            .tests
            .iter()
            .filter(|check| !matches!(check.test, Test::Outliers { .. } | Test::Normality));
        rest.filter_map(|check| check.outcome.as_ref().ok())
            .map(|outcome| outcome.p_value)
            .collect()
    };
    let at = |size: f64, data: &mut DVector<f64>| {
        Linear::displace(data, |pose| {
            if pose == 30 { Vector3::new(size, 0.0, size) } else { Vector3::zeros() }
        });
        let taken = linear.fitted.tr_mul(data);
        let residual = &*data - &linear.fitted * taken;
        linear.check(&residual)
    };
    let (near, far) = (at(20.0, &mut data), at(200.0, &mut data));
    assert!(outliers(&near).failed());
    assert_eq!((&near.outliers, &far.outliers), (&vec![30], &vec![30]));
    for (a, b) in p_values(&near).iter().zip(p_values(&far)) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
}

#[test]
fn heavy_tails_are_named() {
    let named = count(30, |seed| {
        let (linear, residual) = heavy_tails(100, 20)(seed);
        find(&linear.check(&residual), &Test::Normality).failed()
    });
    println!("heavy tails are named in {named} of 30");
    assert!(named >= 25);
}
