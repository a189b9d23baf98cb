//! Laws: terms with formulas at one site, declared in a problem or composed by a search.

use super::argument::Argument;
use super::expression::{Expression, FormulaError, Names, Parsed, Vocabulary, parse};
use super::family::{At, Prior, RANGE_AXIS};
use super::site::{BeamField, MOTION_NAMES};
use super::term::{EffectTerm, LawParameter};

/// Name of declared laws in files.
pub(crate) const LAW: &str = "law";
/// Name of the site at which both focal lengths of a camera change alike.
pub(crate) const FOCAL: &str = "f";

/// Law that the user declares or that a search composes: Δ = Σ cₖ fₖ at one site.
///
/// Each term is a coefficient times a formula. Formulas may share named parameters, which are
/// fitted together with the coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct Law {
    name: String,
    place: LawPlace,
    at: At,
    prior: Option<LawPrior>,
    terms: Vec<Parsed>,
    parameters: Vec<LawParameter>,
    covariates: Vec<String>,
    /// Prior probability and rivals of a law that a search composed; `None` for a declared one.
    composition: Option<Box<Composition>>,
}

/// Prior probability and rivals of a law that a search composed.
#[derive(Debug, Clone, PartialEq)]
struct Composition {
    /// ln of the prior probability among all laws that the search could compose at the site.
    ln_prior: f64,
    /// Laws of other form whose predictions in the measured poses differ by less than the noise,
    /// each with its share of the probability.
    rivals: Vec<(Law, f64)>,
}

/// Place of a law on the arm.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum LawPlace {
    /// Joint, counted from 1.
    Joint(usize),
    /// Link, by the name of its beam.
    Link(String),
    /// Camera, by its name.
    Camera(String),
    /// Base or measurement as a whole.
    Whole,
}

/// Gaussian prior of the coefficients of a law about 0.
#[derive(Debug, Clone, PartialEq)]
pub struct LawPrior {
    /// Standard deviation (1 σ) of each coefficient \[SI\].
    pub sigma: f64,
    /// Key in files, for example `sigma_deg`.
    pub key: String,
    /// Standard deviation (1 σ) in the unit of that key.
    pub written: f64,
}

/// Name of a camera, and the names of its numbers.
pub(crate) type NamedCamera = (String, &'static [&'static str]);

/// Site of a law: a place, and the quantity there to which the law adds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LawSite {
    /// Place on the arm.
    pub place: LawPlace,
    /// Quantity of the place to which the law adds.
    pub at: At,
}

impl LawSite {
    /// Returns the number, counted from 1, of the joint at which the site is; `None` for other
    /// places.
    pub fn joint(&self) -> Option<usize> {
        if let LawPlace::Joint(joint) = self.place { Some(joint) } else { None }
    }

    /// Creates the site of the coordinate that a joint's command moves; `number` counts from 1.
    pub fn of_joint(number: usize) -> Self {
        Self { place: LawPlace::Joint(number), at: At::Coordinate }
    }

