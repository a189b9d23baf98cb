//! Parameters of effects on an arm.

use super::coverage::Columns;
use crate::laws::expression::Vocabulary;
use crate::laws::{
    At, Effect, EffectTerm, FOCAL, JointField, LAW, LawParameter, NamedCamera, Need, Quantity,
};
use crate::model::parameter::{EffectParameter, ParameterSite, Regressor};
use crate::problem::{FOCAL_X, JointKind, Problem, named_cameras};

/// Parameter of an effect on an arm, with the site where it enters the model.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// Last part of the parameter's name: `error` of `gear-ratio[3].error`.
    pub name: String,
    /// Site of the model at which the parameter acts.
    pub site: ParameterSite,
    /// Function of the pose that multiplies the parameter at its site.
    pub regressor: Regressor,
    /// Value at which the effect vanishes, SI.
    pub nominal: f64,
    /// Standard deviation (1 σ) of the parameter's prior, SI: a size that realistic effects hardly
    /// exceed.
    pub size: f64,
    /// True if a negative value is physically impossible. The effect is rejected as a cause if its
    /// fit needs one.
    pub never_negative: bool,
    /// Smallest value that the parameter may have, SI.
    pub lower: f64,
    /// Largest value that the parameter may have, SI.
    pub upper: f64,
}

/// Returns the parameters of every effect that `problem` declares, in order.
pub fn parameters(problem: &Problem) -> Vec<EffectParameter> {
    problem.effects.iter().flat_map(|declared| declared.effect.parameters(problem)).collect()
}

impl Effect {
    /// Returns the parameters of the effect, each with its site and regressor in the model of
    /// `problem`. Parameters at a joint or beam that the arm does not have are left out.
    #[doc(hidden)]
    pub fn terms(&self, problem: &Problem) -> Vec<Term> {
        let (slides, covariates) = (problem.slides(), problem.covariate_names());
        let vocabulary =
            Vocabulary { slides: &slides, covariates: &covariates, ..Vocabulary::default() };
        self.entries(&vocabulary)
            .into_iter()
            .filter_map(|entry| self.place_term(&entry, problem))
            .collect()
    }

    fn place_term(&self, entry: &EffectTerm, problem: &Problem) -> Option<Term> {
        let of_arm =
            |quantity: &Quantity| quantity.joint().is_none_or(|joint| joint < problem.joints.len());
        let quantities = entry.formula.as_ref().map(|formula| formula.expression.quantities());
        if !quantities.iter().flatten().all(of_arm) {
            return None;
        }
        let regressor = match &entry.formula {
            None if entry.inner.is_some() => Regressor::Inner,
            None => Regressor::Constant,
            Some(formula) => {
                let moves_base = matches!(entry.at, At::BaseShift(_) | At::BaseTurn(_));
                Regressor::new(formula, self.inner_parameters(), problem, moves_base)
            }
        };
        let bounds = entry.inner.as_ref().map_or((None, None), |inner| (inner.min, inner.max));
        let size = self.size(entry.prior, problem)?;
        let nominal = match entry.nominal {
            Some(nominal) => self.size(nominal, problem)?,
            None => 0.0,
        };
        Some(Term {
            name: entry.name.clone(),
            site: self.site(entry.at, problem)?,
            regressor,
            nominal,
            size,
            never_negative: entry.never_negative,
            lower: bounds.0.unwrap_or(f64::NEG_INFINITY),
            upper: bounds.1.unwrap_or(f64::INFINITY),
        })
    }

    /// Returns the site on the arm of `problem` for a catalogue site; `None` if the arm does not
    /// have it.
    fn site(&self, at: At, problem: &Problem) -> Option<ParameterSite> {
        let of_joint = |turning, sliding| {
            let joint = self.joint()?.checked_sub(1)?;
            let slides = problem.joints.get(joint)?.kind == JointKind::Prismatic;
            Some(ParameterSite::Joint { joint, field: if slides { sliding } else { turning } })
        };
        Some(match at {
            At::Coordinate => of_joint(JointField::Theta, JointField::D)?,
            At::Joint(field) => of_joint(field, field)?,
            At::JointOrSlide(turning, sliding) => of_joint(turning, sliding)?,
            At::Beam(field) => ParameterSite::Beam { joint: self.beam(problem)?, field },
            At::Arm(field) => ParameterSite::Arm(field),
            At::Shift(axis) | At::BaseShift(axis) => ParameterSite::Shift { axis },
            At::Turn(axis) | At::BaseTurn(axis) => ParameterSite::Turn { axis },
            At::Before(axis) => of_joint(JointField::Before(axis), JointField::Before(axis))?,
            At::After(axis) => of_joint(JointField::After(axis), JointField::After(axis))?,
            At::Tool(axis) => {
                let joint = problem.tool.joint.min(problem.joints.len().checked_sub(1)?);
                ParameterSite::Joint { joint, field: JointField::After(axis) }
            }
            At::ArmStrain => ParameterSite::ArmStrain,
            At::Scale => ParameterSite::Scale,
            At::Strain(entry) => ParameterSite::Strain { entry },
            At::Exposure { by_row } => {
                ParameterSite::Exposure { camera: problem.camera(&self.camera()?)?, by_row }
            }
            At::Camera(field) => {
                let fixture = problem.camera(&self.camera()?)?;
                let kind = problem.fixtures.get(fixture)?.kind;
                let axis = kind.fields().iter().position(|name| *name == field);
                match axis {
                    None if field == FOCAL => {
                        ParameterSite::FixtureShift { fixture, kind, axis: FOCAL_X, count: 2 }
                    }
                    axis => ParameterSite::FixtureShift { fixture, kind, axis: axis?, count: 1 },
                }
            }
        })
    }

