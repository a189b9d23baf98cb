//! What adds to the joints' commands, pose by pose.

use crate::model::parameter::{Driver, JointField, Parameter, Slot, Waves};
use crate::problem::{Mimic, PoseView, Problem};

/// A known addition to a joint's coordinate: value × driver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Driven {
    pub joint: usize,
    pub driver: Driver,
    /// \[rad\] or \[m\] per unit of the driver.
    pub value: f64,
}

impl Driven {
    /// Joints that follow the commands of others.
    pub fn declared(problem: &Problem) -> Vec<Self> {
        let joints = problem.joints.iter().enumerate();
        let driven = joints.filter_map(|(joint, own)| {
            let Mimic { joint: other, ratio } = own.mimic?;
            Some(Self { joint, driver: Driver::command(problem, other + 1), value: ratio })
        });
        driven.collect()
    }

    /// What a parameter at `x` adds to, if it is driven and acts on a joint's coordinate.
    fn of(slot: Slot, driver: Driver, x: f64) -> Option<Self> {
        match slot {
            Slot::Joint { joint, field: JointField::Theta | JointField::D } if !driver.is_constant() => {
                Some(Self { joint, driver, value: x })
            }
            _ => None,
        }
    }
}

/// Configurations with what drives them added, one pose at a time.
#[derive(Debug, Clone, Default)]
pub(super) struct Commands {
    all: Vec<Driven>,
    configuration: Vec<f64>,
}

impl Commands {
    /// Of what is known to drive and the free parameters at the full parameter vector `x`.
    pub fn new(known: &[Driven], parameters: &[Parameter], x: &[f64]) -> Self {
        let free = parameters.iter().zip(x);
        let mut all = known.to_vec();
        all.extend(free.filter_map(|(parameter, &x)| Driven::of(parameter.slot, parameter.driver, x)));
        Self { all, configuration: Vec::new() }
    }

    /// Everything that is added.
    pub fn into_driven(self) -> Vec<Driven> {
        self.all
    }

    /// The pose as the joints take it.
    #[inline]
    pub fn apply<'b>(&'b mut self, setup: &PoseView<'b>) -> PoseView<'b> {
        if self.all.is_empty() {
            return *setup;
        }
        self.configuration.clear();
        self.configuration.extend_from_slice(setup.configuration);
        let mut waves = Waves::default();
        for driven in &self.all {
            self.configuration[driven.joint] += driven.value * waves.value(driven.driver, setup);
        }
        PoseView { configuration: &self.configuration, ..*setup }
    }
}
