//! Conversion of the sums of the search to laws with formulas as text.

use super::factor::{Form, STRUT_RATIOS};
use super::quantities::Quantities;
use super::terms::Sum;
use super::terms::Terms;
use crate::laws::LawParameter;

/// Formulas of a law with its inner parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Written {
    /// Name of the law: its site and formulas, without the values of inner parameters.
    pub name: String,
    /// Formulas as text; each has one coefficient.
    pub formulas: Vec<String>,
    /// Inner parameters of the formulas.
    pub parameters: Vec<LawParameter>,
}

/// Number of significant digits with which parameters inside a formula are written.
const PARAMETER_DIGITS: i32 = 3;
/// Standard deviation of the prior of the ratio k of a gas spring about its trial value.
const STRUT_RATIO_SIGMA: f64 = 0.2;
/// Largest ratio k of a gas spring; at 1 it would have no length in its dead point.
const MAX_STRUT_RATIO: f64 = 0.99;

/// Writes a sum of terms as a law. `site` is the law's site in the words of files. `inner` holds
/// the values of the inner parameters: one list for each term, with one value for each factor.
pub fn write_law(
    (terms, quantities): (&Terms, &Quantities),
    site: &str,
    sum: &Sum,
    inner: &[Vec<f64>],
) -> Written {
    let span = quantities.elapsed.as_ref().map_or(1.0, |elapsed| elapsed.1);
    let mut parameters: Vec<LawParameter> = Vec::new();
    let mut formulas = Vec::new();
    let mut order: Vec<usize> = (0..sum.len()).collect();
    // The most probable term is written first.
    order.sort_by(|&a, &b| terms.ln_prior(&sum[b]).total_cmp(&terms.ln_prior(&sum[a])));
    for t in order {
        let mut products: Vec<Vec<String>> = vec![Vec::new()];
        for (&k, &x) in sum[t].iter().zip(&inner[t]) {
            let factor = &terms.factors[usize::from(k)];
            let word = match (factor.form, factor.inner) {
                (Form::Step, _) => rounded(x * span).to_string(),
                (form, Some((_, step))) => {
                    let (letter, unit) =
                        if form == Form::Settling { ("tau", span) } else { ("c", 1.0) };
                    let name = numbered(letter, &parameters);
                    parameters.push(LawParameter {
                        name: name.clone(),
                        start: rounded(x * unit),
                        min: None,
                        max: None,
                        sigma: Some(rounded(step * unit)),
                    });
                    name
                }
                _ => String::new(),
            };
            let ratio = numbered("k", &parameters);
            if let Form::Strut { ratio: index, .. } = factor.form {
                parameters.push(LawParameter {
                    name: ratio.clone(),
                    start: STRUT_RATIOS[index],
                    min: Some(0.0),
                    max: Some(MAX_STRUT_RATIO),
                    sigma: Some(STRUT_RATIO_SIGMA),
                });
            }
            let texts = factor.form.texts(quantities, &word, &ratio);
            products = products
                .iter()
                .flat_map(|left| {
                    texts
                        .iter()
                        .map(move |right| [left.as_slice(), std::slice::from_ref(right)].concat())
                })
                .collect();
        }
        formulas.extend(products.iter().map(|factors| joined(factors)));
    }
    Written { name: name(site, &formulas), formulas, parameters }
}

/// Returns the name of an additional inner parameter: the letter, with a number from 2 if names in
/// `parameters` already begin with it.
fn numbered(letter: &str, parameters: &[LawParameter]) -> String {
    match parameters.iter().filter(|quantities| quantities.name.starts_with(letter)).count() {
        0 => letter.to_owned(),
        count => format!("{letter}{}", count + 1),
    }
}

/// Joins factors by `*`; repeated factors become powers.
fn joined(factors: &[String]) -> String {
    let mut powers: Vec<(&str, u32)> = Vec::new();
    for factor in factors {
        let (base, power) = match factor.rsplit_once('^').map(|(base, power)| (base, power.parse()))
        {
            Some((base, Ok(power))) => (base, power),
            _ => (factor.as_str(), 1),
        };
        match powers.iter_mut().find(|(quantities, _)| *quantities == base) {
            Some((_, sum)) => *sum += power,
            None => powers.push((base, power)),
        }
    }
    let written = powers.into_iter().map(|(base, power)| match power {
        1 => base.to_owned(),
        power => format!("{base}^{power}"),
    });
    written.collect::<Vec<_>>().join("*")
}

/// Returns the name of a law: its site and its formulas, without the values of inner parameters.
fn name(site: &str, formulas: &[String]) -> String {
    let mut name = site.replace('.', "-");
    for formula in formulas {
        let searched = formula.split("step(t - ").enumerate().map(|(k, part)| match k {
            0 => part.to_owned(),
            _ => {
                format!("step{}", part.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.'))
            }
        });
        let text = searched.collect::<String>();
        // The formula of a gas spring is named in words.
        let strut = text.split_once(")/sqrt(1 + ").and_then(|(sine, _)| sine.strip_prefix("sin("));
        let text = strut.map_or(text.clone(), |angle| {
            format!("gas spring {}", angle.split(' ').next().unwrap_or_default())
        });
        let text = text.replace("^2", "squared").replace("^3", "cubed");
        let text = text.replace(" - ", "-minus-").replace(" + ", "-plus-");
        let words = text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
        for word in words {
            name.push('-');
            name.push_str(word);
        }
    }
    name
}

/// Rounds a value to [`PARAMETER_DIGITS`] significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.*e}", usize::try_from(PARAMETER_DIGITS).unwrap_or(3)).parse().unwrap_or(value)
}
