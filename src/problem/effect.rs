//! The catalogue's effects, declared in one table: names, arguments, reading and writing follow
//! from it.
//!
//! What an effect does is said by its family in `model::effect`.

use std::any::Any;
use std::fmt;
use std::sync::Arc;

use serde::ser::{Serialize, SerializeMap, Serializer};

use super::argument::{Argument, Examples, FreeLength, Mount, Reader};
use super::{Data, Equilibrium, Joint, Problem, Statics};
use crate::error::{InputError, InputErrorKind, Location};

/// One `[[effect]]` and where it stands in the file.
#[derive(Debug, Clone)]
pub struct EffectDeclaration {
    /// The effect.
    pub effect: Effect,
    /// For errors.
    pub location: Location,
}

/// The key of an argument: its name, or what stands behind `as`.
macro_rules! key {
    ($field:ident) => {
        stringify!($field)
    };
    ($field:ident $key:literal) => {
        $key
    };
}

/// From lines `Variant "name-in-files" { field: Type = kind }`; the kinds are methods of [`Reader`]
/// and [`Examples`].
macro_rules! effects {
    ($(
        $(#[$doc:meta])*
        $variant:ident $name:literal $({ $($field:ident: $type:ty = $kind:ident $(as $key:literal)?),+ })?
    )+) => {
        /// An effect and its arguments; joints are numbered from 1 as in files, links go by the
        /// name of their beam.
        #[derive(Debug, Clone, PartialEq)]
        #[non_exhaustive]
        #[expect(missing_docs, reason = "arguments carry the names of the file format")]
        pub enum Effect {
            $($(#[$doc])* $variant $({ $($field: $type),+ })?,)+
            /// One that no catalogue holds: a law of one's own (`model::effect::CustomEffect`).
            Custom(Custom),
        }

        /// Names of the effects in files.
        pub(crate) const NAMES: &[&str] = &[$($name),+];

        impl Effect {
            /// Name in files.
            pub fn name(&self) -> &str {
                match self {
                    $(Self::$variant $({ $($field: _),+ })? => $name,)+
                    Self::Custom(own) => &own.name,
                }
            }

            /// Arguments by key, in the order of the files; the place of a custom effect, unless
            /// that is the whole arm.
            pub fn arguments(&self) -> Vec<(&'static str, Argument)> {
                match self {
                    $(Self::$variant $({ $($field),+ })? => {
                        vec![$($(keyed(key!($field $($key)?), $field.into())),+)?]
                    })+
                    Self::Custom(own) if own.place.is_empty() => Vec::new(),
                    Self::Custom(own) => vec![("place", Argument::Name(own.place.clone()))],
                }
            }

            /// The effect of that name with its arguments; `None` where no effect is called so.
            pub(super) fn read(name: &str, arguments: &mut Reader<'_, '_, '_>) -> Result<Option<Self>, InputError> {
                Ok(Some(match name {
                    $($name => Self::$variant $({ $($field: arguments.$kind(key!($field $($key)?))?),+ })?,)+
                    _ => return Ok(None),
                }))
            }
        }

        /// How the effect of that name may be declared on an arm: `gear-ratio = { joint = 1 }`.
        pub(crate) fn example(name: &str, problem: &Problem) -> String {
            let examples = Examples::new(problem);
            let arguments: Vec<(&str, String)> = match name {
                $($name => vec![$($((key!($field $($key)?), examples.$kind())),+)?],)+
                _ => Vec::new(),
            };
            declaration(name, &arguments)
        }
    };
}

effects! {
    /// A joint declared rigid turns by Δθ = c `M_z`.
    JointCompliance "joint-compliance" { joint: usize = any_joint }
    /// Δθ = Σₖ aₖ sin kθ + bₖ cos kθ, with θ = q as commanded.
    JointHarmonic "joint-harmonic" { joint: usize = moving_joint, orders: Vec<u32> = orders }
    /// Δθ = a sin kθ + b cos kθ of an order k that need be no whole number, with θ = q as
    /// commanded.
    JointWave "joint-wave" { joint: usize = moving_joint, order: f64 = order }
    /// Δθ = ε θ, with θ = q as commanded.
    GearRatio "gear-ratio" { joint: usize = moving_joint }
    /// Δθ = (b/2)·approach; without directions of approach the moment decides.
    Backlash "backlash" { joint: usize = moving_joint }
    /// Play that opens with the payload m: Δθ = (w m / 2)·approach.
    PayloadBacklash "payload-backlash" { joint: usize = moving_joint }
    /// Friction pulls the joint back the way on which it came, Δθ = h z with dz/dθ = (g − z)/s, g =
    /// ±1 the side from which it comes.
    JointHysteresis "joint-hysteresis" { joint: usize = turning_joint, distance: f64 = way as "distance_rad" }
    /// Δθ = c₃ `M_z`³ beyond the linear torsion.
    JointNonlinearStiffness "joint-nonlinear-stiffness" { joint: usize = any_joint }
    /// Bearings tilt by (`c_x` `M_x`, `c_y` `M_y`, 0) before the joint turns.
    JointLateralCompliance "joint-lateral-compliance" { joint: usize = any_joint }
    /// A spring from an anchor before the joint to a lever on the link behind it pulls the two
    /// together: with a moment about the axis.
    GravityCompensator "gravity-compensator" {
        joint: usize = relieved_joint,
        anchor: [f64; 2] = arm as "anchor_m",
        lever: [f64; 2] = arm as "lever_m",
        free_length: FreeLength = free_length as "free_length_m"
    }
    /// Δθ = k (T − T₀).
    JointThermalDrift "joint-thermal-drift" { joint: usize = moving_joint }
    /// Δθ = k (T̃ − T₀) with a temperature that lags, dT̃/dt = (T − T̃)/τ.
    JointThermalDriftLag "joint-thermal-drift-lag" { joint: usize = moving_joint, time_constant: f64 = duration as "time_constant_s" }
    /// Δθ of one joint = k q of another.
    JointCoupling "joint-coupling" { joint: usize = moving_joint, from: usize = other_joint }
    /// Flexibility 1/EI of a link declared rigid.
    LinkBending "link-bending" { joint: usize = linked_joint }
    /// Flexibility 1/EI of the slide of a prismatic joint, a cantilever as long as it is out.
    SlideBending "slide-bending" { joint: usize = sliding_joint }
    /// Torsional moments bend a beam by (`k_y`, `k_z`), and bending moments twist it by as much.
    TwistBending "twist-bending" { link: String = beam }
    /// Curvature (`k_y`, `k_z`)·(T − T₀) along a beam.
    LinkThermalBending "link-thermal-bending" { link: String = beam }
    /// Strain α (T − T₀) of a beam.
    LinkThermalExpansion "link-thermal-expansion" { link: String = beam }
    /// Curvature (`k_y`, `k_z`)·(T̃ − T₀) along a beam whose temperature lags.
    LinkThermalBendingLag "link-thermal-bending-lag" { link: String = beam, time_constant: f64 = duration as "time_constant_s" }
    /// Strain α (T̃ − T₀) of a beam whose temperature lags.
    LinkThermalExpansionLag "link-thermal-expansion-lag" { link: String = beam, time_constant: f64 = duration as "time_constant_s" }
    /// A mass m at s along a beam.
    UnmodelledMass "unmodelled-mass" { link: String = beam }
    /// The payload is heavier by m whenever one is carried.
    PayloadMass "payload-mass"
    /// The rope pulls with F (1 + k).
    HoistForce "hoist-force"
    /// The rope leans.
    HoistDirection "hoist-direction"
    /// The base turns by (`C_x` `M_x`, `C_y` `M_y`, 0) under the moments at the base.
    BaseCompliance "base-compliance"
    /// Gravity is turned by (`r_x`, `r_y`, 0).
    GravityDirection "gravity-direction"
    /// λ from 0, loads on the rigid arm, to 1, loads on the bent arm.
    DeflectedEquilibrium "deflected-equilibrium"
    /// Measured positions are scaled by 1 + s.
    TrackerScale "tracker-scale"
    /// Positions are measured as p + E p, E upper triangular: scales and squareness of the axes.
    FrameStrain "frame-strain"
    /// Measured positions move by v (t − `t_first`).
    TrackerDrift "tracker-drift"
    /// Measured positions are moved by d from a time on.
    StationShift "station-shift" { at_time: f64 = time as "at_time_s" }
    /// Measured positions are turned by (`r_x`, `r_y`, `r_z`) and moved by d from a time on.
    StationMove "station-move" { at_time: f64 = time as "at_time_s" }
    /// Measured positions move by d (1 − exp(−(t − `t_first`)/τ)).
    TrackerSettling "tracker-settling" { time_constant: f64 = duration as "time_constant_s" }
    /// Δθ of a joint, or a small motion of the base, in proportion to one of the problem's own
    /// covariates.
    Covariate "covariate" { joint: Mount = mount, of: String = covariate }
}

/// An argument with its key.
fn keyed(field: &'static str, argument: Argument) -> (&'static str, Argument) {
    (argument.key(field), argument)
}

/// `name = { key = value }`; without arguments `name = true`.
fn declaration(name: &str, arguments: &[(&str, String)]) -> String {
    let all: Vec<String> =
        arguments.iter().map(|(key, value)| format!("{key} = {value}")).collect();
    match all.join(", ") {
        none if none.is_empty() => format!("{name} = true"),
        all => format!("{name} = {{ {all} }}"),
    }
}

impl Effect {
    /// Where it is, as its parameters' names say it in brackets: a joint's number, a link, a time;
    /// empty for the whole.
    pub fn place(&self) -> String {
        self.arguments()
            .iter()
            .filter_map(|(_, argument)| argument.place())
            .collect::<Vec<_>>()
            .join(",")
    }

    /// As a problem declares it: `gear-ratio = { joint = 3 }`.
    pub fn declaration(&self) -> String {
        let arguments: Vec<_> =
            self.arguments().iter().map(|(key, argument)| (*key, argument.toml())).collect();
        declaration(self.name(), &arguments)
    }

    /// Whether it is one of one's own, which no file can declare.
    pub fn is_custom(&self) -> bool {
        matches!(self, Self::Custom(_))
    }

    /// Whether it follows the temperature.
    pub fn is_thermal(&self) -> bool {
        matches!(
            self,
            Self::JointThermalDrift { .. }
                | Self::LinkThermalBending { .. }
                | Self::LinkThermalExpansion { .. }
        ) || self.lags()
    }

    /// Whether it follows a temperature that lags.
    fn lags(&self) -> bool {
        matches!(
            self,
            Self::JointThermalDriftLag { .. }
                | Self::LinkThermalBendingLag { .. }
                | Self::LinkThermalExpansionLag { .. }
        )
    }

    /// The covariate of one's own that it follows.
    pub fn covariate(&self) -> Option<&str> {
        match self {
            Self::Covariate { of, .. } => Some(of),
            _ => None,
        }
    }

    /// The joint, from 1, whose load it takes off by a spring.
    pub(crate) fn compensated(&self) -> Option<usize> {
        match self {
            Self::GravityCompensator { joint, .. } => Some(*joint),
            _ => None,
        }
    }

    /// Whether it depends on the side from which joints come.
    pub fn has_sides(&self) -> bool {
        matches!(
            self,
            Self::Backlash { .. } | Self::PayloadBacklash { .. } | Self::JointHysteresis { .. }
        )
    }

    /// Whether it follows time, or the order of the poses, rather than what poses can be chosen
    /// for.
    pub fn follows_time(&self) -> bool {
        let moves = matches!(self, Self::StationShift { .. } | Self::StationMove { .. });
        moves
            || matches!(self, Self::TrackerDrift | Self::TrackerSettling { .. })
            || self.has_memory()
    }

    /// Whether it depends on the poses before.
    pub fn has_memory(&self) -> bool {
        self.lags() || matches!(self, Self::JointHysteresis { .. })
    }

    /// An order that this and another harmonic of one joint share; a wave of a whole order is a
    /// harmonic.
    pub(super) fn shared_order(&self, other: &Self) -> Option<u32> {
        match (self, other) {
            (
                Self::JointHarmonic { joint, orders },
                Self::JointHarmonic { joint: own, orders: more },
            ) if joint == own => more.iter().find(|order| orders.contains(order)).copied(),
            (Self::JointHarmonic { joint, orders }, Self::JointWave { joint: own, order })
            | (Self::JointWave { joint: own, order }, Self::JointHarmonic { joint, orders })
                if joint == own =>
            {
                orders.iter().copied().find(|&whole| f64::from(whole).total_cmp(order).is_eq())
            }
            _ => None,
        }
    }

    /// Why it could never act on this arm: the declared model has it already, or has nothing for it
    /// to act on.
    pub(crate) fn refusal(
        &self,
        statics: Statics,
        joints: &[Joint],
        data: &Data,
    ) -> Option<InputErrorKind> {
        let hoisted = || {
            joints.iter().any(|joint| joint.beam.as_ref().is_some_and(|beam| beam.hoist.is_some()))
        };
        match self {
            Self::LinkBending { joint }
                if joints.get(joint.wrapping_sub(1)).is_none_or(|own| own.a == 0.0) =>
            {
                Some(InputErrorKind::NoLink { joint: *joint })
            }
            Self::DeflectedEquilibrium if statics.equilibrium == Equilibrium::Deflected => {
                Some(InputErrorKind::InEquilibriumAlready)
            }
            Self::HoistForce | Self::HoistDirection if !hoisted() => Some(InputErrorKind::NoHoist),
            Self::Covariate { of, .. } if !data.covariates.iter().any(|own| own.name == *of) => {
                let known = data.covariates.iter().map(|own| own.name.clone()).collect();
                Some(InputErrorKind::UnknownCovariate { name: of.clone(), known })
            }
            effect if effect.is_thermal() && data.reference_temperature.is_none() => {
                Some(InputErrorKind::NeedsTemperature {
                    write: "reference_temperature_C in [data]",
                })
            }
            _ => None,
        }
    }
}

/// `{"effect": "gear-ratio", "joint": 3}`.
impl Serialize for Effect {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let arguments = self.arguments();
        let mut map = serializer.serialize_map(Some(1 + arguments.len()))?;
        map.serialize_entry("effect", self.name())?;
        for (key, argument) in &arguments {
            map.serialize_entry(key, argument)?;
        }
        map.end()
    }
}

/// An effect of one's own, made by `Effect::custom`; two are the same where name and place are.
#[derive(Clone)]
pub struct Custom {
    name: String,
    place: String,
    law: Arc<dyn Any + Send + Sync>,
}

impl Custom {
    /// Name, place (empty for the whole arm), and what the model makes of it.
    pub(crate) fn new(name: String, place: String, law: Arc<dyn Any + Send + Sync>) -> Self {
        Self { name, place, law }
    }

    /// What the model makes of it.
    pub(crate) fn law(&self) -> &(dyn Any + Send + Sync) {
        &*self.law
    }
}

impl fmt::Debug for Custom {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?} at {:?}", self.name, self.place)
    }
}

impl PartialEq for Custom {
    fn eq(&self, other: &Self) -> bool {
        (&self.name, &self.place) == (&other.name, &other.place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn effects_are_written_as_they_are_read() {
        assert_eq!(Effect::GearRatio { joint: 3 }.declaration(), "gear-ratio = { joint = 3 }");
        assert_eq!(Effect::HoistForce.declaration(), "hoist-force = true");
        assert_eq!(
            Effect::StationShift { at_time: 600.0 }.declaration(),
            "station-shift = { at_time_s = 600.0 }"
        );
        let harmonic = Effect::JointHarmonic { joint: 2, orders: vec![1, 4] };
        let json = r#"{"effect":"joint-harmonic","joint":2,"orders":[1,4]}"#;
        assert_eq!(serde_json::to_string(&harmonic).ok().as_deref(), Some(json));
    }
}