    /// Parses a site as in files: `joint3`, `A.curvature_y`, `base.rx`, `measurement.x`,
    /// `camera[hand].fx`. Names of joints are also accepted. `cameras` are the names of the cameras,
    /// each with the names of its numbers.
    ///
    /// # Errors
    /// Returns the reason, as a sentence, why the text is no site of this arm.
    pub fn parse(
        text: &str,
        joints: usize,
        names: &[(String, usize)],
        links: &[String],
        cameras: &[NamedCamera],
    ) -> Result<Self, String> {
        let of_camera = text.strip_prefix("camera[").and_then(|text| text.split_once(']'));
        if let Some((camera, field)) = of_camera {
            let Some((name, fields)) = cameras.iter().find(|(name, _)| name == camera) else {
                let known: Vec<&str> = cameras.iter().map(|(name, _)| name.as_str()).collect();
                return Err(match known.join(", ") {
                    none if none.is_empty() => format!("{text} is no site: there is no [[camera]]"),
                    known => format!("no camera is called \"{camera}\"; there are {known}"),
                });
            };
            let is_field = |of: &&&str| field.strip_prefix('.') == Some(**of);
            return match fields.iter().chain([&FOCAL]).find(is_field) {
                Some(&field) => {
                    Ok(Self { place: LawPlace::Camera(name.clone()), at: At::Camera(field) })
                }
                None => Err(format!(
                    "{text} is no site; write camera[{name}]. and one of {}, {FOCAL}",
                    fields.join(", ")
                )),
            };
        }
        let [x, y, z, turns @ ..] = MOTION_NAMES;
        let axes = [x, y, z];
        let motion = |field: &str| MOTION_NAMES.iter().position(|name| *name == field);
        let (head, field) = text.split_once('.').unwrap_or((text, ""));
        let axis = |words: [&str; 3]| words.iter().position(|word| *word == field);
        let whole = |at: Option<At>, write: &str| match at {
            Some(at) => Ok(Self { place: LawPlace::Whole, at }),
            None => Err(format!("{text} is no site; write {write}")),
        };
        match head {
            "measurement" => {
                let range = (field == "range").then_some(At::Shift(RANGE_AXIS));
                let at = axis(axes).map(At::Shift).or(range);
                return whole(at, "measurement.x, .y, .z or .range");
            }
            "base" => {
                let at = axis(axes).map(At::BaseShift).or(axis(turns).map(At::BaseTurn));
                return whole(at, "base.x, .y, .z, .rx, .ry or .rz");
            }
            "tool" => {
                let at = motion(field).map(At::Tool);
                return whole(at, "tool.x, .y, .z, .rx, .ry or .rz");
            }
            _ => {}
        }
        if let Some(link) = links.iter().find(|link| *link == head) {
            let at = match field {
                "curvature_y" => BeamField::BowY,
                "curvature_z" => BeamField::BowZ,
                "strain" => BeamField::Stretch,
                _ => {
                    return Err(format!(
                        "{text} is no site; write {link}.curvature_y, .curvature_z or .strain"
                    ));
                }
            };
            return Ok(Self { place: LawPlace::Link(link.clone()), at: At::Beam(at) });
        }
        let number = head.strip_prefix("joint").and_then(|number| number.parse::<usize>().ok());
        let named = || names.iter().find(|(name, _)| name == head).map(|(_, joint)| joint + 1);
        match number.or_else(named) {
            Some(joint) if (1..=joints).contains(&joint) && field.is_empty() => {
                Ok(Self::of_joint(joint))
            }
            Some(joint) if (1..=joints).contains(&joint) => {
                let behind = field.strip_prefix("after.").and_then(motion).map(At::After);
                match motion(field).map(At::Before).or(behind) {
                    Some(at) => Ok(Self { place: LawPlace::Joint(joint), at }),
                    None => Err(format!(
                        "{text} is no site; write {head}, {head}.x, .y, .z, .rx, .ry, .rz or \
                         {head}.after.x"
                    )),
                }
            }
            Some(joint) => Err(format!("no joint {joint}; the arm has {joints}, counted from 1")),
            None if is_joint_coordinate(text) => {
                Err(format!("{text} is no site; write joint{}", &text[1..]))
            }
            None => Err(format!(
                "{text} is no site; write joint1, measurement.x, base.rx{}",
                links.first().map_or_else(String::new, |link| format!(" or {link}.curvature_y"))
            )),
        }
    }
}

/// Returns the factors of a formula in alphabetical order, or the formula itself if it is no plain
/// product.
fn factors(formula: &str) -> Vec<String> {
    let mut factors = vec![String::new()];
    let mut depth = 0_usize;
    for sign in formula.chars() {
        match sign {
            '(' => depth += 1,
            ')' => depth = depth.saturating_sub(1),
            _ => {}
        }
        match (depth, sign) {
            (0, '*') => factors.push(String::new()),
            (0, '+' | '-' | '/') => return vec![formula.to_owned()],
            _ => factors.iter_mut().last().into_iter().for_each(|factor| factor.push(sign)),
        }
    }
    factors.sort();
    factors
}

/// Returns true if a text is the coordinate of a joint in formulas, such as `q3`.
fn is_joint_coordinate(text: &str) -> bool {
    text.strip_prefix('q').is_some_and(|number| number.parse::<usize>().is_ok())
}

impl Law {
    /// Creates the law called `name` at a site. `terms` are formulas in the words of `vocabulary`,
    /// `parameters` the named parameters inside the formulas, and `prior` that of the coefficients.
    ///
    /// # Errors
    /// Returns the number of the first wrong formula, counted from 0, and the mistake in it.
    pub fn new(
        name: &str,
        site: LawSite,
        terms: &[impl AsRef<str>],
        prior: Option<LawPrior>,
        parameters: Vec<LawParameter>,
        vocabulary: &Vocabulary,
    ) -> Result<Self, (usize, FormulaError)> {
        let words: Vec<String> =
            parameters.iter().map(|parameter| parameter.name.clone()).collect();
        let vocabulary = Vocabulary { parameters: &words, ..*vocabulary };
        let read = |(k, term): (usize, &_)| {
            parse(AsRef::as_ref(term), &vocabulary).map_err(|error| (k, error))
        };
        Ok(Self {
            name: name.to_owned(),
            place: site.place,
            at: site.at,
            prior,
            terms: terms.iter().enumerate().map(read).collect::<Result<_, _>>()?,
            parameters,
            covariates: vocabulary.covariates.to_vec(),
            composition: None,
        })
    }

