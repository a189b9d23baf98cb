//! Candidates of a search: every effect of the catalogue that is conceivable on an arm.

use super::coverage::{
    DataCoverage, IS_ONLY_LOAD, IS_RIGID, NO_LOADS, NO_TEMPERATURE, NO_TIMES,
    NO_TIMES_NOR_TEMPERATURE, STANDS_STILL,
};
use super::place::slides;
use crate::laws::{
    Argument, ArgumentKind, Effect, FAMILIES, Family, Need, Only, Quantity, Search, to_three_digits,
};
use crate::problem::{Body, Equilibrium, Joint, JointKind, Problem};

/// Highest order of a single harmonic (periods per revolution of the joint) among the candidates.
pub(crate) const HIGHEST_ORDER: u32 = 60;

/// Longest time constant among the candidates, as a fraction of the duration of the measurement. A
/// longer one cannot be distinguished from a linear drift.
const MAX_LAG_FRACTION: f64 = 0.6;
/// Shortest time constant of a lag among the candidates, as a multiple of the typical time between
/// two poses. A faster lag settles before the next pose.
const MIN_LAG_INTERVALS: f64 = 2.0;
/// Shortest settling time among the candidates, as a fraction of the duration of the measurement. A
/// shorter one affects only a few poses.
const MIN_SETTLING_FRACTION: f64 = 0.03;
/// Ratio of successive time constants in the grid of candidates.
const LAG_RATIO: f64 = 1.25;
/// Shortest and longest friction path among the candidates, as fractions of the range of the
/// joint's commands. A shorter path acts like play, a longer one like a constant ratio.
const FRICTION_PATH_RANGE: (f64, f64) = (0.1, 1.6);
/// Ratio of successive friction paths in the grid of candidates.
const PATH_RATIO: f64 = 1.4;

/// Effect that a search may add, with the reason if the data cannot show it.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Effect that the search may add, with its place and arguments.
    pub effect: Effect,
    /// Reason why these data cannot show it; `None` if they can.
    pub untestable: Option<&'static str>,
}

/// Returns every effect of the catalogue that is conceivable on an arm, with the reason why these
/// data cannot show it.
pub fn candidates(problem: &Problem, data: &DataCoverage) -> Vec<Candidate> {
    let of_family = |family: &'static Family| {
        let found = places(family, problem).into_iter();
        let found = found.flat_map(move |place| with_searched_values(family, place, data));
        found.filter_map(move |arguments| {
            let argument = |key: &str| {
                arguments.iter().find(|(name, _)| *name == key).map(|(_, value)| value.clone())
            };
            let effect = Effect::from_name(family.name, &argument)?;
            let conceivable = family.only.iter().all(|only| effect.meets_condition(*only, problem));
            conceivable.then(|| {
                let untestable =
                    family.needs.iter().find_map(|need| effect.unmet_need(*need, problem, data));
                Candidate { effect, untestable }
            })
        })
    };
    let families = FAMILIES.iter().filter(|family| family.search != Search::Declared);
    families.flat_map(of_family).collect()
}