    /// Returns the index of the joint, from 0, whose declaration contains the link (beam) on which
    /// the effect acts; `None` if there is none.
    pub(super) fn beam(&self, problem: &Problem) -> Option<usize> {
        let Some(link) = self.link() else { return self.joint()?.checked_sub(1) };
        problem
            .joints
            .iter()
            .position(|joint| joint.beam.as_ref().is_some_and(|beam| beam.name == link))
    }

    /// Returns full names and start values of the parameters inside a declared law's formulas;
    /// empty for other effects.
    fn inner_parameters(&self) -> Vec<(String, f64)> {
        let Self::Law(law) = self else { return Vec::new() };
        let named =
            |inner: &LawParameter| (format!("{LAW}[{}].{}", law.name(), inner.name), inner.start);
        law.parameters().iter().map(named).collect()
    }

    /// Returns the parameters of the effect with full names, such as `gear-ratio[3].error`.
    #[doc(hidden)]
    pub fn parameters(&self, problem: &Problem) -> Vec<EffectParameter> {
        let place = self.place();
        let bracket = if place.is_empty() { String::new() } else { format!("[{place}]") };
        let name = self.name();
        let parameter = |term: Term| EffectParameter {
            name: format!("{name}{bracket}.{}", term.name),
            plain: format!("{name}.{}", term.name),
            site: term.site,
            regressor: term.regressor,
            nominal: term.nominal,
            sigma: term.size,
            lower: term.lower,
            upper: term.upper,
        };
        self.terms(problem).into_iter().map(parameter).collect()
    }

    /// Returns the required column that the measurements lack, phrased for a message; `None` if
    /// `columns` suffice to fit the effect.
    pub(crate) fn missing_column(
        &self,
        problem: &Problem,
        columns: Columns,
    ) -> Option<&'static str> {
        let sliding_play = |term: &Term| {
            matches!(term.site, ParameterSite::Joint { field: JointField::SlidingPlay, .. })
        };
        let quantities = self.quantities();
        let follows = |is_it: fn(&Quantity) -> bool| quantities.iter().any(is_it);
        let approach = follows(|quantity| matches!(quantity, Quantity::Approach(_)))
            || self.terms(problem).iter().any(sliding_play);
        let needed = [
            (
                follows(|quantity| quantity.is_thermal()),
                columns.temperature,
                "a column temperature_C",
            ),
            (
                follows(|quantity| matches!(quantity, Quantity::Lagging { .. })),
                columns.time,
                "a column time_s",
            ),
            (approach, columns.approach, "columns approach1, …"),
            (
                self.has_need(&[Need::Velocities]),
                columns.velocities,
                "columns qd1_deg_per_s, …, the velocities of the joints",
            ),
            (
                follows(|quantity| matches!(quantity, Quantity::Covariate(_))),
                columns.covariates,
                "the columns of [data.covariates]",
            ),
        ];
        needed.into_iter().find(|(needs, has, _)| *needs && !has).map(|(.., write)| write)
    }
}

impl Problem {
    /// Returns the index of a camera among the fixtures; `None` if none has the name.
    pub(crate) fn camera(&self, name: &str) -> Option<usize> {
        self.fixtures.iter().position(|of| of.kind.word() == "camera" && of.name == name)
    }

    /// Returns the names of the cameras, each with the names of its numbers.
    pub(crate) fn cameras(&self) -> Vec<NamedCamera> {
        named_cameras(&self.fixtures)
    }

    /// Returns the names of the covariates, in order of declaration.
    pub(crate) fn covariate_names(&self) -> Vec<String> {
        self.data.covariates.iter().map(|covariate| covariate.name.clone()).collect()
    }
}
