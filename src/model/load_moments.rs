//! Moments of the fitted loads about the joint axes, which formulas of laws may contain, and the
//! derivatives through these moments.

use std::borrow::Cow;
use std::sync::Arc;

use num_dual::Dual64;

use super::Model;
use crate::least_squares::Block;
use crate::mechanics::AxisMoments;
use crate::model::parameter::{
    Parameter, ParameterSite, Regressor, load_derivative, slope_regressor, uses_moments,
    with_moments,
};

/// Column of a Jacobian: a site of the model and the regressor that multiplies its derivative.
pub(super) struct JacobianColumn {
    /// Index of the parameter; `None` for the effect of a load through the moments in formulas.
    pub parameter: Option<usize>,
    pub site: ParameterSite,
    pub regressor: Regressor,
}

/// Columns of the unknown parameters, followed by the effects of loads through the moments in
/// formulas. The latter are added to the columns of the loads.
pub(super) struct JacobianColumns {
    columns: Vec<JacobianColumn>,
    /// Index of the load's column to which each column after those of the unknowns is added.
    added_to: Vec<usize>,
}

impl JacobianColumns {
    /// Creates the columns of the `unknowns` of a model at the full parameter vector `x`.
    pub fn new(model: &Model, x: &[f64], unknowns: &[usize]) -> Self {
        let parameters = &*model.parameters_at(x);
        let column = |&k: &usize| JacobianColumn {
            parameter: Some(k),
            site: parameters[k].site,
            regressor: slope_regressor(parameters, x, k),
        };
        let mut columns: Vec<JacobianColumn> = unknowns.iter().map(column).collect();
        let mut added_to = Vec::new();
        let terms: Vec<usize> =
            (0..parameters.len()).filter(|&k| uses_moments(&parameters[k])).collect();
        let mut sites: Vec<ParameterSite> = Vec::new();
        for &k in &terms {
            if !sites.contains(&parameters[k].site) {
                sites.push(parameters[k].site);
            }
        }
        let is_load = |&(_, k): &(usize, usize)| model.is_load(&parameters[k]);
        let loads = unknowns.iter().copied().enumerate().filter(is_load);
        for (column, load) in loads.filter(|_| !terms.is_empty()) {
            let seeded = |k: usize| Dual64::new(x[k], f64::from(u8::from(k == load)));
            let arm = model.arm_with(seeded, |parameter| model.is_load(parameter));
            let moments = Arc::new(AxisMoments::new(arm));
            for &site in &sites {
                let at_site: Vec<usize> =
                    terms.iter().copied().filter(|&k| parameters[k].site == site).collect();
                let regressor = load_derivative(parameters, x, &at_site, &moments);
                columns.push(JacobianColumn { parameter: None, site, regressor });
                added_to.push(column);
            }
        }
        Self { columns, added_to }
    }

    /// Returns all columns, in the order of the block that the function passed to
    /// [`JacobianColumns::write`] fills.
    pub fn all(&self) -> &[JacobianColumn] {
        &self.columns
    }

    /// Fills a block that contains the columns of the unknowns and the residual. `write` fills a
    /// block of all columns, from which it is computed.
    pub fn write(&self, block: &mut Block, write: impl FnOnce(&mut Block)) {
        if self.added_to.is_empty() {
            return write(block);
        }
        let unknowns = block.parameters();
        let mut wide = Block::zeros(block.rows(), self.columns.len());
        write(&mut wide);
        for column in 0..unknowns {
            block.column_mut(column).copy_from_slice(wide.column(column));
        }
        block.column_mut(unknowns).copy_from_slice(wide.column(self.columns.len()));
        for (&load, part) in self.added_to.iter().zip(unknowns..) {
            let out = block.column_mut(load).iter_mut();
            out.zip(wide.column(part)).for_each(|(out, part)| *out += part);
        }
    }
}

