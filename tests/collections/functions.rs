//! Residual functions of the problems, in the notation of the paper.

use std::f64::consts::PI;

use num_dual::DualNum;

/// Scalar of a residual function: a real or a dual number.
pub trait Scalar: DualNum<f64> + Copy {}

impl<T: DualNum<f64> + Copy> Scalar for T {}

fn c<D: Scalar>(value: f64) -> D {
    D::from(value)
}

fn sum<D: Scalar>(terms: impl Iterator<Item = D>) -> D {
    terms.fold(c(0.0), |a, b| a + b)
}

pub fn rosenbrock<D: Scalar>(x: &[D]) -> Vec<D> {
    vec![(x[1] - x[0] * x[0]) * 10.0, -x[0] + 1.0]
}

pub fn freudenstein_roth<D: Scalar>(x: &[D]) -> Vec<D> {
    let (a, b) = (x[0], x[1]);
    vec![a - 13.0 + ((-b + 5.0) * b - 2.0) * b, a - 29.0 + ((b + 1.0) * b - 14.0) * b]
}

pub fn powell_badly_scaled<D: Scalar>(x: &[D]) -> Vec<D> {
    vec![x[0] * x[1] * 1e4 - 1.0, (-x[0]).exp() + (-x[1]).exp() - 1.0001]
}

pub fn brown_badly_scaled<D: Scalar>(x: &[D]) -> Vec<D> {
    vec![x[0] - 1e6, x[1] - 2e-6, x[0] * x[1] - 2.0]
}

pub fn beale<D: Scalar>(x: &[D]) -> Vec<D> {
    [1.5, 2.25, 2.625].iter().zip(1..).map(|(&y, i)| x[0] * (x[1].powi(i) - 1.0) + y).collect()
}

pub fn jennrich_sampson<D: Scalar>(x: &[D]) -> Vec<D> {
    (1..=10).map(f64::from).map(|i| -(x[0] * i).exp() - (x[1] * i).exp() + 2.0 + 2.0 * i).collect()
}

pub fn helical_valley<D: Scalar>(x: &[D]) -> Vec<D> {
    let turn = if x[0].re() == 0.0 {
        c(0.25 * x[1].re().signum())
    } else {
        (x[1] / x[0]).atan() / (2.0 * PI) + if x[0].re() < 0.0 { 0.5 } else { 0.0 }
    };
    let radius = (x[0] * x[0] + x[1] * x[1]).sqrt();
    vec![(x[2] - turn * 10.0) * 10.0, (radius - 1.0) * 10.0, x[2]]
}

pub fn bard<D: Scalar>(x: &[D]) -> Vec<D> {
    const Y: [f64; 15] =
        [0.14, 0.18, 0.22, 0.25, 0.29, 0.32, 0.35, 0.39, 0.37, 0.58, 0.73, 0.96, 1.34, 2.10, 4.39];
    Y.iter()
        .zip(1..)
        .map(|(&y, i)| {
            let (u, v) = (f64::from(i), f64::from(16 - i));
            -(x[0] + c::<D>(u) / (x[1] * v + x[2] * u.min(v))) + y
        })
        .collect()
}

pub fn gaussian<D: Scalar>(x: &[D]) -> Vec<D> {
    const Y: [f64; 8] = [0.0009, 0.0044, 0.0175, 0.0540, 0.1295, 0.2420, 0.3521, 0.3989];
    (1..=15_usize)
        .map(|i| {
            let t = (8.0 - i as f64) / 2.0;
            let d = -x[2] + t;
            x[0] * (-x[1] * d * d / 2.0).exp() - Y[if i <= 8 { i - 1 } else { 15 - i }]
        })
        .collect()
}

pub fn meyer<D: Scalar>(x: &[D]) -> Vec<D> {
    const Y: [f64; 16] = [
        34780.0, 28610.0, 23650.0, 19630.0, 16370.0, 13720.0, 11540.0, 9744.0, 8261.0, 7030.0,
        6005.0, 5147.0, 4427.0, 3820.0, 3307.0, 2872.0,
    ];
    Y.iter()
        .zip(1..)
        .map(|(&y, i)| x[0] * (x[1] / (x[2] + 45.0 + 5.0 * f64::from(i))).exp() - y)
        .collect()
}

