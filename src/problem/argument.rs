//! Arguments of effects, read and checked against the arm.

use super::section::Section;
use super::wrong_type::several_joints;
use super::{Body, Joint, JointKind, Problem, beam_names};
use crate::error::{InputError, InputErrorKind};
use crate::laws::{Argument, ArgumentKind, quoted};
use crate::quantity::Unit;

/// Maximum number of harmonic orders of one effect.
const MAX_ORDERS: usize = 100;
/// Highest order of a wave [cycles per revolution]. At higher orders, an error of a hundredth of a
/// degree in the command changes the phase by more than 100°.
pub(crate) const HIGHEST_ORDER: f64 = 1e4;

/// Reader of the arguments of one effect, one after the other.
pub(crate) struct ArgumentReader<'s, 'a, 'i> {
    pub section: Section<'a, 'i>,
    joints: &'s [Joint],
    /// Number of the joint that was read last, counted from 1.
    last: Option<usize>,
}

impl<'s, 'a, 'i> ArgumentReader<'s, 'a, 'i> {
    pub fn new(section: Section<'a, 'i>, joints: &'s [Joint]) -> Self {
        Self { section, joints, last: None }
    }

    /// Reads the argument called `key`, which ends in the suffix of its SI unit if it has one.
    ///
    /// # Errors
    /// Returns an error if the argument is missing, or if the arm lacks the joint, beam or
    /// covariate that it names.
    pub fn read(&mut self, key: &str, kind: ArgumentKind) -> Result<Argument, InputError> {
        let turns = |kind| kind == JointKind::Revolute;
        match kind {
            // That a link precedes the joint, that it carries bodies, or that it rotates under a
            // moment, is checked after all effects are read.
            ArgumentKind::AnyJoint | ArgumentKind::LinkedJoint | ArgumentKind::LoadedJoint => {
                self.read_any_joint(key)
            }
            ArgumentKind::MovingJoint => self.read_moving_joint(key),
            ArgumentKind::TurningJoint | ArgumentKind::RelievedJoint => {
                self.read_joint_of_kind(key, turns, |joint| InputErrorKind::NotRevolute { joint })
            }
            ArgumentKind::SlidingJoint => {
                let slides = |kind| kind == JointKind::Prismatic;
                self.read_joint_of_kind(key, slides, |joint| InputErrorKind::NoSlide { joint })
            }
            ArgumentKind::OtherJoint => return self.read_other_joint(key),
            ArgumentKind::Mount => return self.read_mount(key),
            ArgumentKind::Beam => return self.read_beam(key),
            ArgumentKind::Covariate => return self.read_covariate(key),
            ArgumentKind::Camera => return self.read_camera(key),
            ArgumentKind::Orders => return self.read_orders(key),
            ArgumentKind::Order => return self.read_order(key),
            ArgumentKind::Time => return self.read_time(key),
            ArgumentKind::Duration => return self.read_positive(key, Unit::Time),
            ArgumentKind::Distance => return self.read_positive(key, Unit::Angle),
            ArgumentKind::Point => return self.read_point(key),
            ArgumentKind::FreeLength => return self.read_free_length(key),
        }
        .map(Argument::Joint)
    }

    fn read_any_joint(&mut self, key: &str) -> Result<usize, InputError> {
        if let Some(error) = self.joint_meant(key) {
            return Err(error);
        }
        let item = self.section.require(key, &format!("{key} = …, a joint's number"))?;
        let joint = item.whole(0)?;
        match usize::try_from(joint) {
            Ok(number) if (1..=self.joints.len()).contains(&number) => Ok(number),
            _ => Err(item.error(InputErrorKind::UnknownJoint { joint, joints: self.joints.len() })),
        }
    }

    /// Returns the error of an effect without `key` that names several joints, or a beam; `None` for
    /// other effects.
    fn joint_meant(&self, key: &str) -> Option<InputError> {
        let peek = |key: &str| self.section.peek(key);
        let given = ["joints", "link", "beam"].into_iter().find_map(peek);
        let item = given.filter(|_| peek(key).is_none())?;
        let place = if let Ok(joints) = item.list("") {
            several_joints(&joints)?
        } else {
            let name = item.any_text().ok()?;
            let is_meant = |of: &Joint| of.beam.as_ref().is_some_and(|beam| beam.name == name);
            let joint = self.joints.iter().position(is_meant)? + 1;
            format!("write {key} = {joint}, the joint of beam {name:?}")
        };
        Some(item.error(InputErrorKind::MisplacedKey { place }))
    }

