//! Displacement of the end point that each misprint of \[Chen2021\] causes.

use nalgebra::DVector;

use super::study::MisprintStudy;
use crate::paper::{EndPoint, Misprint, Parameters, Reading};
use crate::rig::{Draw, draw};

/// Returns the largest displacement \[m\] by each misprint, in the order of [`Misprint::EACH`]: the
/// change of the deflection `D_f`, or of the geometric error `D_g` = `J_g` e, whichever is larger.
///
/// The maximum is over the poses of one drawn arm with its declared elasticity and the geometric
/// errors e. For `BetaLeftOut` it is the displacement by the errors β in e.
pub fn sizes(study: &MisprintStudy) -> Vec<f64> {
    let (problem, poses) = (&study.problem, study.held_out + study.identification);
    let Draw { arm, rows, .. } = draw(problem, &study.truth, poses, study.seed);
    let nominal = Parameters::nominal(problem);
    let true_geometry =
        Parameters { geometry: Parameters::nominal(&arm).geometry, ..nominal.clone() };
    let pairs = nominal.geometry.iter().zip(&true_geometry.geometry);
    let e: Vec<f64> = pairs
        .flat_map(|(from, to)| {
            let (mut from, mut to) = (*from, *to);
            let changes =
                from.fields_mut().into_iter().zip(to.fields_mut()).map(|(from, to)| *to - *from);
            changes.collect::<Vec<f64>>()
        })
        .collect();
    let beta = e.iter().enumerate().map(|(index, e)| if index % 5 == 4 { *e } else { 0.0 });
    let (beta, e) = (DVector::from_iterator(e.len(), beta), DVector::from_vec(e.clone()));
    let size = |misprint: Misprint| {
        let of_row = |row: &crate::rig::Row| {
            let view = row.conditions.view();
            let end_point = |parameters: &Parameters, reading: Reading| {
                EndPoint::new(problem, parameters, &view, &reading)
            };
            let (corrected, printed) = (Reading::default(), Reading::from(misprint));
            if misprint == Misprint::BetaLeftOut {
                return (end_point(&nominal, corrected).jacobian() * &beta).norm();
            }
            let elastic = end_point(&true_geometry, printed).deflection(&true_geometry)
                - end_point(&true_geometry, corrected).deflection(&true_geometry);
            let geometric = end_point(&nominal, printed).jacobian() * &e
                - end_point(&nominal, corrected).jacobian() * &e;
            elastic.norm().max(geometric.norm())
        };
        rows.iter().map(of_row).fold(0.0, f64::max)
    };
    Misprint::EACH.into_iter().map(size).collect()
}
