//! Effects of one's own.

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;

use super::coverage::DataCoverage;
use super::family::Term;
use crate::problem::{Custom, Effect, Problem};

/// An effect that no catalogue holds: declared in a problem by [`Effect::custom`], it is fitted,
/// traced and added by the loop like those of the catalogue. `tests/loop/custom_effect.rs` is the
/// example.
pub trait CustomEffect: Debug + Send + Sync {
    /// Name, by which parameters go: that of no effect of the catalogue and of no beam.
    fn name(&self) -> &str;

    /// Where it is: a joint's number, a link, empty for the whole arm. Name and place together say
    /// which effect it is.
    fn place(&self) -> String {
        String::new()
    }

    /// Its parameters: where each enters, what it is multiplied by, and a size that no realistic
    /// effect exceeds by much.
    ///
    /// Every one must be inert at zero. Joints of a [`ParameterSite`](crate::model::parameter::ParameterSite) and of
    /// a [`Regressor`](crate::model::parameter::Regressor) are counted from 0; `ParameterSite::of_joint`,
    /// `ParameterSite::coordinate` and `Regressor::command` take the numbers of files.
    fn terms(&self, problem: &Problem) -> Vec<Term>;

    /// What it is, in words for people: "the belt of joint 2 slackens".
    fn describe(&self) -> String;

    /// Why these data cannot show it, if they cannot: "no payload is carried".
    fn untestable(&self, problem: &Problem, data: &DataCoverage) -> Option<&'static str> {
        let _ = (problem, data);
        None
    }
}

impl Effect {
    /// An effect of one's own.
    pub fn custom(law: impl CustomEffect + 'static) -> Self {
        let (name, place) = (law.name().to_owned(), law.place());
        let law: Arc<dyn CustomEffect> = Arc::new(law);
        let law: Arc<dyn Any + Send + Sync> = Arc::new(law);
        Self::Custom(Custom::new(name, place, law))
    }
}

/// The law of an effect, if it is of one's own.
pub(super) fn custom(effect: &Effect) -> Option<&dyn CustomEffect> {
    match effect {
        Effect::Custom(own) => own.law().downcast_ref::<Arc<dyn CustomEffect>>().map(|law| &**law),
        _ => None,
    }
}
