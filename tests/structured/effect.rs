//! Effects whose laws are written here once more, apart from the library.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::arm::{Joint, Kind};
use super::draw::Draw;
use super::row::Row;

/// Temperature above which thermal effects count \[°C\].
pub const REFERENCE_TEMPERATURE: f64 = 20.0;

/// Law of an effect; joints are counted from 0.
#[derive(Debug, Clone)]
enum Law {
    GearRatio(usize),
    Harmonic(usize, Vec<u32>),
    Wave(usize, f64),
    Coupling(usize, usize),
    ThermalDrift(usize),
    Backlash(usize),
    PayloadBacklash(usize),
    Covariate(usize),
    /// Two terms of a law of the user's own.
    Wobble(usize, usize),
    Scale,
    Strain,
    Drift,
    Shift(f64),
    /// A law of the user's own, which shifts measured positions along z.
    Sway(usize),
}

/// Declared effect.
#[derive(Debug, Clone)]
pub struct Effect {
    law: Law,
    /// Text of the section `[[effect]]`.
    pub declaration: String,
    /// Names of the parameters with the size of realistic values, SI.
    pub parameters: Vec<(String, f64)>,
}

impl Effect {
    fn new(law: Law, declaration: String, of: &str, fields: &[&str], size: f64) -> Self {
        let name = |field: &&str| (format!("{of}.{field}"), size);
        Self { law, declaration, parameters: fields.iter().map(name).collect() }
    }

    /// Draws an effect of an arm; `None` if the draw does not suit it.
    pub fn drawn(draw: &mut Draw, joints: &[Joint], span: f64) -> Option<Self> {
        let moving: Vec<usize> = (0..joints.len())
            .filter(|&k| joints[k].kind != Kind::Fixed && joints[k].mimic.is_none())
            .collect();
        let k = draw.pick(&moving);
        let n = k + 1;
        let other = draw.pick(&moving);
        let turns = joints[k].kind == Kind::Revolute;
        let of_joint = |name: &str| format!("{name} = {{ joint = {n} }}");
        Some(match draw.whole(0, 13) {
            0 => Self::new(
                Law::GearRatio(k),
                of_joint("gear-ratio"),
                &format!("gear-ratio[{n}]"),
                &["error"],
                1e-3,
            ),
            1 => {
                let orders = draw.pick(&[vec![1], vec![2], vec![1, 3]]);
                let fields: Vec<String> = orders
                    .iter()
                    .flat_map(|order| [format!("sin{order}"), format!("cos{order}")])
                    .collect();
                let fields: Vec<&str> = fields.iter().map(String::as_str).collect();
                let declaration =
                    format!("joint-harmonic = {{ joint = {n}, orders = {orders:?} }}");
                Self::new(
                    Law::Harmonic(k, orders),
                    declaration,
                    &format!("joint-harmonic[{n}]"),
                    &fields,
                    5e-4,
                )
            }
            2 => {
                let order = draw.number(1.2, 9.7);
                let declaration = format!("joint-wave = {{ joint = {n}, order = {order} }}");
                Self::new(
                    Law::Wave(k, order),
                    declaration,
                    &format!("joint-wave[{n},{order}]"),
                    &["sin", "cos"],
                    5e-4,
                )
            }
            3 if other != k => {
                let declaration =
                    format!("joint-coupling = {{ joint = {n}, from = {} }}", other + 1);
                Self::new(
                    Law::Coupling(k, other),
                    declaration,
                    &format!("joint-coupling[{n},{}]", other + 1),
                    &["factor"],
                    1e-3,
                )
            }
            4 => Self::new(
                Law::ThermalDrift(k),
                of_joint("joint-thermal-drift"),
                &format!("joint-thermal-drift[{n}]"),
                &["rate"],
                5e-5,
            ),
            5 => Self::new(
                Law::Backlash(k),
                of_joint("backlash"),
                &format!("backlash[{n}]"),
                &["width"],
                1e-3,
            ),
            6 => Self::new(
                Law::PayloadBacklash(k),
                of_joint("payload-backlash"),
                &format!("payload-backlash[{n}]"),
                &["width"],
                5e-4,
            ),
            7 => {
                let declaration = format!("covariate = {{ joint = {n}, of = \"oil_bar\" }}");
                Self::new(
                    Law::Covariate(k),
                    declaration,
                    &format!("covariate[{n},oil_bar]"),
                    &["rate"],
                    5e-4,
                )
            }
            8 => {
                let sigma = if turns { "sigma_deg = 0.1" } else { "sigma_mm = 2" };
                let m = other + 1;
                let terms = format!("[\"sin(2*q{n})*cos(1*q{m})\", \"cos(2*q{n})*T\"]");
                let declaration = format!(
                    "law = {{ name = \"wobble\", at = \"joint{n}\", terms = {terms}, {sigma} }}"
                );
                Self::new(Law::Wobble(k, other), declaration, "law[wobble]", &["1", "2"], 2e-4)
            }
            9..=13 => Self::of_instrument(draw, k, span),
            _ => return None,
        })
    }

