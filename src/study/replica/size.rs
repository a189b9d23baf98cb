//! How far each misprint moves the end point.

use nalgebra::DVector;

use super::study::MisprintStudy;
use crate::paper::{EndPoint, Misprint, Parameters, Reading};
use crate::rig::{Draw, draw};

/// Largest change \[m\] of `D_f`, or of `D_g` = `J_g` e, by each misprint over the poses of the
/// first specimen: the declared arm, as elastic as the problem says, with the geometric errors e of
/// the truth; in the order of [`Misprint::ALL`].
///
/// Of `BetaLeftOut`: what the β of e move.
pub fn sizes(study: &MisprintStudy) -> Vec<f64> {
    let (problem, poses) = (&study.problem, study.held_out + study.identification);
    let Draw { arm, rows, .. } = draw(problem, &study.truth, poses, study.seed);
    let nominal = Parameters::nominal(problem);
    let there = Parameters { geometry: Parameters::nominal(&arm).geometry, ..nominal.clone() };
    let pairs = nominal.geometry.iter().zip(&there.geometry);
    let e: Vec<f64> = pairs
        .flat_map(|(from, to)| {
            let (mut from, mut to) = (*from, *to);
            let changes =
                from.fields_mut().into_iter().zip(to.fields_mut()).map(|(from, to)| *to - *from);
            changes.collect::<Vec<f64>>()
        })
        .collect();
    let beta = e.iter().enumerate().map(|(place, e)| if place % 5 == 4 { *e } else { 0.0 });
    let (beta, e) = (DVector::from_iterator(e.len(), beta), DVector::from_vec(e.clone()));
    let size = |misprint: Misprint| {
        let of_row = |row: &crate::rig::Row| {
            let view = row.conditions.view();
            let at = |parameters: &Parameters, reading: Reading| {
                EndPoint::new(problem, parameters, &view, &reading)
            };
            let (right, printed) = (Reading::default(), Reading::from(misprint));
            if misprint == Misprint::BetaLeftOut {
                return (at(&nominal, right).jacobian() * &beta).norm();
            }
            let elastic =
                at(&there, printed).deflection(&there) - at(&there, right).deflection(&there);
            let geometric =
                at(&nominal, printed).jacobian() * &e - at(&nominal, right).jacobian() * &e;
            elastic.norm().max(geometric.norm())
        };
        rows.iter().map(of_row).fold(0.0, f64::max)
    };
    Misprint::ALL.into_iter().map(size).collect()
}