    fn read_moving_joint(&mut self, key: &str) -> Result<usize, InputError> {
        let joint = self.read_any_joint(key)?;
        let kind = self.joints.get(joint - 1).map(Joint::command_kind);
        if let (Some(JointKind::Fixed), Some(item)) = (kind, self.section.peek(key)) {
            return Err(item.error(InputErrorKind::NoCommand { joint }));
        }
        self.last = Some(joint);
        Ok(joint)
    }

    /// Reads the number of a joint that takes a command and whose kind satisfies `is_it`; for
    /// another kind returns the error that `mistake` makes of the number.
    fn read_joint_of_kind(
        &mut self,
        key: &str,
        is_it: fn(JointKind) -> bool,
        mistake: fn(usize) -> InputErrorKind,
    ) -> Result<usize, InputError> {
        let joint = self.read_moving_joint(key)?;
        let fits = self.joints.get(joint - 1).is_some_and(|declared| is_it(declared.kind));
        match self.section.peek(key) {
            Some(item) if !fits => Err(item.error(mistake(joint))),
            _ => Ok(joint),
        }
    }

    fn read_other_joint(&mut self, key: &str) -> Result<Argument, InputError> {
        let before = self.last;
        let joint = self.read_moving_joint(key)?;
        if before == Some(joint) {
            return Err(self.section.error(InputErrorKind::CoupledToItself { joint }));
        }
        Ok(Argument::Joint(joint))
    }

    /// Reads the place where an effect is mounted: a joint that takes a command, or `base = true`.
    fn read_mount(&mut self, key: &str) -> Result<Argument, InputError> {
        match self.section.get("base") {
            Some(item) if !item.boolean()? || self.section.peek(key).is_some() => {
                Err(item.error(InputErrorKind::NotOnePlace))
            }
            Some(_) => Ok(Argument::Base(true)),
            None => self.read_moving_joint(key).map(Argument::Joint),
        }
    }

    /// Reads the name of a covariate. Its existence is checked when the data are read.
    fn read_covariate(&mut self, key: &str) -> Result<Argument, InputError> {
        let item = self
            .section
            .require(key, &format!("{key} = \"…\", the name of a column in [data.covariates]"))?;
        Ok(Argument::Name(item.text()?.to_owned()))
    }

    /// Reads the name of a camera. Its existence is checked when all sections are read.
    fn read_camera(&mut self, key: &str) -> Result<Argument, InputError> {
        let item =
            self.section.require(key, &format!("{key} = \"…\", the name of a [[camera]]"))?;
        Ok(Argument::Name(item.text()?.to_owned()))
    }

    fn read_beam(&mut self, key: &str) -> Result<Argument, InputError> {
        let item = self.section.require(key, &format!("{key} = \"…\", the name of a beam"))?;
        let link = item.text()?.to_owned();
        let links = beam_names(self.joints);
        if links.contains(&link) {
            Ok(Argument::Name(link))
        } else {
            Err(item.error(InputErrorKind::UnknownLink { link, links }))
        }
    }

    /// Reads the orders of harmonics: at least one, without duplicates.
    fn read_orders(&mut self, key: &str) -> Result<Argument, InputError> {
        let item = self.section.require(key, &format!("{key} = [1], the harmonics"))?;
        let mut orders = Vec::new();
        let elements = item.list("a list of whole numbers")?;
        item.check_count("orders", elements.len(), MAX_ORDERS)?;
        for element in elements {
            let order = u32::from(element.small()?);
            if orders.contains(&order) {
                return Err(element.error(InputErrorKind::RepeatedOrder { order }));
            }
            orders.push(order);
        }
        if orders.is_empty() {
            return Err(item.error(InputErrorKind::NoOrders));
        }
        Ok(Argument::Orders(orders))
    }

    /// Reads the order of a wave in cycles per revolution, which must be above zero.
    fn read_order(&mut self, key: &str) -> Result<Argument, InputError> {
        let item = self.section.require(key, &format!("{key} = 7.5, cycles a revolution"))?;
        let order = item.number()?;
        if order > 0.0 && order <= HIGHEST_ORDER {
            Ok(Argument::Number(order))
        } else {
            Err(item.error(InputErrorKind::NotAnOrder { order, highest: HIGHEST_ORDER }))
        }
    }

