//! Factors of terms: functions of one or two quantities of a pose, some with an inner parameter.

use super::quantities::{Quantities, quoted};

/// Trial values of k = 2ab/(a² + b²) of a gas spring whose pivots lie at the distances a and b from
/// the joint.
pub const STRUT_RATIOS: [f64; 3] = [0.4, 0.65, 0.85];

/// Part of the arm or of the measurement at which formulas are searched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FormulaSite {
    /// Coordinate of a joint, counted from 0.
    Joint(usize),
    /// Curvature or strain of a link.
    Link,
    /// Tool, measurement, base, or a small motion of a joint.
    Elsewhere,
}

/// Function of one or two quantities of a pose, from which formulas are built; joints are counted
/// from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Form {
    /// Command q of a joint.
    Command(usize),
    /// Squared command q² of a joint.
    Square(usize),
    /// Kink |q − c| in the command of a joint at an inner parameter c.
    Kink(usize),
    /// Single wave sin(kq) or cos(kq) of a joint's command q with the integer order k.
    Wave {
        /// Joint, counted from 0.
        joint: usize,
        /// Order k.
        order: u32,
        /// True for the cosine, false for the sine of the command.
        cosine: bool,
    },
    /// Pair sin(kq) and cos(kq), each with a coefficient.
    Harmonic {
        /// Joint, counted from 0.
        joint: usize,
        /// Order k.
        order: u32,
    },
    /// Moment of a spring of constant force, a gas spring: sin(q − c)/√(1 + k cos(q − c)) of a
    /// joint's command. The inner parameter c is the angle at which its two pivots and the joint
    /// are in line.
    Strut {
        /// Joint, counted from 0.
        joint: usize,
        /// Index in [`STRUT_RATIOS`] of k = 2ab/(a² + b²), the ratio of the lever lengths a and b
        /// of the gas spring.
        ratio: usize,
    },
    /// Wave sin(a q + b q') or cos(a q + b q') of two joints' commands.
    OfSum {
        /// Joints with the commands q and q' of the wave sin(a q + b q'), counted from 0.
        joints: [usize; 2],
        /// Factors a and b of the wave sin(a q + b q') of two commands.
        factors: [i32; 2],
        /// True for the cosine, false for the sine of the sum of commands.
        cosine: bool,
    },
    /// Side from which a joint approached the pose, −1 to 1.
    Side(usize),
    /// Moment of the loads about a joint's axis \[N·m\].
    Moment(usize),
    /// Cube of the moment of the loads about a joint's axis.
    CubicMoment(usize),
    /// Sign of the moment of the loads about a joint's axis: −1, 0 or 1.
    MomentSign(usize),
    /// Temperature above the reference \[K\].
    Warming,
    /// Square of the temperature above the reference.
    WarmingSquare,
    /// Temperature above the reference, lagged by a first-order filter \[K\].
    Lag,
    /// Time since the first pose, as a fraction of the measured duration.
    Elapsed,
    /// Settling 1 − exp(−t/τ) with an inner parameter τ, a fraction of the measured duration as t
    /// is.
    Settling,
    /// Step in time: 0 before and 1 from the inner parameter on, a fraction of the measured
    /// duration.
    Step,
    /// Mass of the payload \[kg\].
    Payload,
    /// Square of the payload's mass.
    PayloadSquare,
    /// Declared covariate, by its index among those that vary.
    Covariate(usize),
}

/// Form with the value of its inner parameter and its prior probability.
#[derive(Debug, Clone)]
pub struct Factor {
    /// Function of the pose.
    pub form: Form,
    /// Value of the inner parameter and distance to the next trial value; `None` if the form has
    /// none.
    pub inner: Option<(f64, f64)>,
    /// ln of the prior probability of the factor among all factors.
    pub ln_prior: f64,
}

impl Form {
    /// Returns the form, for a gas spring with the first trial ratio. The ratio is fitted, so
    /// springs that differ in their trial ratios alone are the same.
    pub fn with_first_ratio(self) -> Self {
        match self {
            Self::Strut { joint, .. } => Self::Strut { joint, ratio: 0 },
            other => other,
        }
    }