    /// Returns the law marked as composed by a search, with ln of its prior probability among all
    /// laws that the search could compose at its site. `rivals` are the laws of other form whose
    /// predictions in the measured poses differ by less than the noise. Each has its share of the
    /// probability that the rivals and this law have together.
    #[must_use]
    pub fn composed(self, ln_prior: f64, rivals: Vec<(Self, f64)>) -> Self {
        Self { composition: Some(Box::new(Composition { ln_prior, rivals })), ..self }
    }

    /// Returns ln of the prior probability of a law that a search composed; `None` for a declared
    /// one.
    pub fn composed_ln_prior(&self) -> Option<f64> {
        self.composition.as_ref().map(|composition| composition.ln_prior)
    }

    /// Returns the laws of other form whose predictions in the measured poses differ from this
    /// one's by less than the noise, each with its share of the probability; none for a declared
    /// law.
    pub fn rivals(&self) -> &[(Self, f64)] {
        self.composition.as_ref().map_or(&[], |composition| &composition.rivals)
    }

    /// Returns the name of the law.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the quantity to which the law adds.
    pub fn at(&self) -> At {
        self.at
    }

    /// Returns the number, counted from 1, of the joint at which the law acts; `None` if there is
    /// none.
    pub fn joint(&self) -> Option<usize> {
        if let LawPlace::Joint(joint) = self.place { Some(joint) } else { None }
    }

    /// Returns the name of the link on which the law acts; `None` if there is none.
    pub fn link(&self) -> Option<&str> {
        if let LawPlace::Link(link) = &self.place { Some(link) } else { None }
    }

    /// Returns the name of the camera on whose images the law acts; `None` if there is none.
    pub fn camera(&self) -> Option<&str> {
        if let LawPlace::Camera(camera) = &self.place { Some(camera) } else { None }
    }

    /// Returns the named parameters inside the formulas.
    pub fn parameters(&self) -> &[LawParameter] {
        &self.parameters
    }

    /// Returns true if a formula uses a named parameter.
    pub fn uses(&self, parameter: &str) -> bool {
        let index = self.parameters.iter().position(|present| present.name == parameter);
        let uses = |term: &Parsed| index.is_some_and(|index| term.expression.uses(index));
        self.terms.iter().any(uses)
    }

    /// Returns the formulas, one for each coefficient.
    pub fn expressions(&self) -> impl Iterator<Item = &Expression> {
        self.terms.iter().map(|term| &term.expression)
    }

    /// Returns the formulas as text, with the names of covariates and parameters.
    pub fn formulas(&self) -> Vec<String> {
        let parameters: Vec<String> =
            self.parameters.iter().map(|parameter| parameter.name.clone()).collect();
        let names = Names { covariates: &self.covariates, parameters: &parameters };
        self.terms.iter().map(|term| term.expression.display(names).to_string()).collect()
    }

    /// Returns true if both laws act at the same site with the same formulas, whatever the order of
    /// the formulas and of the factors in their products.
    pub(crate) fn has_same_terms(&self, other: &Self) -> bool {
        let terms = |law: &Self| {
            let mut terms: Vec<Vec<String>> = law.formulas().iter().map(|of| factors(of)).collect();
            terms.sort();
            terms
        };
        self.site() == other.site() && terms(self) == terms(other)
    }

    /// Returns the site in the syntax of files.
    pub fn site(&self) -> String {
        const AXES: [&str; 3] = ["x", "y", "z"];
        let moved = |axis: usize| MOTION_NAMES.get(axis).copied().unwrap_or_default();
        let field = match self.at {
            At::Tool(axis) => return format!("tool.{}", moved(axis)),
            At::Before(axis) => &format!(".{}", moved(axis)),
            At::After(axis) => &format!(".after.{}", moved(axis)),
            At::Shift(RANGE_AXIS) => return "measurement.range".to_owned(),
            At::Shift(axis) => return format!("measurement.{}", AXES[axis.min(2)]),
            At::BaseShift(axis) => return format!("base.{}", AXES[axis.min(2)]),
            At::BaseTurn(axis) => return format!("base.r{}", AXES[axis.min(2)]),
            At::Beam(BeamField::BowY) => ".curvature_y",
            At::Beam(BeamField::BowZ) => ".curvature_z",
            At::Beam(_) => ".strain",
            At::Camera(field) => field,
            _ => "",
        };
        match &self.place {
            LawPlace::Joint(joint) => format!("joint{joint}{field}"),
            LawPlace::Link(link) => format!("{link}{field}"),
            LawPlace::Camera(camera) => format!("camera[{camera}].{field}"),
            LawPlace::Whole => String::new(),
        }
    }

