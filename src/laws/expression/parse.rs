//! Formulas read from text, and the words that they may use.

use std::ops::Range;

use super::dimension::Dimension;
use super::mistake::{FormulaError, Mistake};
use super::tree::{Expression, Function, Operator};
use crate::error::nearest;
use crate::laws::quantity::Quantity;

/// Maximum length of a formula \[characters\].
const MAX_LENGTH: usize = 2000;
/// Maximum nesting depth of parentheses, signs and powers, and maximum number of operators in one
/// sum or product.
const MAX_DEPTH: usize = 60;

/// Expression parsed from a formula, with its unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Parsed {
    /// Parsed expression.
    pub expression: Expression,
    /// Unit of the expression.
    pub dimension: Dimension,
}

/// Part of an expression that has been parsed, with its byte range in the text.
struct Part {
    expression: Expression,
    dimension: Dimension,
    span: Range<usize>,
}

/// Parses a formula: sums, products, powers and functions of the words of `vocabulary`.
///
/// # Errors
/// Returns an error with the column if the text is no formula, uses an unknown word, or mixes
/// units.
pub fn parse(text: &str, vocabulary: &Vocabulary) -> Result<Parsed, FormulaError> {
    let mut parser = Parser { text, at: 0, depth: 0, vocabulary };
    if text.chars().count() > MAX_LENGTH {
        return Err(
            parser.error(0..text.len(), Mistake::TooLarge { most: MAX_LENGTH, of: "characters" })
        );
    }
    let part = parser.sum()?;
    match parser.peek() {
        None => Ok(Parsed { expression: part.expression, dimension: part.dimension }),
        Some(_) => Err(parser.unexpected("an operator or the end of the formula")),
    }
}

/// Recursive-descent parser of one formula.
struct Parser<'a> {
    text: &'a str,
    /// Index of the next byte.
    at: usize,
    /// Present nesting depth.
    depth: usize,
    vocabulary: &'a Vocabulary<'a>,
}

impl<'a> Parser<'a> {
    /// Creates the error of a mistake in the byte range `span`.
    fn error(&self, span: Range<usize>, mistake: Mistake) -> FormulaError {
        let before = self.text.get(..span.start).unwrap_or(self.text);
        FormulaError { column: before.chars().count() + 1, span, mistake }
    }

