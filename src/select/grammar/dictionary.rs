//! Factors of formulas at a site, each with its prior probability.

use std::collections::BTreeSet;
use std::f64::consts::PI;

use super::factor::{Factor, Form, STRUT_RATIOS};
use super::quantities::{Quantities, range};
use super::terms::LONE_WAVE;

/// Highest order of sin(kq) and cos(kq) of a joint's command.
const HIGHEST_ORDER: u32 = 5;
/// Number of trial positions of a kink over the range of a joint.
const KINK_POSITIONS: u32 = 9;
/// Number of trial times of a step over the measured duration.
const STEP_TIMES: u32 = 32;
/// Fraction of the measured duration at either end in which no step is tried.
const STEP_MARGIN: f64 = 0.04;
/// Smallest and largest time constant of a settling, as fractions of the measured duration, and
/// number of trial values.
const SETTLING_TIMES: (f64, f64, u32) = (0.08, 0.8, 4);
/// Factors a and b of the trial angle sums a q + b q'.
const ANGLE_FACTORS: [[i32; 2]; 6] = [[1, 1], [1, -1], [2, 1], [2, -1], [1, 2], [1, -2]];
/// Number of trial angles of a gas spring over a revolution.
const STRUT_ANGLES: u32 = 16;
/// Prior probability of a gas spring relative to a family of factors. It is low, because most arms
/// that have a gas spring are declared with it.
const STRUT_WEIGHT: f64 = 0.25;
/// Smallest fraction of the poses with a positive moment, and of those without, at which the sign
/// of the moment is a factor.
const MIN_SIGN_SHARE: f64 = 0.1;

/// Returns the factors of formulas at other sites than joint coordinates, such as at the tool. They
/// are the conditions of a pose (temperature, time, payload, covariates), and the commands with
/// their sines and cosines.
///
/// All families of factors have the same prior probability, and so have the joints.
pub fn factors_at_other_sites(quantities: &Quantities) -> Vec<Factor> {
    let is_listed = |factor: &Factor| match factor.form {
        Form::Command(_) => true,
        Form::Wave { order, .. } => order == 1,
        form => form.is_condition(),
    };
    let of_joint = -(quantities.commands.len().max(1) as f64).ln();
    let mut listed_factors: Vec<Factor> =
        factors(quantities, usize::MAX).into_iter().filter(is_listed).collect();
    let families: BTreeSet<usize> =
        listed_factors.iter().map(|factor| factor.form.family()).collect();
    let ln_families = (families.len().max(1) as f64).ln();
    for factor in &mut listed_factors {
        factor.ln_prior = match factor.form {
            Form::Command(_) => of_joint,
            // Sine and cosine are equally probable as terms of one factor.
            Form::Wave { .. } => of_joint - (2.0 * LONE_WAVE).ln(),
            Form::Settling => -f64::from(SETTLING_TIMES.2).ln(),
            Form::Step => -f64::from(STEP_TIMES).ln(),
            Form::Covariate(_) => -(quantities.covariates.len().max(1) as f64).ln(),
            _ => 0.0,
        } - ln_families;
    }
    listed_factors
}