impl Model {
    /// Returns the free parameters. Formulas that contain moments use those of the loads at the
    /// full parameter vector `x`.
    pub(crate) fn parameters_at(&self, x: &[f64]) -> Cow<'_, [Parameter]> {
        if !self.parameters.iter().any(uses_moments) {
            return Cow::Borrowed(&self.parameters);
        }
        let arm = self.arm_with(|k| x[k], |parameter| self.is_load(parameter));
        let moments = Arc::new(AxisMoments::new(arm));
        let parameter = |parameter: &Parameter| with_moments(parameter, &moments);
        Cow::Owned(self.parameters.iter().map(parameter).collect())
    }

    /// Returns true if a parameter changes the loads, but neither geometry nor compliance.
    fn is_load(&self, parameter: &Parameter) -> bool {
        parameter.site.is_load() || self.payload_axis(parameter.site).is_some()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DVector, Vector3};

    use super::super::{Pose, PoseResiduals};
    use super::*;
    use crate::least_squares::LeastSquares;
    use crate::observation::Observation;
    use crate::problem::{PoseView, Problem};

    /// Step of the central differences, relative to the scale of each parameter.
    const STEP: f64 = 1e-5;

    const ARM: &str = "name = 'arm'\n[[joint]]\nstiffness_N_m_per_rad = 2e4\n[[joint]]\n\
        alpha_deg = 90\n[[joint]]\na_m = 0.8\n[joint.beam]\nname = 'link'\nmass_kg = 5\n\
        EIy_N_m2 = 3e4\nEIz_N_m2 = 1.2e4\n[tool]\ntarget_m = [0.3, 0.1, 0.2]\n\
        payload_kg = 3\n[base]\nxyz_m = [1.0, 2.0, 0.5]\n[[effect]]\npayload-mass = {}\n\
        [[effect]]\ngravity-direction = {}\n[[effect]]\nunmodelled-mass = { link = 'link' }\n";

    #[test]
    fn loads_act_through_moments_at_every_site() {
        let sites =
            ["joint2", "joint2.x", "base.rz", "tool.z", "measurement.y", "measurement.range"];
        let law = |(k, site): (usize, &&str)| {
            let terms = "['M2*(1 + M3/50)', 'sin(q1)*tanh(c*M3)']";
            let law =
                format!("[[effect]]\nlaw = {{ name = 'w{k}', at = '{site}', terms = {terms}, ");
            law + "c = { start = 0.02 } }\n"
        };
        let laws: String = sites.iter().enumerate().map(law).collect();
        let problem = Problem::parse(&format!("{ARM}{laws}"), "problem.toml".as_ref()).unwrap();
        let model = Model::new(&problem, &[String::new()], &[String::new()]).unwrap();
        let start = |parameter: &Parameter| match parameter.name.as_str() {
            name if name.starts_with("law") => 3e-3,
            _ => 1e-2,
        };
        let count = model.parameters.len();
        let x = DVector::from_iterator(count, model.parameters.iter().map(start));
        let configuration = [0.4, -0.7, 1.1];
        let pose = Pose {
            setup: PoseView::from_configuration(&configuration),
            base: 0,
            target: 0,
            observation: Observation::Position,
            measured: &Vector3::zeros(),
            sigma: 1.0,
            orientation: None,
        };
        let residuals =
            PoseResiduals::new(&model, vec![pose], (0..count).collect(), DVector::zeros(count));
        let mut block = Block::zeros(3, count);
        residuals.linearise(&x, 0..1, &mut block);
        let loads: Vec<usize> =
            (0..count).filter(|&k| model.is_load(&model.parameters[k])).collect();
        assert!(loads.len() >= 3);
        for k in 0..count {
            let moved = |step: f64| {
                let mut x = x.clone();
                x[k] += step;
                residuals.position_errors(&x)[0]
            };
            let slope = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
            let off = (slope - Vector3::from_column_slice(block.column(k))).norm();
            assert!(off < 1e-7 * (1.0 + slope.norm()), "{}: {off}", model.parameters[k].name);
        }
    }
}