    /// Draws an effect on what the instrument shows; the law of the user's own follows joint `k`.
    fn of_instrument(draw: &mut Draw, k: usize, span: f64) -> Self {
        let n = k + 1;
        match draw.whole(0, 4) {
            0 => Self::new(
                Law::Scale,
                "tracker-scale = true".into(),
                "tracker-scale",
                &["error"],
                5e-4,
            ),
            1 => Self::new(
                Law::Strain,
                "frame-strain = true".into(),
                "frame-strain",
                &["xx", "yy", "zz", "xy", "xz", "yz"],
                5e-4,
            ),
            2 => Self::new(
                Law::Drift,
                "tracker-drift = true".into(),
                "tracker-drift",
                &["x", "y", "z"],
                1e-7,
            ),
            3 => {
                let at = (draw.even(0.3, 0.7) * span).round();
                let declaration = format!("station-shift = {{ at_time_s = {at} }}");
                Self::new(
                    Law::Shift(at),
                    declaration,
                    &format!("station-shift[{at}]"),
                    &["x", "y", "z"],
                    1e-3,
                )
            }
            _ => {
                let terms = format!("[\"exp(-t/300)\", \"payload/2 + abs(1*q{n})\"]");
                let declaration = format!(
                    "law = {{ name = \"sway\", at = \"measurement.z\", terms = {terms}, sigma_mm = 1 }}"
                );
                Self::new(Law::Sway(k), declaration, "law[sway]", &["1", "2"], 5e-4)
            }
        }
    }

    pub fn has(&self, name: &str) -> bool {
        self.parameters.iter().any(|(of, _)| of == name)
    }

    /// Returns true if the effect acts on what the instrument shows.
    pub fn is_of_instrument(&self) -> bool {
        matches!(self.law, Law::Scale | Law::Strain | Law::Drift | Law::Shift(_) | Law::Sway(_))
    }

    fn numbers(&self, values: &BTreeMap<String, f64>) -> Vec<f64> {
        self.parameters.iter().map(|(name, _)| values.get(name).copied().unwrap_or(0.0)).collect()
    }

    /// Adds the errors of joints to their coordinates.
    pub fn act(&self, values: &BTreeMap<String, f64>, row: &Row, coordinates: &mut [f64]) {
        let c = self.numbers(values);
        let q = &row.q;
        let payload = row.payload.unwrap_or(0.0);
        let warmth = row.temperature - REFERENCE_TEMPERATURE;
        let (k, error) = match &self.law {
            Law::GearRatio(k) => (*k, c[0] * q[*k]),
            Law::Harmonic(k, orders) => {
                let wave = |(i, order): (usize, &u32)| {
                    let (sin, cos) = (f64::from(*order) * q[*k]).sin_cos();
                    c[2 * i] * sin + c[2 * i + 1] * cos
                };
                (*k, orders.iter().enumerate().map(wave).sum())
            }
            Law::Wave(k, order) => {
                (*k, c[0] * (order * q[*k]).sin() + c[1] * (order * q[*k]).cos())
            }
            Law::Coupling(k, from) => (*k, c[0] * q[*from]),
            Law::ThermalDrift(k) => (*k, c[0] * warmth),
            Law::Backlash(k) => (*k, c[0] / 2.0 * row.approach[*k]),
            Law::PayloadBacklash(k) => (*k, c[0] * payload / 2.0 * row.approach[*k]),
            Law::Covariate(k) => (*k, c[0] * row.covariate),
            Law::Wobble(k, other) => {
                let double = 2.0 * q[*k];
                (*k, c[0] * double.sin() * q[*other].cos() + c[1] * double.cos() * warmth)
            }
            _ => return,
        };
        coordinates[k] += error;
    }

    /// Moves a true position to the one that the instrument shows.
    pub fn show(&self, values: &BTreeMap<String, f64>, row: &Row, seen: &mut Vector3<f64>) {
        let c = self.numbers(values);
        match &self.law {
            Law::Scale => *seen *= 1.0 + c[0],
            Law::Strain => {
                *seen += Vector3::new(
                    c[0] * seen.x + c[3] * seen.y + c[4] * seen.z,
                    c[1] * seen.y + c[5] * seen.z,
                    c[2] * seen.z,
                );
            }
            Law::Drift => *seen += Vector3::new(c[0], c[1], c[2]) * row.elapsed,
            Law::Shift(at) if row.time >= *at => *seen += Vector3::new(c[0], c[1], c[2]),
            Law::Sway(k) => {
                let payload = row.payload.unwrap_or(0.0);
                seen.z +=
                    c[0] * (-row.elapsed / 300.0).exp() + c[1] * (payload / 2.0 + row.q[*k].abs());
            }
            _ => {}
        }
    }
}