    /// Returns the index of the form's family. All families have the same prior probability.
    pub fn family(self) -> usize {
        match self {
            Self::Command(_) => 0,
            Self::Square(_) => 1,
            Self::Kink(_) => 2,
            Self::Wave { .. } | Self::Harmonic { .. } | Self::Strut { .. } => 3,
            Self::OfSum { .. } => 4,
            Self::Side(_) => 5,
            Self::Moment(_) => 6,
            Self::CubicMoment(_) => 7,
            Self::MomentSign(_) => 8,
            Self::Warming => 9,
            Self::WarmingSquare => 10,
            Self::Lag => 11,
            Self::Elapsed => 12,
            Self::Settling => 13,
            Self::Step => 14,
            Self::Payload => 15,
            Self::PayloadSquare => 16,
            Self::Covariate(_) => 17,
        }
    }

    /// Returns the number of columns of the form: 2 for a harmonic, else 1.
    pub fn width(self) -> usize {
        if matches!(self, Self::Harmonic { .. }) { 2 } else { 1 }
    }

    /// Returns true if the square of the form is a constant or the form itself, as of signs and
    /// steps. A product with itself is then redundant.
    pub fn is_idempotent(self) -> bool {
        matches!(self, Self::Side(_) | Self::MomentSign(_) | Self::Step)
    }

    /// Returns true for a quantity that describes the conditions of a pose: temperature, time,
    /// payload or a declared covariate.
    pub fn is_condition(self) -> bool {
        matches!(
            self,
            Self::Warming
                | Self::WarmingSquare
                | Self::Lag
                | Self::Elapsed
                | Self::Settling
                | Self::Step
                | Self::Payload
                | Self::PayloadSquare
                | Self::Covariate(_)
        )
    }

    /// Returns true if the catalogue contains this form alone as an effect at `place`.
    pub fn is_catalogued(self, place: FormulaSite) -> bool {
        match (place, self) {
            (FormulaSite::Joint(_), Self::Command(_) | Self::Covariate(_) | Self::Lag)
            | (FormulaSite::Joint(_) | FormulaSite::Link, Self::Warming) => true,
            (
                FormulaSite::Joint(joint),
                Self::Harmonic { joint: of, .. }
                | Self::Wave { joint: of, .. }
                | Self::Side(of)
                | Self::Moment(of)
                | Self::CubicMoment(of),
            ) => of == joint,
            _ => false,
        }
    }

    /// Returns the values of the form in every pose, one list for each column, with `inner` as its
    /// inner parameter.
    pub fn columns(self, quantities: &Quantities, inner: f64) -> Vec<Vec<f64>> {
        let of = |values_of_joints: &[(usize, Vec<f64>)], joint: usize, f: &dyn Fn(f64) -> f64| {
            let values = values_of_joints.iter().find(|(other, _)| *other == joint);
            values.map_or_else(Vec::new, |(_, values)| values.iter().map(|x| f(*x)).collect())
        };
        let plain = |values: &Option<Vec<f64>>, f: &dyn Fn(f64) -> f64| {
            values.iter().flatten().map(|x| f(*x)).collect()
        };
        let time = |f: &dyn Fn(f64) -> f64| {
            let values = quantities.elapsed.iter().flat_map(|(values, _)| values);
            values.map(|t| f(*t)).collect()
        };
        let q = &quantities.commands;
        let wave = |joint: usize, order: u32, cosine: bool| {
            of(q, joint, &|x| trigonometric(f64::from(order) * x, cosine))
        };
        vec![match self {
            Self::Command(joint) => of(q, joint, &|x| x),
            Self::Square(joint) => of(q, joint, &|x| x * x),
            Self::Kink(joint) => of(q, joint, &|x| (x - inner).abs()),
            Self::Wave { joint, order, cosine } => wave(joint, order, cosine),
            Self::Harmonic { joint, order } => {
                return vec![wave(joint, order, false), wave(joint, order, true)];
            }
            Self::Strut { joint, ratio } => of(q, joint, &|x| {
                let (sin, cos) = (x - inner).sin_cos();
                sin / (1.0 + STRUT_RATIOS[ratio] * cos).sqrt()
            }),
            Self::OfSum { joints, factors, cosine } => {
                let [one, other] = joints.map(|joint| of(q, joint, &|x| x));
                let [a, b] = factors.map(f64::from);
                one.iter().zip(&other).map(|(x, y)| trigonometric(a * x + b * y, cosine)).collect()
            }
            Self::Side(joint) => of(&quantities.sides, joint, &|x| x),
            Self::Moment(joint) => of(&quantities.moments, joint, &|x| x),
            Self::CubicMoment(joint) => of(&quantities.moments, joint, &|x| x.powi(3)),
            Self::MomentSign(joint) => {
                of(&quantities.moments, joint, &|x| if x == 0.0 { 0.0 } else { x.signum() })
            }
            Self::Warming => plain(&quantities.warming, &|x| x),
            Self::WarmingSquare => plain(&quantities.warming, &|x| x * x),
            Self::Lag => quantities.lag.iter().flat_map(|(_, values)| values).copied().collect(),
            Self::Elapsed => time(&|t| t),
            Self::Settling => time(&|t| -(-t / inner.max(0.02)).exp_m1()),
            Self::Step => time(&|t| f64::from(t >= inner)),
            Self::Payload => plain(&quantities.payload, &|x| x),
            Self::PayloadSquare => plain(&quantities.payload, &|x| x * x),
            Self::Covariate(k) => {
                quantities.covariates.get(k).map(|(_, values)| values.clone()).unwrap_or_default()
            }
        }]
    }