pub fn gulf<D: Scalar>(x: &[D]) -> Vec<D> {
    (1..=99)
        .map(|i| {
            let t = f64::from(i) / 100.0;
            let y = 25.0 + (-50.0 * t.ln()).powf(2.0 / 3.0);
            // Term |y − x₂| to the power x₃.
            let distance = -x[1] + y;
            let distance = if distance.re() < 0.0 { -distance } else { distance };
            (-((x[2] * distance.ln()).exp()) / x[0]).exp() - t
        })
        .collect()
}

pub fn box3<D: Scalar>(x: &[D]) -> Vec<D> {
    (1..=10)
        .map(|i| {
            let t = f64::from(i) / 10.0;
            (-x[0] * t).exp() - (-x[1] * t).exp() - x[2] * ((-t).exp() - (-10.0 * t).exp())
        })
        .collect()
}

pub fn powell_singular<D: Scalar>(x: &[D]) -> Vec<D> {
    let square = |v: D| v * v;
    vec![
        x[0] + x[1] * 10.0,
        (x[2] - x[3]) * 5.0_f64.sqrt(),
        square(x[1] - x[2] * 2.0),
        square(x[0] - x[3]) * 10.0_f64.sqrt(),
    ]
}

pub fn wood<D: Scalar>(x: &[D]) -> Vec<D> {
    vec![
        (x[1] - x[0] * x[0]) * 10.0,
        -x[0] + 1.0,
        (x[3] - x[2] * x[2]) * 90.0_f64.sqrt(),
        -x[2] + 1.0,
        (x[1] + x[3] - 2.0) * 10.0_f64.sqrt(),
        (x[1] - x[3]) / 10.0_f64.sqrt(),
    ]
}

pub fn kowalik_osborne<D: Scalar>(x: &[D]) -> Vec<D> {
    const Y: [f64; 11] =
        [0.1957, 0.1947, 0.1735, 0.1600, 0.0844, 0.0627, 0.0456, 0.0342, 0.0323, 0.0235, 0.0246];
    const U: [f64; 11] = [4.0, 2.0, 1.0, 0.5, 0.25, 0.167, 0.125, 0.1, 0.0833, 0.0714, 0.0625];
    Y.iter()
        .zip(U)
        .map(|(&y, u)| -(x[0] * (x[1] * u + u * u)) / (x[2] * u + x[3] + u * u) + y)
        .collect()
}

pub fn brown_dennis<D: Scalar>(x: &[D]) -> Vec<D> {
    (1..=20)
        .map(|i| {
            let t = f64::from(i) / 5.0;
            let first = x[0] + x[1] * t - t.exp();
            let second = x[2] + x[3] * t.sin() - t.cos();
            first * first + second * second
        })
        .collect()
}

pub fn osborne1<D: Scalar>(x: &[D]) -> Vec<D> {
    const Y: [f64; 33] = [
        0.844, 0.908, 0.932, 0.936, 0.925, 0.908, 0.881, 0.850, 0.818, 0.784, 0.751, 0.718, 0.685,
        0.658, 0.628, 0.603, 0.580, 0.558, 0.538, 0.522, 0.506, 0.490, 0.478, 0.467, 0.457, 0.448,
        0.438, 0.431, 0.424, 0.420, 0.414, 0.411, 0.406,
    ];
    Y.iter()
        .zip(0..)
        .map(|(&y, i)| {
            let t = 10.0 * f64::from(i);
            -(x[0] + x[1] * (-x[3] * t).exp() + x[2] * (-x[4] * t).exp()) + y
        })
        .collect()
}

pub fn biggs<D: Scalar>(x: &[D]) -> Vec<D> {
    (1..=13)
        .map(|i| {
            let t = f64::from(i) / 10.0;
            let y = (-t).exp() - 5.0 * (-10.0 * t).exp() + 3.0 * (-4.0 * t).exp();
            x[2] * (-x[0] * t).exp() - x[3] * (-x[1] * t).exp() + x[5] * (-x[4] * t).exp() - y
        })
        .collect()
}