/// Returns all factors of formulas at the coordinate of the joint `joint_of_site`, counted from 0.
///
/// All families of factors have the same prior probability. Half of it belongs to the joint of the
/// site, the other half to the other joints. Order k has 1/k² of the probability of order 1. The
/// probability is divided by the number of trial values of an inner parameter.
pub fn factors(quantities: &Quantities, joint_of_site: usize) -> Vec<Factor> {
    let mut listed_factors: Vec<Factor> = Vec::new();
    let mut add = |form: Form, inner: Option<(f64, f64)>, ln_prior: f64| {
        listed_factors.push(Factor { form, inner, ln_prior });
    };
    let others = quantities.commands.len().saturating_sub(1).max(1) as f64;
    let of_joint =
        |joint: usize| if joint == joint_of_site { 0.5_f64.ln() } else { (0.5 / others).ln() };
    let orders: f64 = (1..=HIGHEST_ORDER).map(|k| f64::from(k).powi(-2)).sum();
    for (joint, values) in &quantities.commands {
        let (joint, ln_joint) = (*joint, of_joint(*joint));
        add(Form::Command(joint), None, ln_joint);
        add(Form::Square(joint), None, ln_joint);
        let (low, high) = range(values);
        let step = (high - low) / f64::from(KINK_POSITIONS);
        for k in 0..KINK_POSITIONS {
            let at = low + (f64::from(k) + 0.5) * step;
            add(Form::Kink(joint), Some((at, step)), ln_joint - f64::from(KINK_POSITIONS).ln());
        }
        for order in (1..=HIGHEST_ORDER).filter(|_| quantities.turns[joint]) {
            let ln_prior = ln_joint - (f64::from(order).powi(2) * orders).ln();
            for cosine in [false, true] {
                add(Form::Wave { joint, order, cosine }, None, ln_prior);
            }
            // Sine, cosine and their pair are equally probable as terms of one factor.
            add(Form::Harmonic { joint, order }, None, ln_prior + LONE_WAVE.ln());
        }
        if quantities.turns[joint] && joint == joint_of_site {
            let step = 2.0 * PI / f64::from(STRUT_ANGLES);
            let trials = f64::from(STRUT_ANGLES) * STRUT_RATIOS.len() as f64;
            let ln_prior = (STRUT_WEIGHT / trials).ln();
            for ratio in 0..STRUT_RATIOS.len() {
                for k in 0..STRUT_ANGLES {
                    let form = Form::Strut { joint, ratio };
                    add(form, Some((step * f64::from(k) - PI, step)), ln_prior);
                }
            }
        }
    }
    let turning: Vec<usize> = quantities
        .commands
        .iter()
        .map(|(joint, _)| *joint)
        .filter(|j| quantities.turns[*j])
        .collect();
    let pairs: Vec<[usize; 2]> = turning
        .iter()
        .enumerate()
        .flat_map(|(k, &one)| turning[k + 1..].iter().map(move |&other| [one, other]))
        .collect();
    let of_sum = -(pairs.len().max(1) as f64 * ANGLE_FACTORS.len() as f64 * 2.0).ln();
    for joints in pairs {
        for factors in ANGLE_FACTORS {
            for cosine in [false, true] {
                add(Form::OfSum { joints, factors, cosine }, None, of_sum);
            }
        }
    }
    for (joint, _) in &quantities.sides {
        add(Form::Side(*joint), None, of_joint(*joint));
    }
    for (joint, values) in &quantities.moments {
        add(Form::Moment(*joint), None, of_joint(*joint));
        add(Form::CubicMoment(*joint), None, of_joint(*joint));
        let positive = values.iter().filter(|moment| **moment > 0.0).count() as f64;
        let share = positive / values.len().max(1) as f64;
        if (MIN_SIGN_SHARE..=1.0 - MIN_SIGN_SHARE).contains(&share) {
            add(Form::MomentSign(*joint), None, of_joint(*joint));
        }
    }
    if quantities.warming.is_some() {
        add(Form::Warming, None, 0.0);
        add(Form::WarmingSquare, None, 0.0);
    }
    if quantities.lag.is_some() {
        add(Form::Lag, None, 0.0);
    }
    if quantities.elapsed.is_some() {
        add(Form::Elapsed, None, 0.0);
        let (first, last, count) = SETTLING_TIMES;
        for k in 0..count {
            let part = f64::from(k) / f64::from(count - 1);
            let constant = first * (last / first).powf(part);
            add(Form::Settling, Some((constant, 0.25 * constant)), -f64::from(count).ln());
        }
        let width = (1.0 - 2.0 * STEP_MARGIN) / f64::from(STEP_TIMES);
        for k in 0..STEP_TIMES {
            let at = STEP_MARGIN + (f64::from(k) + 0.5) * width;
            add(Form::Step, Some((at, width)), -f64::from(STEP_TIMES).ln());
        }
    }
    if quantities.payload.is_some() {
        add(Form::Payload, None, 0.0);
        add(Form::PayloadSquare, None, 0.0);
    }
    let covariates = quantities.covariates.len().max(1) as f64;
    for k in 0..quantities.covariates.len() {
        add(Form::Covariate(k), None, -covariates.ln());
    }
    let families: BTreeSet<usize> =
        listed_factors.iter().map(|factor| factor.form.family()).collect();
    let ln_families = (families.len().max(1) as f64).ln();
    for factor in &mut listed_factors {
        factor.ln_prior -= ln_families;
    }
    listed_factors
}