    /// Returns the text that has not been consumed.
    fn rest(&self) -> &'a str {
        self.text.get(self.at..).unwrap_or_default()
    }

    /// Returns the next character that is not a space, without consuming it.
    fn peek(&mut self) -> Option<char> {
        let rest = self.rest();
        self.at += rest.len() - rest.trim_start().len();
        self.rest().chars().next()
    }

    /// Consumes the next character if it is `sign`, spaces before it included. Returns true if it
    /// is.
    fn take(&mut self, sign: char) -> bool {
        let is_next = self.peek() == Some(sign);
        if is_next {
            self.at += sign.len_utf8();
        }
        is_next
    }

    /// Creates the error of a next character that is not `expected`.
    fn unexpected(&mut self, expected: &'static str) -> FormulaError {
        let next = self.peek();
        let end = self.at + next.map_or(0, char::len_utf8);
        let found = next.map_or_else(|| "the end of the formula".to_owned(), String::from);
        self.error(self.at..end, Mistake::Unexpected { expected, found })
    }

    /// Parses a part with `read`, one nesting level deeper.
    fn deeper(
        &mut self,
        read: impl FnOnce(&mut Self) -> Result<Part, FormulaError>,
    ) -> Result<Part, FormulaError> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            let mistake = Mistake::TooLarge { most: MAX_DEPTH, of: "levels of nesting" };
            return Err(self.error(self.at..self.at, mistake));
        }
        let part = read(self);
        self.depth -= 1;
        part
    }

    /// Parses operands joined by + and −.
    fn sum(&mut self) -> Result<Part, FormulaError> {
        let mut left = self.product()?;
        // A chain of operators nests to the left, so it counts towards the depth of the tree.
        let mut chained = 0;
        loop {
            let operator = match self.peek() {
                Some('+') => Operator::Add,
                Some('-' | '−') => Operator::Subtract,
                _ => return Ok(left),
            };
            self.chain(&mut chained)?;
            let right = self.product()?;
            left = self.join(operator, left, right)?;
        }
    }

    /// Parses operands joined by * and /.
    fn product(&mut self) -> Result<Part, FormulaError> {
        let mut left = self.signed()?;
        let mut chained = 0;
        loop {
            let operator = match self.peek() {
                Some('*' | '·') => Operator::Multiply,
                Some('/') => Operator::Divide,
                _ => return Ok(left),
            };
            self.chain(&mut chained)?;
            let right = self.signed()?;
            left = self.join(operator, left, right)?;
        }
    }

    /// Consumes an operator and counts it in `chained`. Returns an error if a chain of operators is
    /// too long.
    fn chain(&mut self, chained: &mut usize) -> Result<(), FormulaError> {
        *chained += 1;
        if *chained > MAX_DEPTH {
            let mistake = Mistake::TooLarge { most: MAX_DEPTH, of: "operands in a row" };
            return Err(self.error(self.at..self.at, mistake));
        }
        self.at += self.peek().map_or(0, char::len_utf8);
        Ok(())
    }

    /// Parses a power with any number of signs before it.
    fn signed(&mut self) -> Result<Part, FormulaError> {
        let start = {
            self.peek();
            self.at
        };
        if self.take('+') {
            return self.deeper(Self::signed);
        }
        if !(self.take('-') || self.take('−')) {
            return self.power();
        }
        let inner = self.deeper(Self::signed)?;
        let expression = match inner.expression {
            Expression::Number(number) if number.is_sign_positive() => Expression::Number(-number),
            other => Expression::Negative(Box::new(other)),
        };
        Ok(Part { expression, dimension: inner.dimension, span: start..inner.span.end })
    }

    /// Parses an operand with an exponent, if there is one.
    fn power(&mut self) -> Result<Part, FormulaError> {
        let base = self.atom()?;
        if !self.take('^') {
            return Ok(base);
        }
        let exponent = self.deeper(Self::signed)?;
        if !exponent.dimension.is_plain() {
            let unit = exponent.dimension.symbol();
            return Err(self.error(exponent.span, Mistake::HasUnit { function: "^", unit }));
        }
        self.join(Operator::Power, base, exponent)
    }

    /// Joins two operands; returns an error if their units do not match.
    fn join(&self, operator: Operator, left: Part, right: Part) -> Result<Part, FormulaError> {
        let span = left.span.start..right.span.end;
        let exponent = match right.expression {
            Expression::Number(number) => Some(number),
            _ => None,
        };
        let Some(dimension) = Dimension::under(operator, left.dimension, right.dimension, exponent)
        else {
            let (left, right) = (left.dimension.symbol(), right.dimension.symbol());
            return Err(self.error(span, Mistake::DifferentUnits { left, right }));
        };
        let expression = Expression::binary(operator, left.expression, right.expression);
        Ok(Part { expression, dimension, span })
    }

    /// Parses an operand without operators: a number, a word, or a formula in parentheses.
    fn atom(&mut self) -> Result<Part, FormulaError> {
        match self.peek() {
            Some('(') => {
                let start = self.at;
                self.at += 1;
                let inner = self.deeper(Self::sum)?;
                if !self.take(')') {
                    return Err(self.unexpected("an operator or )"));
                }
                Ok(Part { span: start..self.at, ..inner })
            }
            Some('0'..='9' | '.') => self.number(),
            Some('`') => self.quoted(),
            Some(c) if c.is_alphabetic() || c == '_' => self.word(),
            _ => Err(self.unexpected("a number, a quantity, a function or (")),
        }
    }

    fn number(&mut self) -> Result<Part, FormulaError> {
        let rest = self.rest();
        let digits = |from: usize| {
            let part = rest.get(from..).unwrap_or_default();
            from + part.len() - part.trim_start_matches(|c: char| c.is_ascii_digit()).len()
        };
        let mut end = digits(0);
        if rest.get(end..).is_some_and(|rest| rest.starts_with('.')) {
            end = digits(end + 1);
        }
        let after = rest.get(end..).unwrap_or_default();
        if let Some(exponent) = after.strip_prefix(['e', 'E']) {
            let sign = usize::from(exponent.starts_with(['+', '-']));
            let last = digits(end + 1 + sign);
            if last > end + 1 + sign {
                end = last;
            }
        }
        let written = rest.get(..end).unwrap_or_default();
        let span = self.at..self.at + end;
        self.at += end;
        match written.parse::<f64>() {
            Ok(number) if number.is_finite() => {
                let expression = Expression::Number(number);
                Ok(Part { expression, dimension: Dimension::FLEXIBLE, span })
            }
            _ => Err(self.error(span, Mistake::NotFinite { number: written.to_owned() })),
        }
    }

    /// Parses the name of a covariate in backquotes.
    fn quoted(&mut self) -> Result<Part, FormulaError> {
        let start = self.at;
        let inner = self.rest().get(1..).unwrap_or_default();
        let Some(length) = inner.find('`') else {
            return Err(self.error(
                start..self.text.len(),
                Mistake::Unexpected {
                    expected: "a name between backquotes",
                    found: "one that does not end".to_owned(),
                },
            ));
        };
        self.at += length + 2;
        let name = inner.get(..length).unwrap_or_default();
        if let Some(index) =
            self.vocabulary.covariates.iter().position(|covariate| covariate == name)
        {
            Ok(covariate(index, start..self.at))
        } else {
            let near = nearest(name, self.vocabulary.covariates).cloned();
            let mistake = Mistake::UnknownWord { word: name.to_owned(), near };
            Err(self.error(start..self.at, mistake))
        }
    }

    /// Parses a word: a parameter, a covariate, a quantity, a constant, or the name of a function.
    fn word(&mut self) -> Result<Part, FormulaError> {
        let start = self.at;
        let rest = self.rest();
        let length = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
        let word = rest.get(..length).unwrap_or_default();
        self.at += length;
        let span = start..self.at;
        if self.peek() == Some('(') {
            return self.call(word, span);
        }
        let of = |expression, dimension| Ok(Part { expression, dimension, span: span.clone() });
        let quantity = |quantity, dimension| of(Expression::Quantity(quantity), dimension);
        // Names that the problem declares take precedence over built-in words of the same spelling.
        if let Some(index) =
            self.vocabulary.parameters.iter().position(|parameter| parameter == word)
        {
            return of(Expression::Parameter(index), Dimension::FLEXIBLE);
        }
        if let Some(index) =
            self.vocabulary.covariates.iter().position(|covariate| covariate == word)
        {
            return Ok(covariate(index, span));
        }
        if let Some((_, joint)) = self.vocabulary.joints.iter().find(|(name, _)| name == word) {
            return quantity(Quantity::Command(*joint), self.command_dimension(*joint));
        }
        match word {
            "pi" => return of(Expression::Number(std::f64::consts::PI), Dimension::FLEXIBLE),
            "T" => return quantity(Quantity::Warming, Dimension::KELVIN),
            "t" => return quantity(Quantity::Elapsed, Dimension::SECOND),
            "time" => return quantity(Quantity::Time, Dimension::SECOND),
            "payload" => return quantity(Quantity::Payload, Dimension::MASS),
            "hoist" => return quantity(Quantity::Hoist, Dimension::FORCE),
            _ => {}
        }
        for (prefix, of) in [("approach", None), ("q", Some(())), ("M", None)] {
            let Some(number) = numbered(word, prefix) else { continue };
            let joints = self.vocabulary.slides.len();
            if number == 0 || number > joints {
                let mistake = Mistake::NoJoint { word: word.to_owned(), joints };
                return Err(self.error(span, mistake));
            }
            let joint = number - 1;
            return match (prefix, of) {
                ("M", _) => quantity(Quantity::Moment(joint), Dimension::TORQUE),
                (_, Some(())) => quantity(Quantity::Command(joint), self.command_dimension(joint)),
                _ => quantity(Quantity::Approach(joint), Dimension::PLAIN),
            };
        }
        Err(self.error(span, self.unknown(word)))
    }

    /// Returns the mistake of an unknown word, with the most similar known one.
    fn unknown(&self, word: &str) -> Mistake {
        let Vocabulary { slides, joints, covariates, parameters } = self.vocabulary;
        let commands = (1..=slides.len()).map(|number| format!("q{number}"));
        let sides = (1..=slides.len()).map(|number| format!("approach{number}"));
        let moments = (1..=slides.len()).map(|number| format!("M{number}"));
        let quantities = Vocabulary::QUANTITIES.map(str::to_owned).into_iter();
        let functions = Function::ALL.iter().map(|(_, name)| (*name).to_owned());
        let names = joints.iter().map(|(name, _)| name.clone());
        let words = parameters.iter().chain(*covariates).cloned();
        let candidates = words
            .chain(names)
            .chain(commands)
            .chain(sides)
            .chain(moments)
            .chain(quantities)
            .chain(functions);
        // A controller calls its joints A1, J1 or axis1.
        let number = word.trim_start_matches(|c: char| c.is_ascii_alphabetic() || c == '_');
        let joint = number.parse().ok().filter(|joint| (1..=slides.len()).contains(joint));
        let command = || joint.map(|joint| format!("q{joint}, the command of joint {joint}"));
        Mistake::UnknownWord {
            word: word.to_owned(),
            near: nearest(word, candidates).or_else(command),
        }
    }

    /// Returns the unit of the command of a joint, counted from 0.
    fn command_dimension(&self, joint: usize) -> Dimension {
        let slides = self.vocabulary.slides.get(joint).copied().unwrap_or(false);
        if slides { Dimension::LENGTH } else { Dimension::ANGLE }
    }

    /// Parses the arguments of a function; its name, at `span`, has been consumed.
    fn call(&mut self, name: &str, span: Range<usize>) -> Result<Part, FormulaError> {
        self.take('(');
        let mut arguments = Vec::new();
        loop {
            arguments.push(self.deeper(Self::sum)?);
            if self.take(')') {
                break;
            }
            if !self.take(',') {
                return Err(self.unexpected("an operator, a comma or )"));
            }
        }
        let whole = span.start..self.at;
        let found = arguments.len();
        let characters: Vec<char> = self.text.chars().collect();
        let is_decimal_comma = |three: &[char]| {
            three[1] == ',' && three[0].is_ascii_digit() && three[2].is_ascii_digit()
        };
        let has_decimal_comma = characters.windows(3).any(is_decimal_comma);
        let wrong =
            |function, takes| Mistake::Arguments { function, takes, found, has_decimal_comma };
        if let Some((function, known)) = Function::ALL.iter().find(|(_, known)| *known == name) {
            let Ok([argument]) = <[Part; 1]>::try_from(arguments) else {
                return Err(self.error(span, wrong(known, 1)));
            };
            return self.apply(*function, argument, whole);
        }
        if let Some((operator, known)) = Operator::CALLS.iter().find(|(_, known)| *known == name) {
            let Ok([left, right]) = <[Part; 2]>::try_from(arguments) else {
                return Err(self.error(span, wrong(known, 2)));
            };
            let part = self.join(*operator, left, right)?;
            return Ok(Part { span: whole, ..part });
        }
        let numbers = arguments.iter().map(|part| &part.expression).collect::<Vec<_>>();
        let (quantity, dimension) = match (name, numbers.as_slice()) {
            (
                "lag",
                &[Expression::Quantity(Quantity::Warming), &Expression::Number(time_constant)],
            ) if time_constant > 0.0 => (Quantity::Lagging { time_constant }, Dimension::KELVIN),
            (
                "friction",
                &[&Expression::Quantity(Quantity::Command(joint)), &Expression::Number(distance)],
            ) if distance > 0.0 => (Quantity::Friction { joint, distance }, Dimension::PLAIN),
            ("lag", _) => {
                let write = "lag(T, seconds) with a time constant above 0";
                return Err(self.error(whole, Mistake::Form { write }));
            }
            ("friction", _) => {
                let write = "friction(q1, distance) with a joint's command and a distance above 0";
                return Err(self.error(whole, Mistake::Form { write }));
            }
            _ => return Err(self.error(span, Self::unknown_function(name))),
        };
        Ok(Part { expression: Expression::Quantity(quantity), dimension, span: whole })
    }

    fn unknown_function(name: &str) -> Mistake {
        let functions = Function::ALL.iter().map(|(_, name)| *name);
        let names_of_functions = functions.chain(Operator::CALLS.iter().map(|(_, name)| *name));
        let near = nearest(name, names_of_functions.chain(["lag", "friction"])).map(str::to_owned);
        Mistake::UnknownFunction { word: name.to_owned(), near }
    }

    fn apply(
        &self,
        function: Function,
        argument: Part,
        span: Range<usize>,
    ) -> Result<Part, FormulaError> {
        let Part { expression, dimension, span: inner } = argument;
        let dimension = match function {
            Function::Abs => dimension,
            Function::Sqrt => dimension.power(Some(0.5)),
            Function::Sign | Function::Step => Dimension::PLAIN,
            _ if dimension.is_plain() => Dimension::PLAIN,
            _ => {
                let (function, unit) = (function.name(), dimension.symbol());
                return Err(self.error(inner, Mistake::HasUnit { function, unit }));
            }
        };
        let expression = Expression::Call(function, Box::new(expression));
        Ok(Part { expression, dimension, span })
    }
}

