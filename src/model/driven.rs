//! What adds to the joints' commands and to the strains of beams, pose by pose.

use super::series::Series;
use crate::model::parameter::{BeamField, Driver, JointField, Parameter, Slot, Waves};
use crate::problem::{Mimic, PoseView, Problem};

/// What is added to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// The coordinate of a joint.
    Joint(usize),
    /// A number in the list of all beams' strains.
    Strain(usize),
}

/// A known addition: value × driver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Driven {
    pub place: Place,
    pub driver: Driver,
    /// \[rad\], \[m\], \[1/m\] or 1 per unit of the driver.
    pub value: f64,
}

impl Driven {
    /// Joints that follow the commands of others.
    pub fn declared(problem: &Problem) -> Vec<Self> {
        let joints = problem.joints.iter().enumerate();
        let driven = joints.filter_map(|(joint, own)| {
            let Mimic { joint: other, ratio } = own.mimic?;
            Some(Self { place: Place::Joint(joint), driver: Driver::command(problem, other + 1), value: ratio })
        });
        driven.collect()
    }

    /// What is known to drive and the free parameters at the full parameter vector `x`.
    pub fn all(known: &[Self], parameters: &[Parameter], x: &[f64]) -> Vec<Self> {
        let free = parameters.iter().zip(x);
        let free = free.filter_map(|(parameter, &x)| Self::of(parameter.slot, parameter.driver, x));
        known.iter().copied().chain(free).collect()
    }

    /// What a parameter at `x` adds to, if it is driven and acts on a joint's coordinate or a beam's strain.
    fn of(slot: Slot, driver: Driver, x: f64) -> Option<Self> {
        let place = match slot {
            Slot::Joint { joint, field: JointField::Theta | JointField::D } => Place::Joint(joint),
            Slot::Beam { joint, field } => {
                Place::Strain(3 * joint + BeamField::STRAINS.iter().position(|own| *own == field)?)
            }
            _ => return None,
        };
        (!driver.is_constant()).then_some(Self { place, driver, value: x })
    }
}

/// Poses with what drives them added, one at a time.
#[derive(Debug, Clone, Default)]
pub(super) struct Commands {
    series: Vec<Series>,
    /// What is in none of these.
    others: Vec<Driven>,
    configuration: Vec<f64>,
    strains: Vec<f64>,
}

impl Commands {
    /// Of what is known to drive and the free parameters at the full parameter vector `x`.
    pub fn new(known: &[Driven], parameters: &[Parameter], x: &[f64]) -> Self {
        let mut others = Driven::all(known, parameters, x);
        let series = Series::take(&mut others);
        Self { series, others, ..Self::default() }
    }

    /// The pose as the joints and beams take it.
    #[inline]
    pub fn apply<'b>(&'b mut self, setup: &PoseView<'b>) -> PoseView<'b> {
        if self.others.is_empty() && self.series.is_empty() {
            return *setup;
        }
        self.configuration.clear();
        self.configuration.extend_from_slice(setup.configuration);
        self.strains.clear();
        let mut waves = Waves::default();
        let others = self.others.iter().map(|own| (own.place, own.value * waves.value(own.driver, setup)));
        let series = self.series.iter().map(|own| (own.place, own.value(setup.configuration)));
        for (place, added) in others.chain(series) {
            match place {
                Place::Joint(joint) => self.configuration[joint] += added,
                Place::Strain(number) => {
                    self.strains.resize(3 * self.configuration.len(), 0.0);
                    self.strains[number] += added;
                }
            }
        }
        PoseView { configuration: &self.configuration, strains: &self.strains, ..*setup }
    }
}