    /// Returns the site in words: "joint 2", "the base about x", or "curvature of link A about z".
    fn place_in_words(&self) -> String {
        let motion = |axis: usize| {
            let name = MOTION_NAMES.get(axis).copied().unwrap_or_default();
            match name.strip_prefix('r') {
                Some(axis) => format!("about {axis}"),
                None => format!("along {name}"),
            }
        };
        match (&self.place, self.at) {
            (LawPlace::Link(link), At::Beam(BeamField::BowY)) => {
                format!("curvature of link {link} about y")
            }
            (LawPlace::Link(link), At::Beam(BeamField::BowZ)) => {
                format!("curvature of link {link} about z")
            }
            (LawPlace::Link(link), _) => format!("strain of link {link}"),
            (LawPlace::Joint(joint), At::Before(axis)) => {
                format!("the frame before joint {joint} {}", motion(axis))
            }
            (LawPlace::Joint(joint), At::After(axis)) => {
                format!("the frame behind joint {joint} {}", motion(axis))
            }
            (LawPlace::Joint(joint), _) => format!("joint {joint}"),
            (LawPlace::Camera(camera), At::Camera(field)) => format!("{field} of camera {camera}"),
            (_, At::Tool(axis)) => format!("the tool {}", motion(axis)),
            (_, At::Shift(RANGE_AXIS)) => "the measured range".to_owned(),
            (_, At::Shift(axis)) => {
                format!("the measured position or the arm's base {}", motion(axis))
            }
            (_, At::BaseShift(axis)) => format!("the base {}", motion(axis)),
            (_, At::BaseTurn(axis)) => format!("the base {}", motion(axis + 3)),
            _ => self.site(),
        }
    }

    /// Returns the description of the law in words.
    pub(super) fn describe(&self) -> String {
        let (place, formulas) = (self.place_in_words(), self.formulas());
        let errs = match formulas.split_last() {
            Some((last, [])) => {
                let like = if last.contains("/sqrt(1 + ") { ", as a gas spring does" } else { "" };
                format!("{place} errs by a multiple of {last}{like}")
            }
            Some((last, rest)) => {
                format!("{place} errs by multiples of {} and {last}", rest.join(", "))
            }
            None => place,
        };
        if self.composition.is_some() {
            return errs;
        }
        format!("{errs} (law “{}”)", self.name)
    }

    /// Returns the first term that converts an angle between degrees and radians, and its factor.
    pub(crate) fn converted_angle(&self) -> Option<(String, f64)> {
        let mut terms = self.terms.iter().zip(self.formulas());
        terms.find_map(|(term, text)| Some((text, term.expression.converted_angle()?)))
    }

    /// Returns the arguments with their keys, in the order of files.
    pub(super) fn arguments(&self) -> Vec<(&str, Argument)> {
        let mut arguments = vec![
            ("name", Argument::Text(self.name.clone())),
            ("at", Argument::Text(self.site())),
            ("terms", Argument::Texts(self.formulas())),
        ];
        if let Some(LawPrior { key, written, .. }) = &self.prior {
            arguments.push((key, Argument::Length(*written)));
        }
        for LawParameter { name, start, min, max, sigma } in &self.parameters {
            let limits = [("min", *min), ("max", *max), ("sigma", *sigma)];
            let limits = limits.into_iter().filter_map(|(key, value)| Some((key, value?)));
            let numbers = [("start", *start)].into_iter().chain(limits).collect();
            arguments.push((name, Argument::Numbers(numbers)));
        }
        arguments
    }

    /// Returns the coefficients, which are named 1, 2, …, and then the parameters inside the
    /// formulas.
    pub(super) fn entries(&self) -> Vec<EffectTerm> {
        let plain = |name, prior| EffectTerm {
            name,
            at: self.at,
            formula: None,
            prior: Prior::Size(prior),
            nominal: None,
            never_negative: false,
            inner: None,
        };
        let size = self.prior.as_ref().map_or(f64::INFINITY, |prior| prior.sigma);
        let term = |(k, formula): (usize, &Parsed)| EffectTerm {
            formula: Some(formula.clone()),
            ..plain((k + 1).to_string(), size)
        };
        let inner = |parameter: &LawParameter| EffectTerm {
            nominal: Some(Prior::Size(parameter.start)),
            inner: Some(parameter.clone()),
            ..plain(parameter.name.clone(), parameter.sigma.unwrap_or(f64::INFINITY))
        };
        let terms = self.terms.iter().enumerate().map(term);
        terms.chain(self.parameters.iter().map(inner)).collect()
    }
}