fn covariate(index: usize, span: Range<usize>) -> Part {
    let expression = Expression::Quantity(Quantity::Covariate(index));
    Part { expression, dimension: Dimension::COVARIATE, span }
}

/// Returns the number after `prefix` in a word such as `q12`; `None` if the word has another form.
fn numbered(word: &str, prefix: &str) -> Option<usize> {
    let digits = word.strip_prefix(prefix)?;
    let is_number = !digits.is_empty() && digits.chars().all(|c| c.is_ascii_digit());
    is_number.then(|| digits.parse().unwrap_or(usize::MAX))
}

/// Words of a problem that formulas may use in addition to the built-in ones.
#[derive(Debug, Clone, Copy, Default)]
pub struct Vocabulary<'a> {
    /// True for each prismatic joint.
    pub slides: &'a [bool],
    /// Names of joints with their indices from 0.
    pub joints: &'a [(String, usize)],
    /// Names of the covariates of the problem.
    pub covariates: &'a [String],
    /// Names of the parameters inside the formula.
    pub parameters: &'a [String],
}

impl Vocabulary<'_> {
    /// Quantities whose name is one word, in the syntax of formulas.
    pub const QUANTITIES: [&'static str; 5] = ["T", "t", "time", "payload", "hoist"];

    /// Returns true if a word has a meaning in formulas on any arm: a quantity, a function or a
    /// constant.
    pub fn is_reserved(word: &str) -> bool {
        let is_numbered = ["q", "approach", "M"].into_iter().any(|prefix| {
            let digits = word.strip_prefix(prefix).unwrap_or_default();
            !digits.is_empty() && digits.chars().all(|c| c.is_ascii_digit())
        });
        let operators = Operator::CALLS.iter().map(|(_, name)| *name);
        let mut names = Function::ALL.iter().map(|(_, name)| *name).chain(operators);
        is_numbered
            || Self::QUANTITIES.contains(&word)
            || ["pi", "lag", "friction"].contains(&word)
            || names.any(|name| name == word)
    }
}
