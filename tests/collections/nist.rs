//! The 27 nonlinear regression problems of the NIST Statistical Reference Datasets (public domain),
//! <https://www.itl.nist.gov/div898/strd/nls/nls_main.shtml>: certified values to 11 digits, two
//! starts each.

use std::f64::consts::PI;
use std::ops::Range;

use flexcal::least_squares::{Block, LeastSquares};
use nalgebra::DVector;
use num_dual::Dual64;

use super::functions::Scalar;

/// Model function y(b, x) of one data set.
type Model<D> = fn(&[D], &[f64]) -> D;

/// Names of the data sets of the highest level of difficulty.
pub const HIGHER_DIFFICULTY: [&str; 8] =
    ["mgh09", "thurber", "boxbod", "rat42", "mgh10", "eckerle4", "rat43", "bennett5"];

/// Data set with its model, starts and certified values.
pub struct Dataset {
    pub name: &'static str,
    pub starts: [DVector<f64>; 2],
    pub certified: DVector<f64>,
    /// Value ‖r‖² at the certified values.
    pub rss: f64,
    /// Observations as (y, predictors).
    observations: Vec<(f64, Vec<f64>)>,
    value: Model<f64>,
    dual: Model<Dual64>,
}

impl LeastSquares for Dataset {
    fn parameters(&self) -> usize {
        self.certified.len()
    }

    fn items(&self) -> usize {
        self.observations.len()
    }

    fn rows_per_item(&self) -> usize {
        1
    }

    fn residuals(&self, b: &DVector<f64>, items: Range<usize>, out: &mut [f64]) {
        for (out, (y, x)) in out.iter_mut().zip(&self.observations[items]) {
            *out = y - (self.value)(b.as_slice(), x);
        }
    }

    fn linearise(&self, b: &DVector<f64>, items: Range<usize>, block: &mut Block) {
        self.residuals(b, items.clone(), block.column_mut(b.len()));
        let mut dual: Vec<Dual64> = b.iter().map(|&b| Dual64::from(b)).collect();
        for j in 0..b.len() {
            dual[j] = dual[j].derivative();
            for (out, (_, x)) in
                block.column_mut(j).iter_mut().zip(&self.observations[items.clone()])
            {
                *out = -(self.dual)(&dual, x).eps;
            }
            dual[j] = Dual64::from(b[j]);
        }
    }
}

fn misra1a<D: Scalar>(b: &[D], x: &[f64]) -> D {
    b[0] * (-(-b[1] * x[0]).exp() + 1.0)
}

fn misra1b<D: Scalar>(b: &[D], x: &[f64]) -> D {
    b[0] * (-(b[1] * x[0] / 2.0 + 1.0).powi(-2) + 1.0)
}

fn misra1c<D: Scalar>(b: &[D], x: &[f64]) -> D {
    b[0] * (-(b[1] * x[0] * 2.0 + 1.0).sqrt().recip() + 1.0)
}

fn misra1d<D: Scalar>(b: &[D], x: &[f64]) -> D {
    b[0] * b[1] * x[0] / (b[1] * x[0] + 1.0)
}

fn chwirut<D: Scalar>(b: &[D], x: &[f64]) -> D {
    (-b[0] * x[0]).exp() / (b[1] + b[2] * x[0])
}

fn lanczos<D: Scalar>(b: &[D], x: &[f64]) -> D {
    b.chunks_exact(2).fold(D::from(0.0), |sum, b| sum + b[0] * (-b[1] * x[0]).exp())
}

fn gauss<D: Scalar>(b: &[D], x: &[f64]) -> D {
    let peak = |b: &[D]| {
        let d = (-b[1] + x[0]) / b[2];
        b[0] * (-d * d).exp()
    };
    b[0] * (-b[1] * x[0]).exp() + peak(&b[2..5]) + peak(&b[5..8])
}

fn danwood<D: Scalar>(b: &[D], x: &[f64]) -> D {
    b[0] * (b[1] * x[0].ln()).exp()
}

fn nelson<D: Scalar>(b: &[D], x: &[f64]) -> D {
    b[0] - b[1] * x[0] * (-b[2] * x[1]).exp()
}

/// Returns a quotient of polynomials with `top` coefficients in the numerator and 1 + the others in
/// the denominator.
fn rational<D: Scalar>(b: &[D], x: f64, top: usize) -> D {
    let polynomial = |b: &[D]| b.iter().rev().fold(D::from(0.0), |sum, &b| sum * x + b);
    polynomial(&b[..top]) / (polynomial(&b[top..]) * x + 1.0)
}

