//! Results of an identification in the form of the paper's tables 2 and 3 and its figure 13.

use nalgebra::Vector3;

use crate::fit::{Identification, Strategy};
use crate::paper::{Form, StiffnessStage};
use crate::problem::{Joint, Problem};

/// Geometric parameter of a joint before and after identification, as in table 2 of the paper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperTableEntry {
    /// Value that the problem declares \[m\] or \[rad\].
    pub nominal: f64,
    /// Value that the procedure identified \[m\] or \[rad\].
    pub identified: f64,
    /// Identified share: the part of the value that the data determine, 0…1; `None` if the
    /// parameter was not identified.
    pub seen: Option<f64>,
}

/// Result of one identification procedure, in the form of the paper's tables 2 and 3 and figure 13.
#[derive(Debug, Clone, PartialEq)]
pub struct Procedure {
    /// Form of the equations and source of the stiffness of the paper's procedure; `None` for the
    /// joint fit of the declared model.
    pub paper: Option<(Form, StiffnessStage)>,
    /// Table 2: number (from 1) and α, a, θ, d, β of each joint in DH form.
    pub geometry: Vec<(usize, [PaperTableEntry; 5])>,
    /// Errors measured − predicted of the held-out poses after identification, measuring frame
    /// \[m\].
    pub after: Vec<Vector3<f64>>,
    /// Errors measured − predicted of the held-out poses after an identification that ignores
    /// elasticity, measuring frame \[m\]; `None` if the arm is rigid.
    pub ignoring: Option<Vec<Vector3<f64>>>,
}

impl Procedure {
    /// Creates the result of the joint fit `found`, with its held-out errors `after` and those of
    /// the fit that ignores elasticity.
    pub(in crate::fit) fn of_fit(
        problem: &Problem,
        found: &Identification,
        after: Vec<Vector3<f64>>,
        ignoring: Option<Vec<Vector3<f64>>>,
    ) -> Self {
        let entry = |joint: usize, field: &str, nominal: f64| {
            let estimate = found
                .estimate(&format!("joint{}.{field}", joint + 1))
                .filter(|estimate| estimate.fitted);
            let identified = estimate.map_or(nominal, |estimate| estimate.estimate);
            PaperTableEntry {
                nominal,
                identified,
                seen: estimate.map(|estimate| estimate.identified),
            }
        };
        let row = |(index, joint): (usize, &Joint)| {
            let fields = [
                ("alpha", joint.alpha),
                ("a", joint.a),
                ("theta", joint.theta),
                ("d", joint.d),
                ("beta", joint.beta),
            ];
            (index + 1, fields.map(|(field, nominal)| entry(index, field, nominal)))
        };
        let joints =
            problem.joints.iter().enumerate().filter(|(_, joint)| joint.placement.is_none());
        let geometry = joints.map(row).collect();
        Self { paper: None, geometry, after, ignoring }
    }

    /// Returns the name by which lists of strategies show the procedure.
    pub fn name(&self) -> String {
        self.paper.map_or_else(
            || Strategy::Joint.as_str().to_owned(),
            |(form, stage)| paper_name(form, stage),
        )
    }
}

/// Returns the name of a form of the paper's procedure, such as
/// `paper-nominal-stiffness-as-printed`.
pub(in crate::fit) fn paper_name(form: Form, stage: StiffnessStage) -> String {
    let printed = if form == Form::Printed { "-as-printed" } else { "" };
    format!("paper-{}{printed}", stage.as_str())
}