    /// Returns the formula of each column as text. `inner` is the name or the value of the inner
    /// parameter, `ratio` the name of the ratio of a gas spring.
    pub fn texts(self, quantities: &Quantities, inner: &str, ratio: &str) -> Vec<String> {
        let q = |joint: usize| format!("q{}", joint + 1);
        let angle = |joint: usize, order: u32| match order {
            1 => q(joint),
            order => format!("{order}*{}", q(joint)),
        };
        let of = |cosine: bool, angle: String| {
            format!("{}({angle})", if cosine { "cos" } else { "sin" })
        };
        vec![match self {
            Self::Command(joint) => q(joint),
            Self::Square(joint) => format!("{}^2", q(joint)),
            Self::Kink(joint) => format!("abs({} - {inner})", q(joint)),
            Self::Wave { joint, order, cosine } => of(cosine, angle(joint, order)),
            Self::Harmonic { joint, order } => {
                return [false, true].map(|cosine| of(cosine, angle(joint, order))).to_vec();
            }
            Self::Strut { joint, .. } => {
                let angle = format!("{} - {inner}", q(joint));
                format!("sin({angle})/sqrt(1 + {ratio}*cos({angle}))")
            }
            Self::OfSum { joints, factors, cosine } => {
                let [first, second] = joints.map(q);
                of(
                    cosine,
                    match factors {
                        [1, 1] => format!("{first} + {second}"),
                        [1, -1] => format!("{first} - {second}"),
                        [2, 1] => format!("2*{first} + {second}"),
                        [1, 2] => format!("{first} + 2*{second}"),
                        [2, -1] => format!("2*{first} - {second}"),
                        [1, -2] => format!("{first} - 2*{second}"),
                        [a, b] => format!("{a}*{first} + {b}*{second}"),
                    },
                )
            }
            Self::Side(joint) => format!("approach{}", joint + 1),
            Self::Moment(joint) => format!("M{}", joint + 1),
            Self::CubicMoment(joint) => format!("M{}^3", joint + 1),
            Self::MomentSign(joint) => format!("sign(M{})", joint + 1),
            Self::Warming => "T".to_owned(),
            Self::WarmingSquare => "T^2".to_owned(),
            Self::Lag => format!("lag(T, {})", quantities.lag.as_ref().map_or(0.0, |lag| lag.0)),
            Self::Elapsed => "t".to_owned(),
            Self::Settling => format!("(1 - exp(-t/{inner}))"),
            Self::Step => format!("step(t - {inner})"),
            Self::Payload => "payload".to_owned(),
            Self::PayloadSquare => "payload^2".to_owned(),
            Self::Covariate(k) => {
                let name = quantities.covariates.get(k).and_then(|(k, _)| quantities.names.get(*k));
                quoted(name.map_or("", |name| name))
            }
        }]
    }
}

fn trigonometric(angle: f64, cosine: bool) -> f64 {
    if cosine { angle.cos() } else { angle.sin() }
}