pub fn osborne2<D: Scalar>(x: &[D]) -> Vec<D> {
    const Y: [f64; 65] = [
        1.366, 1.191, 1.112, 1.013, 0.991, 0.885, 0.831, 0.847, 0.786, 0.725, 0.746, 0.679, 0.608,
        0.655, 0.616, 0.606, 0.602, 0.626, 0.651, 0.724, 0.649, 0.649, 0.694, 0.644, 0.624, 0.661,
        0.612, 0.558, 0.533, 0.495, 0.500, 0.423, 0.395, 0.375, 0.372, 0.391, 0.396, 0.405, 0.428,
        0.429, 0.523, 0.562, 0.607, 0.653, 0.672, 0.708, 0.633, 0.668, 0.645, 0.632, 0.591, 0.559,
        0.597, 0.625, 0.739, 0.710, 0.729, 0.720, 0.636, 0.581, 0.428, 0.292, 0.162, 0.098, 0.054,
    ];
    Y.iter()
        .zip(0..)
        .map(|(&y, i)| {
            let t = f64::from(i) / 10.0;
            let peak = |height: D, width: D, centre: D| {
                let d = -centre + t;
                height * (-d * d * width).exp()
            };
            let model = x[0] * (-x[4] * t).exp()
                + peak(x[1], x[5], x[8])
                + peak(x[2], x[6], x[9])
                + peak(x[3], x[7], x[10]);
            -model + y
        })
        .collect()
}

pub fn watson<D: Scalar>(x: &[D]) -> Vec<D> {
    let mut rows: Vec<D> = (1..=29)
        .map(|i| {
            let t = f64::from(i) / 29.0;
            let slope =
                sum(x.iter().zip(0..).skip(1).map(|(&x, j)| x * (f64::from(j) * t.powi(j - 1))));
            let value = sum(x.iter().zip(0..).map(|(&x, j)| x * t.powi(j)));
            slope - value * value - 1.0
        })
        .collect();
    rows.extend([x[0], x[1] - x[0] * x[0] - 1.0]);
    rows
}

pub fn extended_rosenbrock<D: Scalar>(x: &[D]) -> Vec<D> {
    x.chunks_exact(2).flat_map(rosenbrock).collect()
}

pub fn extended_powell_singular<D: Scalar>(x: &[D]) -> Vec<D> {
    x.chunks_exact(4).flat_map(powell_singular).collect()
}

pub fn penalty1<D: Scalar>(x: &[D]) -> Vec<D> {
    let mut rows: Vec<D> = x.iter().map(|&x| (x - 1.0) * 1e-5_f64.sqrt()).collect();
    rows.push(sum(x.iter().map(|&x| x * x)) - 0.25);
    rows
}

pub fn penalty2<D: Scalar>(x: &[D]) -> Vec<D> {
    let (n, root) = (x.len(), 1e-5_f64.sqrt());
    let mut rows = vec![x[0] - 0.2];
    for i in 1..n {
        let y = ((i + 1) as f64 / 10.0).exp() + (i as f64 / 10.0).exp();
        rows.push(((x[i] / 10.0).exp() + (x[i - 1] / 10.0).exp() - y) * root);
    }
    for x in &x[1..] {
        rows.push(((*x / 10.0).exp() - (-0.1_f64).exp()) * root);
    }
    rows.push(sum(x.iter().enumerate().map(|(j, &x)| x * x * (n - j) as f64)) - 1.0);
    rows
}

pub fn variable<D: Scalar>(x: &[D]) -> Vec<D> {
    let total = sum(x.iter().zip(1..).map(|(&x, j)| (x - 1.0) * f64::from(j)));
    x.iter().map(|&x| x - 1.0).chain([total, total * total]).collect()
}

pub fn trigonometric<D: Scalar>(x: &[D]) -> Vec<D> {
    let n = x.len() as f64;
    let cosines = sum(x.iter().map(DualNum::cos));
    x.iter()
        .zip(1..)
        .map(|(x, i)| -cosines + n + (-x.cos() + 1.0) * f64::from(i) - x.sin())
        .collect()
}

pub fn brown_almost_linear<D: Scalar>(x: &[D]) -> Vec<D> {
    let n = x.len();
    let total = sum(x.iter().copied());
    let product = x.iter().fold(c::<D>(1.0), |a, &b| a * b);
    x[..n - 1].iter().map(|&x| x + total - (n as f64 + 1.0)).chain([product - 1.0]).collect()
}

/// Returns x with a zero before and after.
fn padded<D: Scalar>(x: &[D]) -> Vec<D> {
    [c(0.0)].into_iter().chain(x.iter().copied()).chain([c(0.0)]).collect()
}

pub fn boundary_value<D: Scalar>(x: &[D]) -> Vec<D> {
    let h = 1.0 / (x.len() as f64 + 1.0);
    let x = padded(x);
    (1..x.len() - 1)
        .map(|i| {
            x[i] * 2.0 - x[i - 1] - x[i + 1] + (x[i] + (i as f64 * h + 1.0)).powi(3) * (0.5 * h * h)
        })
        .collect()
}