type Arguments = Vec<(&'static str, Argument)>;

/// Returns the places on an arm where the effects of a family act, each as a list of arguments. The
/// argument that the search varies is left out.
fn places(family: &Family, problem: &Problem) -> Vec<Arguments> {
    let mut argument_lists: Vec<Arguments> = vec![Vec::new()];
    for &(key, kind) in family.arguments {
        let joints = |is_it: &dyn Fn(&Joint) -> bool| -> Vec<Argument> {
            let found = (1..).zip(&problem.joints).filter(|(_, joint)| is_it(joint));
            found.map(|(number, _)| Argument::Joint(number)).collect()
        };
        let takes = |joint: &Joint| joint.takes_command();
        let values = match kind {
            ArgumentKind::AnyJoint | ArgumentKind::LinkedJoint | ArgumentKind::LoadedJoint => {
                joints(&|_| true)
            }
            ArgumentKind::MovingJoint | ArgumentKind::OtherJoint => joints(&takes),
            ArgumentKind::TurningJoint | ArgumentKind::RelievedJoint => {
                joints(&|joint| joint.takes_angle())
            }
            ArgumentKind::SlidingJoint => {
                joints(&|joint| takes(joint) && joint.kind == JointKind::Prismatic)
            }
            ArgumentKind::Mount => {
                joints(&takes).into_iter().chain([Argument::Base(true)]).collect()
            }
            ArgumentKind::Beam => {
                let beams = problem.joints.iter().filter_map(|joint| joint.beam.as_ref());
                beams.map(|beam| Argument::Name(beam.name.clone())).collect()
            }
            ArgumentKind::Camera => {
                problem.cameras().into_iter().map(|(name, _)| Argument::Name(name)).collect()
            }
            ArgumentKind::Covariate => {
                let covariates = problem.covariate_names();
                // The candidates are ordered by covariate: each covariate at every place.
                argument_lists = covariates
                    .into_iter()
                    .flat_map(|name| {
                        let with = |place: &Arguments| {
                            let mut place = place.clone();
                            place.push((key, Argument::Name(name.clone())));
                            place
                        };
                        argument_lists.iter().map(with).collect::<Vec<_>>()
                    })
                    .collect();
                continue;
            }
            _ => continue,
        };
        argument_lists = argument_lists
            .iter()
            .flat_map(|place| {
                let others = values.iter().filter(|value| {
                    kind != ArgumentKind::OtherJoint
                        || place.iter().all(|(_, other)| other != *value)
                });
                others.map(|value| [place.as_slice(), &[(key, value.clone())]].concat())
            })
            .collect();
    }
    argument_lists
}

/// Returns the arguments of a place, once for each value of the argument that the search varies or
/// lists.
fn with_searched_values(family: &Family, place: Arguments, data: &DataCoverage) -> Vec<Arguments> {
    let is_open = |kind: ArgumentKind| kind.is_searched() || kind == ArgumentKind::Orders;
    let Some((key, _)) = family.arguments.iter().find(|(_, kind)| is_open(*kind)) else {
        return vec![place];
    };
    let grid = |from: f64, to: f64, step: f64, unit: f64| -> Vec<Argument> {
        let parts = std::iter::successors(Some(from), |part| Some(part * step));
        let parts = parts.take_while(|part| *part > 0.0 && *part <= to);
        parts.filter_map(|part| to_three_digits(part * unit)).map(Argument::Number).collect()
    };
    let values: Vec<Argument> = match family.search {
        Search::Places | Search::Declared => Vec::new(),
        Search::Orders => (1..=HIGHEST_ORDER).map(|order| Argument::Orders(vec![order])).collect(),
        Search::Times => data.times.iter().map(|&time| Argument::Number(time)).collect(),
        Search::TimeConstants => match data.clock {
            None => vec![Argument::Number(1.0)],
            Some((between, span)) => {
                grid(MIN_LAG_INTERVALS * between, MAX_LAG_FRACTION * span, LAG_RATIO, 1.0)
            }
        },
        Search::SettlingTimes => match (data.times.first(), data.times.last()) {
            (Some(first), Some(last)) => {
                grid(MIN_SETTLING_FRACTION, MAX_LAG_FRACTION, LAG_RATIO, last - first)
            }
            _ => Vec::new(),
        },
        Search::Distances => {
            let joint = place.iter().find_map(|(_, argument)| match argument {
                Argument::Joint(joint) => joint.checked_sub(1),
                _ => None,
            });
            let range = joint.and_then(|joint| data.ranges.get(joint));
            let (from, to) = FRICTION_PATH_RANGE;
            grid(from, to, PATH_RATIO, range.map_or(0.0, |(low, high)| high - low))
        }
    };
    values.into_iter().map(|value| [place.as_slice(), &[(*key, value)]].concat()).collect()
}

impl Effect {
    /// Returns the reason why these data cannot show this declared law; `None` if they can. Also
    /// returns `None` for effects of the catalogue, whose reason [`Candidate::untestable`]
    /// contains.
    pub(crate) fn untestable(
        &self,
        problem: &Problem,
        data: &DataCoverage,
    ) -> Option<&'static str> {
        if !matches!(self, Self::Law(_)) {
            return None;
        }
        self.quantities()
            .into_iter()
            .find_map(|quantity| match quantity {
                Quantity::Command(joint) => (!data.moves(joint)).then_some(STANDS_STILL),
                Quantity::Warming => data.no_temperature,
                Quantity::Lagging { .. } => {
                    data.no_temperature.or(data.clock.is_none().then_some(NO_TIMES))
                }
                Quantity::Friction { .. } => data.clock.is_none().then_some(NO_TIMES),
                Quantity::Payload => (!data.has_payload()).then_some("no payload is carried"),
                Quantity::Approach(joint) => {
                    let both = data.both_sides.get(joint).copied().unwrap_or(false);
                    (!both).then_some("the joint was not approached from both sides")
                }
                Quantity::Moment(_) => (!data.has_gravity()).then_some(NO_LOADS),
                Quantity::Covariate(index) => {
                    let varies = data.covariates.get(index).copied().unwrap_or(false);
                    (!varies).then_some("the covariate does not change in these poses")
                }
                _ => None,
            })
            .or_else(|| self.terms(problem).is_empty().then_some("the arm does not have the site"))
    }

    /// Returns true if the arm satisfies the condition `only`, under which the effect is a
    /// candidate.
    fn meets_condition(&self, only: Only, problem: &Problem) -> bool {
        let joint = || problem.joints.get(self.joint()?.checked_sub(1)?);
        let is = |is_it: fn(&Joint) -> bool| joint().is_some_and(is_it);
        match only {
            Only::Turning => is(Joint::takes_angle),
            Only::Commanded => is(Joint::takes_command),
            Only::RigidJoint => is(|joint| joint.stiffness.is_none()),
            Only::Link => is(|joint| joint.a != 0.0),
            Only::RigidLink => is(|joint| {
                let bends = joint.beam.as_ref();
                !bends.is_some_and(|beam| beam.ei_y.is_some() || beam.ei_z.is_some())
            }),
            Only::Bodies => is(|joint| Body::total_mass(&joint.bodies) > 0.0),
            Only::CarriesCamera => {
                let camera = self.camera().and_then(|name| problem.camera(&name));
                let carrier = camera.and_then(|camera| problem.fixtures[camera].carrier);
                self.joint().is_some_and(|joint| carrier.is_some_and(|carrier| joint <= carrier))
            }
            Only::Undeflected => problem.statics.equilibrium == Equilibrium::Undeflected,
            Only::Hoisted => {
                let hoisted =
                    |joint: &Joint| joint.beam.as_ref().is_some_and(|beam| beam.hoist.is_some());
                problem.joints.iter().any(hoisted)
            }
        }
    }

    /// Returns the reason why the data do not meet `need`; `None` if they do.
    fn unmet_need(
        &self,
        need: Need,
        problem: &Problem,
        data: &DataCoverage,
    ) -> Option<&'static str> {
        let unless = |met: bool, reason| (!met).then_some(reason);
        let joint = self.joint().and_then(|joint| joint.checked_sub(1));
        let both_sides =
            joint.and_then(|joint| data.both_sides.get(joint)).copied().unwrap_or(false);
        match need {
            Need::Moves(key) => {
                let Some(Argument::Joint(joint)) = self.argument(key) else { return None };
                unless(data.moves(joint - 1), STANDS_STILL)
            }
            Need::Temperature => data.no_temperature,
            Need::Clock
                if data.no_temperature == Some(NO_TEMPERATURE)
                    && self.has_need(&[Need::Temperature]) =>
            {
                unless(data.clock.is_some(), NO_TIMES_NOR_TEMPERATURE)
            }
            Need::Clock => unless(data.clock.is_some(), NO_TIMES),
            Need::Times => unless(!data.times.is_empty(), "too few poses before or after any time"),
            Need::Payload => {
                unless(data.has_payload() && data.has_gravity(), "no payload is carried")
            }
            Need::GivesWay => unless(data.gives_way, IS_RIGID),
            Need::OtherLoads => unless(
                data.gives_way || !data.is_one_payload || problem.declared_mass() > 0.0,
                IS_ONLY_LOAD,
            ),
            Need::PayloadFromBothSides => unless(
                both_sides && data.payload_varies(),
                "no payload that changes, or no approach from both sides",
            ),
            Need::Play if data.approach => {
                unless(both_sides, "the joint was not approached from both sides")
            }
            Need::Play if self.joint().is_some_and(|joint| slides(problem, joint)) => Some(
                "no columns approach1 …, and a sliding joint has no moment of the loads that \
                 tells the side",
            ),
            Need::Velocities => data.no_velocities,
            Need::Loads | Need::Play => unless(data.has_gravity(), NO_LOADS),
            Need::Covariate => {
                let name = self.covariate();
                let mut covariates = problem.data.covariates.iter();
                let index = covariates.position(|covariate| Some(&covariate.name) == name.as_ref());
                let varies = index.and_then(|index| data.covariates.get(index)).copied();
                unless(varies.unwrap_or(false), "the covariate does not change in these poses")
            }
        }
    }
}