fn kirby<D: Scalar>(b: &[D], x: &[f64]) -> D {
    rational(b, x[0], 3)
}

fn hahn<D: Scalar>(b: &[D], x: &[f64]) -> D {
    rational(b, x[0], 4)
}

fn mgh17<D: Scalar>(b: &[D], x: &[f64]) -> D {
    b[0] + b[1] * (-b[3] * x[0]).exp() + b[2] * (-b[4] * x[0]).exp()
}

fn roszman<D: Scalar>(b: &[D], x: &[f64]) -> D {
    b[0] - b[1] * x[0] - (b[2] / (-b[3] + x[0])).atan() / PI
}

fn enso<D: Scalar>(b: &[D], x: &[f64]) -> D {
    let cycle = |period: D, cosine: D, sine: D| {
        let phase = period.recip() * (2.0 * PI * x[0]);
        cosine * phase.cos() + sine * phase.sin()
    };
    b[0] + cycle(D::from(12.0), b[1], b[2]) + cycle(b[3], b[4], b[5]) + cycle(b[6], b[7], b[8])
}

fn mgh09<D: Scalar>(b: &[D], x: &[f64]) -> D {
    let x = x[0];
    b[0] * (b[1] * x + x * x) / (b[2] * x + b[3] + x * x)
}

fn rat42<D: Scalar>(b: &[D], x: &[f64]) -> D {
    b[0] / ((b[1] - b[2] * x[0]).exp() + 1.0)
}

fn mgh10<D: Scalar>(b: &[D], x: &[f64]) -> D {
    b[0] * (b[1] / (b[2] + x[0])).exp()
}

fn eckerle<D: Scalar>(b: &[D], x: &[f64]) -> D {
    let d = (-b[2] + x[0]) / b[1];
    b[0] / b[1] * (-d * d / 2.0).exp()
}

fn rat43<D: Scalar>(b: &[D], x: &[f64]) -> D {
    b[0] * (-((b[1] - b[2] * x[0]).exp() + 1.0).ln() / b[3]).exp()
}

fn bennett<D: Scalar>(b: &[D], x: &[f64]) -> D {
    b[0] * (-(b[1] + x[0]).ln() / b[2]).exp()
}

macro_rules! dataset {
    ($name:literal, $model:ident) => {
        parse($name, include_str!(concat!("nist/", $name, ".dat")), $model::<f64>, $model::<Dual64>)
    };
}

fn parse(name: &'static str, text: &str, value: Model<f64>, dual: Model<Dual64>) -> Dataset {
    let numbers =
        |line: &str| -> Vec<f64> { line.split_whitespace().map(|v| v.parse().unwrap()).collect() };
    let entry = |key: &str| numbers(text.lines().find_map(|line| line.strip_prefix(key)).unwrap());
    let rows = text
        .lines()
        .filter(|line| line.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '.'));
    Dataset {
        name,
        starts: [DVector::from_vec(entry("start1")), DVector::from_vec(entry("start2"))],
        certified: DVector::from_vec(entry("certified")),
        rss: entry("rss")[0],
        observations: rows
            .map(|line| {
                let row = numbers(line);
                (row[0], row[1..].to_vec())
            })
            .collect(),
        value,
        dual,
    }
}

/// Returns every data set, in NIST's order of difficulty.
pub fn datasets() -> Vec<Dataset> {
    let mut nelson = dataset!("nelson", nelson);
    // NIST models the logarithm of the response.
    nelson.observations.iter_mut().for_each(|(y, _)| *y = y.ln());
    vec![
        dataset!("misra1a", misra1a),
        dataset!("chwirut2", chwirut),
        dataset!("chwirut1", chwirut),
        dataset!("lanczos3", lanczos),
        dataset!("gauss1", gauss),
        dataset!("gauss2", gauss),
        dataset!("danwood", danwood),
        dataset!("misra1b", misra1b),
        dataset!("kirby2", kirby),
        dataset!("hahn1", hahn),
        nelson,
        dataset!("mgh17", mgh17),
        dataset!("lanczos1", lanczos),
        dataset!("lanczos2", lanczos),
        dataset!("gauss3", gauss),
        dataset!("misra1c", misra1c),
        dataset!("misra1d", misra1d),
        dataset!("roszman1", roszman),
        dataset!("enso", enso),
        dataset!("mgh09", mgh09),
        dataset!("thurber", hahn),
        dataset!("boxbod", misra1a),
        dataset!("rat42", rat42),
        dataset!("mgh10", mgh10),
        dataset!("eckerle4", eckerle),
        dataset!("rat43", rat43),
        dataset!("bennett5", bennett),
    ]
}