pub fn integral<D: Scalar>(x: &[D]) -> Vec<D> {
    let h = 1.0 / (x.len() as f64 + 1.0);
    let t = |i: usize| (i as f64 + 1.0) * h;
    let cube = |j: usize| (x[j] + (t(j) + 1.0)).powi(3);
    (0..x.len())
        .map(|i| {
            let before = sum((0..=i).map(|j| cube(j) * t(j)));
            let after = sum((i + 1..x.len()).map(|j| cube(j) * (1.0 - t(j))));
            x[i] + (before * (1.0 - t(i)) + after * t(i)) * (0.5 * h)
        })
        .collect()
}

pub fn broyden_tridiagonal<D: Scalar>(x: &[D]) -> Vec<D> {
    let x = padded(x);
    (1..x.len() - 1).map(|i| (-x[i] * 2.0 + 3.0) * x[i] - x[i - 1] - x[i + 1] * 2.0 + 1.0).collect()
}

pub fn broyden_banded<D: Scalar>(x: &[D]) -> Vec<D> {
    (0..x.len())
        .map(|i| {
            let band = (i.saturating_sub(5)..(i + 2).min(x.len())).filter(|&j| j != i);
            x[i] * (x[i] * x[i] * 5.0 + 2.0) + 1.0 - sum(band.map(|j| x[j] * (x[j] + 1.0)))
        })
        .collect()
}

fn linear_full<D: Scalar>(x: &[D], m: usize) -> Vec<D> {
    let shift = sum(x.iter().copied()) * (2.0 / m as f64) + 1.0;
    (0..m).map(|i| if i < x.len() { x[i] - shift } else { -shift }).collect()
}

pub fn linear_full_10<D: Scalar>(x: &[D]) -> Vec<D> {
    linear_full(x, 10)
}

pub fn linear_full_50<D: Scalar>(x: &[D]) -> Vec<D> {
    linear_full(x, 50)
}

fn linear_rank_one<D: Scalar>(x: &[D], m: i32) -> Vec<D> {
    let total = sum(x.iter().zip(1..).map(|(&x, j)| x * f64::from(j)));
    (1..=m).map(|i| total * f64::from(i) - 1.0).collect()
}

pub fn linear_rank_one_10<D: Scalar>(x: &[D]) -> Vec<D> {
    linear_rank_one(x, 10)
}

pub fn linear_rank_one_50<D: Scalar>(x: &[D]) -> Vec<D> {
    linear_rank_one(x, 50)
}

fn linear_zeros<D: Scalar>(x: &[D], m: i32) -> Vec<D> {
    let last = x.len() - 1;
    let total = sum(x[..last].iter().zip(1..).skip(1).map(|(&x, j)| x * f64::from(j)));
    (1..=m)
        .map(|i| if i == 1 || i == m { c(-1.0) } else { total * f64::from(i - 1) - 1.0 })
        .collect()
}

pub fn linear_zeros_10<D: Scalar>(x: &[D]) -> Vec<D> {
    linear_zeros(x, 10)
}

pub fn linear_zeros_50<D: Scalar>(x: &[D]) -> Vec<D> {
    linear_zeros(x, 50)
}

/// Returns the means of the shifted Chebyshev polynomials T₁ … `T_m` over the points, minus their
/// integrals over [0, 1].
fn chebyshev_means<D: Scalar>(x: &[D], m: usize) -> Vec<D> {
    let mut rows = vec![c::<D>(0.0); m];
    for &x in x {
        let twice = (x * 2.0 - 1.0) * 2.0;
        let (mut before, mut now) = (c::<D>(1.0), x * 2.0 - 1.0);
        for row in &mut rows {
            *row += now;
            (before, now) = (now, twice * now - before);
        }
    }
    let n = x.len() as f64;
    rows.iter()
        .zip(1..)
        .map(|(&row, i)| row / n + if i % 2 == 0 { 1.0 / f64::from(i * i - 1) } else { 0.0 })
        .collect()
}

pub fn chebyquad<D: Scalar>(x: &[D]) -> Vec<D> {
    chebyshev_means(x, x.len())
}

pub fn chebyquad_8<D: Scalar>(x: &[D]) -> Vec<D> {
    chebyshev_means(x, 8)
}