    fn read_time(&mut self, key: &str) -> Result<Argument, InputError> {
        let base = without_suffix(key, Unit::Time);
        let time = self.section.number(base, Unit::Time)?;
        time.map(Argument::Number)
            .ok_or_else(|| self.section.missing(base, Unit::Time.alternatives(base)))
    }

    fn read_positive(&mut self, key: &str, unit: Unit) -> Result<Argument, InputError> {
        let base = without_suffix(key, unit);
        let found =
            self.section.positive(base, unit, |value| InputErrorKind::NotPositive { value })?;
        found
            .map(Argument::Number)
            .ok_or_else(|| self.section.missing(base, unit.alternatives(base)))
    }

    /// Reads the end point of a spring: x and y in the plane normal to the joint's axis, not on the
    /// axis.
    fn read_point(&mut self, key: &str) -> Result<Argument, InputError> {
        let base = without_suffix(key, Unit::Length);
        let Some((item, suffix)) = self.section.quantity(base, Unit::Length)? else {
            return Err(self.section.missing(base, Unit::Length.alternatives(base)));
        };
        let [x, y] = item.pair()?.map(suffix.to_si);
        if x.hypot(y) > 0.0 {
            Ok(Argument::Point([x, y]))
        } else {
            Err(item.error(InputErrorKind::OnTheAxis))
        }
    }

    fn read_free_length(&mut self, key: &str) -> Result<Argument, InputError> {
        let base = without_suffix(key, Unit::Length);
        let found = self.section.non_negative_number(base, Unit::Length)?;
        found
            .map(Argument::Length)
            .ok_or_else(|| self.section.missing(base, Unit::Length.alternatives(base)))
    }
}

/// Returns a key without the suffix of its SI unit.
fn without_suffix(key: &str, unit: Unit) -> &str {
    let suffix = unit.si_suffix();
    key.strip_suffix(suffix).and_then(|key| key.strip_suffix('_')).unwrap_or(key)
}

impl ArgumentKind {
    /// Returns an example argument of this kind for the arm of `problem`, in TOML syntax.
    pub(super) fn example(self, problem: &Problem) -> String {
        let joints = &problem.joints;
        let moving = || {
            let takes = |(_, joint): &(usize, &Joint)| joint.takes_command();
            (1..).zip(joints).filter(takes)
        };
        let first = moving().next().map_or(1, |(number, _)| number);
        let first_of = |is_it: fn(&Joint) -> bool| {
            let found = moving().find(|(_, joint)| is_it(joint));
            found.map(|(number, _)| number)
        };
        let turning = || first_of(|joint| joint.kind == JointKind::Revolute).unwrap_or(first);
        match self {
            Self::AnyJoint | Self::MovingJoint | Self::Mount => first.to_string(),
            Self::OtherJoint => moving().nth(1).map_or(first + 1, |(number, _)| number).to_string(),
            Self::TurningJoint => turning().to_string(),
            Self::RelievedJoint => {
                let gives =
                    |joint: &Joint| joint.kind == JointKind::Revolute && joint.stiffness.is_some();
                first_of(gives).unwrap_or_else(turning).to_string()
            }
            Self::SlidingJoint => {
                first_of(|joint| joint.kind == JointKind::Prismatic).unwrap_or(first).to_string()
            }
            Self::LinkedJoint => {
                let long = (1..).zip(joints).find(|(_, joint)| joint.a != 0.0);
                long.map_or(first, |(number, _)| number).to_string()
            }
            Self::LoadedJoint => {
                let carries = |joint: &Joint| Body::total_mass(&joint.bodies) > 0.0;
                let loaded = (1..).zip(joints).find(|(_, joint)| carries(joint));
                loaded.map_or(first, |(number, _)| number).to_string()
            }
            Self::Covariate => {
                let covariate = problem.data.covariates.first();
                quoted(covariate.map_or("tilt_deg", |covariate| &covariate.name))
            }
            Self::Camera => {
                let camera = problem.fixtures.iter().find(|of| of.kind.word() == "camera");
                quoted(camera.map_or("hand", |camera| &camera.name))
            }
            Self::Beam => {
                let beam = joints.iter().find_map(|joint| joint.beam.as_ref());
                quoted(beam.map_or("A", |beam| &beam.name))
            }
            Self::Orders => "[1]".to_owned(),
            Self::Order => "7.5".to_owned(),
            Self::Time | Self::Duration => "600.0".to_owned(),
            Self::Distance => "0.8".to_owned(),
            Self::Point => "[0.0, 0.5]".to_owned(),
            Self::FreeLength => "0.3".to_owned(),
        }
    }
}
