//! Factors of terms: functions of one or two quantities, with the parameter inside of some.

use super::quantities::{Quantities, quoted};

/// Function of what is known of a pose; joints are counted from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Form {
    /// q.
    Command(usize),
    /// q².
    Square(usize),
    /// |q − c|.
    Kink(usize),
    /// sin kq or cos kq.
    Wave {
        /// The joint.
        joint: usize,
        /// Order k.
        order: u32,
        /// True for a cosine.
        cosine: bool,
    },
    /// sin kq and cos kq, each with a coefficient.
    Harmonic {
        /// The joint.
        joint: usize,
        /// Order k.
        order: u32,
    },
    /// sin or cos of a q + b q'.
    OfSum {
        /// The joints.
        joints: [usize; 2],
        /// Factors a and b.
        factors: [i32; 2],
        /// True for a cosine.
        cosine: bool,
    },
    /// Side from which a joint came.
    Side(usize),
    /// Moment of the loads about a joint's axis.
    Moment(usize),
    /// Cube of that moment.
    CubicMoment(usize),
    /// Sign of that moment.
    MomentSign(usize),
    /// Temperature above the reference.
    Warming,
    /// Its square.
    WarmingSquare,
    /// Lagged temperature above the reference.
    Lag,
    /// Time since the first pose.
    Elapsed,
    /// 1 − exp(−t/τ).
    Settling,
    /// 1 from a time on.
    Step,
    /// Payload.
    Payload,
    /// Its square.
    PayloadSquare,
    /// Covariate, by its place among those that vary.
    Covariate(usize),
}

/// A form with the value of the parameter inside and its prior probability.
#[derive(Debug, Clone)]
pub struct Factor {
    /// The function.
    pub form: Form,
    /// Value of the parameter inside and its distance from the next value tried.
    pub inner: Option<(f64, f64)>,
    /// ln of its prior probability among all factors.
    pub ln_prior: f64,
}

impl Form {
    /// Returns a number that forms of one kind share, for their prior.
    pub fn family(self) -> usize {
        match self {
            Self::Command(_) => 0,
            Self::Square(_) => 1,
            Self::Kink(_) => 2,
            Self::Wave { .. } | Self::Harmonic { .. } => 3,
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

    /// Returns the number of columns.
    pub fn width(self) -> usize {
        if matches!(self, Self::Harmonic { .. }) { 2 } else { 1 }
    }

    /// Returns true if a product with itself says nothing new: of signs and steps.
    pub fn is_idempotent(self) -> bool {
        matches!(self, Self::Side(_) | Self::MomentSign(_) | Self::Step)
    }

    /// Returns true if the catalogue has an effect of this form alone at the coordinate of `joint`.
    pub fn is_catalogued(self, joint: usize) -> bool {
        match self {
            Self::Command(_) | Self::Warming | Self::Lag | Self::Covariate(_) => true,
            Self::Harmonic { joint: of, .. }
            | Self::Wave { joint: of, .. }
            | Self::Side(of)
            | Self::Moment(of)
            | Self::CubicMoment(of) => of == joint,
            _ => false,
        }
    }

    /// Returns the columns with `inner` as the parameter inside.
    pub fn columns(self, known: &Quantities, inner: f64) -> Vec<Vec<f64>> {
        let of = |all: &[(usize, Vec<f64>)], joint: usize, f: &dyn Fn(f64) -> f64| {
            let values = all.iter().find(|(known, _)| *known == joint);
            values.map_or_else(Vec::new, |(_, values)| values.iter().map(|x| f(*x)).collect())
        };
        let plain = |values: &Option<Vec<f64>>, f: &dyn Fn(f64) -> f64| {
            values.iter().flatten().map(|x| f(*x)).collect()
        };
        let time = |f: &dyn Fn(f64) -> f64| {
            let values = known.elapsed.iter().flat_map(|(values, _)| values);
            values.map(|t| f(*t)).collect()
        };
        let q = &known.commands;
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
            Self::OfSum { joints, factors, cosine } => {
                let [one, other] = joints.map(|joint| of(q, joint, &|x| x));
                let [a, b] = factors.map(f64::from);
                one.iter().zip(&other).map(|(x, y)| trigonometric(a * x + b * y, cosine)).collect()
            }
            Self::Side(joint) => of(&known.sides, joint, &|x| x),
            Self::Moment(joint) => of(&known.moments, joint, &|x| x),
            Self::CubicMoment(joint) => of(&known.moments, joint, &|x| x.powi(3)),
            Self::MomentSign(joint) => {
                of(&known.moments, joint, &|x| if x == 0.0 { 0.0 } else { x.signum() })
            }
            Self::Warming => plain(&known.warming, &|x| x),
            Self::WarmingSquare => plain(&known.warming, &|x| x * x),
            Self::Lag => known.lag.iter().flat_map(|(_, values)| values).copied().collect(),
            Self::Elapsed => time(&|t| t),
            Self::Settling => time(&|t| -(-t / inner.max(0.02)).exp_m1()),
            Self::Step => time(&|t| f64::from(t >= inner)),
            Self::Payload => plain(&known.payload, &|x| x),
            Self::PayloadSquare => plain(&known.payload, &|x| x * x),
            Self::Covariate(k) => {
                known.covariates.get(k).map(|(_, values)| values.clone()).unwrap_or_default()
            }
        }]
    }

    /// Returns the formulas of its columns; `inner` is the name or the number of the parameter
    /// inside.
    pub fn texts(self, known: &Quantities, inner: &str) -> Vec<String> {
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
            Self::Lag => format!("lag(T, {})", known.lag.as_ref().map_or(0.0, |lag| lag.0)),
            Self::Elapsed => "t".to_owned(),
            Self::Settling => format!("(1 - exp(-t/{inner}))"),
            Self::Step => format!("step(t - {inner})"),
            Self::Payload => "payload".to_owned(),
            Self::PayloadSquare => "payload^2".to_owned(),
            Self::Covariate(k) => {
                let name = known.covariates.get(k).and_then(|(k, _)| known.names.get(*k));
                quoted(name.map_or("", |name| name))
            }
        }]
    }
}

fn trigonometric(angle: f64, cosine: bool) -> f64 {
    if cosine { angle.cos() } else { angle.sin() }
}
