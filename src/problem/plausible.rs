//! Warnings about values of the arm that are probably in another unit or convention.

use std::f64::consts::TAU;

use super::pattern::matches;
use super::section::Section;
use super::{Body, CENTRE_X, Effect, FOCAL_X, Fixture, Joint, JointKind, ParameterRule, Problem};
use crate::error::{InputError, InputErrorKind, Location, Warning, WarningKind};
use crate::observation::FixtureKind;
use crate::quantity::format::{number, two_digits};
use crate::quantity::unrounded_right_angle;

/// Largest plausible length in the joint table \[m\]. Longer ones are probably in millimetres.
const MAX_PLAUSIBLE_LENGTH: f64 = 20.0;
/// Largest usual limit of a joint \[rad\]. If no limit in degrees is larger than this number, the
/// limits are suspected to be in radians.
const MAX_LIMIT_RADIANS: f64 = TAU + 0.02;
/// Largest plausible limit of a joint in radians \[turns\].
const MAX_LIMIT_TURNS: f64 = 6.0;
/// Largest plausible angle of the joint table in radians \[turns\]: one, with a margin for
/// rounding.
const MAX_ANGLE_TURNS: f64 = 1.01;
/// Largest plausible distance of a fixture from the origin of the measuring frame, or between two
/// points, as a multiple of the length of the arm's links.
const MAX_FIXTURE_LINKS: f64 = 20.0;
/// Smallest distance of the centre of a lens from the middle of its images, relative to their
/// diagonal, at which its coordinates may be exchanged, and the largest one of usual lenses.
const MIN_EXCHANGED_OFF: f64 = 0.15;
const MAX_USUAL_OFF: f64 = 0.08;
/// Smallest plausible focal length, relative to the width of the image: an angle of view of 157°.
const MIN_FOCAL_LENGTH: f64 = 0.1;
/// Smallest plausible size of a marker \[m\].
const MIN_MARKER: f64 = 2e-3;
/// Minimum number of rows or turning joints from which the convention of a table is judged.
const MIN_ROWS_TO_JUDGE_FORM: usize = 3;

/// Returns warnings about a `[[joint]]`: angles that look like radians, lengths that look like
/// millimetres.
pub(super) fn joint_warnings(section: &Section<'_, '_>) -> Vec<Warning> {
    let mut warnings = Vec::new();
    for key in ["alpha_deg", "theta_deg", "beta_deg"] {
        let Some(item) = section.peek(key) else { continue };
        let angle = item
            .written_number()
            .and_then(|text| Some((text, unrounded_right_angle(text)?)))
            .filter(|(_, angle)| angle.abs() <= TAU);
        if let Some((text, angle)) = angle {
            let kind = WarningKind::LooksLikeRadians {
                value: text.to_owned(),
                degrees: format!("{:.0}", angle.to_degrees()),
                radians: format!("{}_rad", key.trim_end_matches("_deg")),
            };
            warnings.push(Warning { location: item.location(), kind });
        }
    }
    let angles = [
        ("a limit", ["min_rad", "max_rad"].as_slice(), MAX_LIMIT_TURNS),
        ("an angle", &["alpha_rad", "theta_rad", "beta_rad"], MAX_ANGLE_TURNS),
    ];
    for (what, keys, most) in angles {
        for item in keys.iter().filter_map(|key| section.peek(key)) {
            let turns = item.number().map_or(0.0, |angle| angle.abs() / TAU);
            if turns > most && turns.is_finite() {
                let write = item.key.rsplit('.').next().unwrap_or_default().replace("_rad", "_deg");
                let kind =
                    WarningKind::AngleLooksLikeDegrees { what, turns: two_digits(turns, 1), write };
                warnings.push(Warning { location: item.location(), kind });
            }
        }
    }
    for key in ["a_m", "d_m", "min_m", "max_m"] {
        let Some(item) = section.peek(key) else { continue };
        let length = item.number().ok().filter(|length| length.abs() > MAX_PLAUSIBLE_LENGTH);
        if let Some(length) = length {
            let millimetres = format!("{}_mm", key.trim_end_matches("_m"));
            let kind = WarningKind::LooksLikeMillimetres { value: length.to_string(), millimetres };
            warnings.push(Warning { location: item.location(), kind });
        }
    }
    warnings
}

/// Returns warnings about the conditions of the problem in `root`: the size of gravity and the
/// reference temperature.
pub(super) fn condition_warnings(root: &Section<'_, '_>) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if let Some(item) = root.peek("gravity_m_s2")
        && let Ok(gravity) = item.vector()
    {
        let size = gravity.norm();
        let is_unit = (size - 1.0).abs() < MAX_UNIT_DEVIATION;
        if is_unit || size > MAX_GRAVITY {
            let kind = WarningKind::UnusualGravity { size: size.to_string(), is_unit };
            warnings.push(Warning { location: item.location(), kind });
        }
    }
    let data = root.peek("data").and_then(|item| item.section().ok());
    if let Some(item) = data.and_then(|data| data.peek("reference_temperature_C"))
        && let Some(value) = item.number().ok().filter(|value| *value > MAX_REFERENCE_TEMPERATURE)
    {
        let kind = WarningKind::HotReference { value: value.to_string() };
        warnings.push(Warning { location: item.location(), kind });
    }
    warnings
}

/// Returns a warning if a joint table without the key `dh` has the zeros of a standard DH table. In
/// such a table α of the first row is not zero, and both α and a of the last row are.
pub(super) fn form_warning(joints: &[Joint]) -> Option<Warning> {
    let (first, last) = (joints.first()?, joints.last()?);
    let is_standard = joints.len() >= MIN_ROWS_TO_JUDGE_FORM
        && first.alpha != 0.0
        && (last.alpha, last.a) == (0.0, 0.0)
        && joints.iter().all(|joint| joint.kind != JointKind::Fixed && joint.beta == 0.0);
    is_standard.then(|| Warning {
        location: first.location.clone(),
        kind: WarningKind::LooksLikeStandardForm,
    })
}

/// Largest ratio of one mass of an arm without equilibrium to all others together, up to which it
/// is not doubted.
const MAX_MASS_RATIO: f64 = 10.0;
/// Largest plausible mass of one body of an arm \[kg\]. The heaviest industrial arms weigh some
/// thousands of kilograms in all.
const MAX_BODY_MASS: f64 = 1000.0;
/// Largest mass of a part, of an arm without an equilibrium, that is not taken for one in grams \[kg\]: 10 000 g are 10 kg.
const MAX_PLAUSIBLE_MASS: f64 = 1e4;
/// Largest plausible size of gravity \[m/s²\]; that of Jupiter is 25.
const MAX_GRAVITY: f64 = 30.0;
/// Largest plausible rotation of an elastic joint by gravity \[rad\].
const MAX_GRAVITY_ROTATION: f64 = 1.0;
/// Highest plausible reference temperature \[°C\]. A cold room in kelvins exceeds it.
const MAX_REFERENCE_TEMPERATURE: f64 = 200.0;
/// Largest difference from 1 at which the size of gravity counts as that of a unit vector.
const MAX_UNIT_DEVIATION: f64 = 1e-6;
/// Smallest cosine between a hoist's direction and gravity at which the hoist pulls downwards.
const MIN_DOWNWARD_COSINE: f64 = 0.7;
/// Largest plausible distance of a centre of mass from the frame of its joint \[m\].
const MAX_BODY_DISTANCE: f64 = 10.0;

impl Joint {
    /// Returns the names and masses \[kg\] of the link of the joint and of the bodies on it.
    fn named_masses(&self) -> impl Iterator<Item = (&str, f64)> {
        let beam = self.beam.iter();
        let carried = beam.clone().flat_map(|beam| &beam.masses).chain(&self.bodies);
        let carried = carried.map(|body| (body.name.as_str(), body.mass));
        carried.chain(beam.map(|beam| (beam.name.as_str(), beam.mass)))
    }
}

impl Problem {
    /// Returns warnings about values of the arm that are probably in another unit or convention.
    #[doc(hidden)]
    pub fn plausibility_warnings(&self) -> Vec<Warning> {
        let warnings = self.warnings.iter().cloned();
        let warnings =
            warnings.chain(self.far_target_warning()).chain(self.narrow_limits_warning());
        let warnings = warnings.chain(self.far_fixtures());
        warnings
            .chain(self.body_warnings())
            .chain(self.stiff_beam_warning())
            .chain(self.hoist_direction_warning())
            .chain(self.no_gravity())
            .chain(self.converted_angle())
            .chain(self.overridden_rule())
            .collect()
    }

    /// Returns a warning if gravity is zero and a part of the arm gives way.
    fn no_gravity(&self) -> Option<Warning> {
        let gives_way = self.is_elastic()
            || self
                .effects
                .iter()
                .any(|declared| matches!(declared.effect, Effect::JointCompliance { .. }));
        let is_loaded = self.declared_mass() > 0.0 || self.tool.payload_mass > 0.0;
        let location = Location { line: None, excerpt: None, ..self.data.location.clone() };
        (gives_way && is_loaded && self.gravity.norm() == 0.0).then(|| Warning {
            location: location.with_key("gravity_m_s2"),
            kind: WarningKind::NoGravity,
        })
    }

    /// Returns a warning for the first declared law that converts an angle between degrees and
    /// radians.
    fn converted_angle(&self) -> Option<Warning> {
        let found = self.effects.iter().find_map(|declared| match &declared.effect {
            Effect::Law(law) => Some((&declared.location, law.converted_angle()?)),
            _ => None,
        });
        let (location, (term, factor)) = found?;
        Some(Warning {
            location: Location { excerpt: None, ..location.clone() },
            kind: WarningKind::AngleConverted { term, factor: format!("{factor:.4}") },
        })
    }

    /// Returns a warning for the first rule of `[parameters]` that one later rule replaces for all
    /// of its parameters.
    ///
    /// A pattern that matches the text of another one, whose `*` count as characters, matches every
    /// name that this one matches.
    fn overridden_rule(&self) -> Option<Warning> {
        let rules = || self.parameters.iter().enumerate();
        let mut of_geometry = rules().filter(|(_, rule)| {
            let of_joint = rule.pattern.strip_prefix("joint");
            let is_of_joint = of_joint
                .is_some_and(|rest| rest.starts_with(|c: char| c == '*' || c.is_ascii_digit()));
            is_of_joint || ["base", "tool"].iter().any(|owner| rule.pattern.starts_with(owner))
        });
        let overridden = |(place, rule): (usize, &ParameterRule)| {
            // A rule for a joint that is not declared has no parameters at all.
            let digits = |c: char| !c.is_ascii_digit();
            let number =
                rule.pattern.strip_prefix("joint").and_then(|rest| rest.split(digits).next());
            let number = number.and_then(|number| number.parse::<usize>().ok());
            if number.is_some_and(|number| number > self.joints.len()) {
                return None;
            }
            let mut later = rules().skip(place + 1).map(|(_, later)| later);
            let by = later.find(|later| matches(&later.pattern, &rule.pattern))?;
            Some(Warning {
                location: rule.location.clone(),
                kind: WarningKind::RuleOverridden {
                    by: by.pattern.clone(),
                    line: by.location.line?,
                },
            })
        };
        of_geometry.find_map(overridden)
    }

    /// Returns a warning for the first mass of a joint that is too heavy for an arm, and for the
    /// first one whose centre is too far away.
    fn body_warnings(&self) -> Vec<Warning> {
        let bodies = || {
            self.joints.iter().flat_map(|joint| joint.bodies.iter().map(move |body| (joint, body)))
        };
        let warning = |(joint, body): (&Joint, &Body), kind: WarningKind| Warning {
            location: joint.location.of_key(format!("body {}", body.name)),
            kind,
        };
        let heavy = bodies().find(|(_, body)| body.mass > MAX_BODY_MASS).map(|found| {
            let mass = found.1.mass.to_string();
            warning(found, WarningKind::LooksLikeGrams { mass })
        });
        let far = bodies().find(|(_, body)| body.position.norm() > MAX_BODY_DISTANCE);
        let far = far.map(|found| {
            let distance = format!("{:.3}", found.1.position.norm());
            warning(found, WarningKind::FarBody { distance })
        });
        heavy.into_iter().chain(far).collect()
    }

    /// Returns the sum of the declared masses of the arm \[kg\], without the payload.
    pub(crate) fn declared_mass(&self) -> f64 {
        let beams = self.joints.iter().filter_map(|joint| joint.beam.as_ref());
        let of_beams = beams.map(|beam| beam.mass + Body::total_mass(&beam.masses));
        of_beams.chain(self.joints.iter().map(|joint| Body::total_mass(&joint.bodies))).sum()
    }

    /// Returns the error of a pose without equilibrium with the name of the mass that is probably
    /// too heavy, or of the joint that is probably too soft; returns any other error as it is.
    /// `payload` is the largest payload of the rows \[kg\].
    pub(crate) fn with_cause_of_overload(&self, error: InputError, payload: f64) -> InputError {
        match *error.kind {
            InputErrorKind::NoEquilibrium => {
                let kind = self.heavy_mass_error(payload).or_else(|| self.soft_joint_error());
                error.location.error(kind.unwrap_or(InputErrorKind::NoEquilibrium))
            }
            kind => error.location.error(kind),
        }
    }

    /// Returns an error that names the first part beyond [`MAX_PLAUSIBLE_MASS`] or the payload of
    /// `payload` kg beyond [`MAX_BODY_MASS`], or a part of the arm that is more than [`MAX_MASS_RATIO`] times as
    /// heavy as all others together.
    fn heavy_mass_error(&self, payload: f64) -> Option<InputErrorKind> {
        let parts = || self.joints.iter().flat_map(Joint::named_masses);
        let mut beyond = parts().filter(|(_, mass)| *mass > MAX_PLAUSIBLE_MASS).chain(
            [("the payload", payload)].into_iter().filter(|(_, mass)| *mass > MAX_BODY_MASS),
        );
        let found = |(name, mass): (&str, f64), how: String| InputErrorKind::HeavyMass {
            name: name.to_owned(),
            mass: two_digits(mass, 3),
            how,
        };
        if let Some(first) = beyond.next() {
            let how = match beyond.count() {
                0 => "too heavy for an arm".to_owned(),
                1 => "too heavy for an arm, and so is another one".to_owned(),
                others => format!("too heavy for an arm, and so are {others} others"),
            };
            return Some(found(first, how));
        }
        let heaviest = parts().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let ratio = heaviest.1 / (self.declared_mass() - heaviest.1);
        let how = || format!("{} times as heavy as all others together", two_digits(ratio, 0));
        (ratio.is_finite() && ratio > MAX_MASS_RATIO).then(|| found(heaviest, how()))
    }

    /// Returns an error that names the joint that gravity would turn furthest, if by more than
    /// [`MAX_GRAVITY_ROTATION`]. The moment is an upper bound, with all links stretched out.
    fn soft_joint_error(&self) -> Option<InputErrorKind> {
        let gravity = self.gravity.norm();
        if !self.is_chain() || gravity > MAX_GRAVITY {
            return None;
        }
        let length = |joint: &Joint| {
            joint.a.abs()
                + joint.d.abs()
                + joint.placement.as_ref().map_or(0.0, |placement| placement.xyz.norm())
        };
        let moment = |first: usize| {
            let (mut reach, mut moment) = (0.0, 0.0);
            for joint in self.joints.iter().skip(first) {
                let bodies = joint.bodies.iter().map(|body| (body.mass, body.position.norm()));
                if let Some(beam) = &joint.beam {
                    moment +=
                        (beam.mass + Body::total_mass(&beam.masses)) * (reach + joint.a.abs());
                }
                reach += length(joint);
                moment += bodies.map(|(mass, distance)| mass * (reach + distance)).sum::<f64>();
            }
            let at = reach + self.tool.payload_at.norm();
            gravity * (moment + self.tool.payload_mass * at)
        };
        let sags = self.joints.iter().enumerate().filter_map(|(index, joint)| {
            let moment = moment(index);
            Some((index + 1, joint, moment, moment / joint.stiffness?))
        });
        let (number, joint, moment, angle) = sags.max_by(|a, b| a.3.total_cmp(&b.3))?;
        let place = Location { key: None, excerpt: None, ..joint.location.clone() };
        (angle > MAX_GRAVITY_ROTATION).then(|| InputErrorKind::SoftJoint {
            joint: format!("joint {number} ({place})"),
            moment: format!("{moment:.1}"),
            angle: format!("{angle:.1}"),
        })
    }

    /// Returns a warning for the first beam whose radius of gyration, by its rigidities, exceeds
    /// its length.
    fn stiff_beam_warning(&self) -> Option<Warning> {
        self.joints.iter().find_map(|joint| {
            let beam = joint.beam.as_ref()?;
            let rigidity = beam.ei_y.into_iter().chain(beam.ei_z).fold(0.0, f64::max);
            let (radius, length) = ((rigidity / beam.ea?).sqrt(), joint.a.abs());
            let key = format!("beam {}.EI", beam.name);
            let kind = WarningKind::StiffBeam {
                radius: format!("{radius:.3}"),
                length: format!("{length:.3}"),
            };
            (radius > length).then(|| Warning { location: joint.location.of_key(key), kind })
        })
    }

    /// Returns a warning for the first hoist that pulls along gravity.
    fn hoist_direction_warning(&self) -> Option<Warning> {
        let down = self.gravity.try_normalize(0.0)?;
        self.joints.iter().find_map(|joint| {
            let beam = joint.beam.as_ref()?;
            let hoist = beam.hoist.as_ref()?;
            let key = format!("beam {}.hoist.direction", beam.name);
            let pulls_down = hoist.direction.dot(&down) > MIN_DOWNWARD_COSINE;
            pulls_down.then(|| Warning {
                location: joint.location.of_key(key),
                kind: WarningKind::HoistPullsDown,
            })
        })
    }

    /// Returns a warning if the limits of all turning joints, in degrees, are so small that they
    /// are probably in radians.
    fn narrow_limits_warning(&self) -> Option<Warning> {
        let turning: Vec<&Joint> =
            self.joints.iter().filter(|joint| joint.kind == JointKind::Revolute).collect();
        let widest = |joint: &&Joint| joint.limits.0.abs().max(joint.limits.1.abs());
        let widest = turning.iter().map(widest).fold(0.0, f64::max).to_degrees();
        let first = turning.first().filter(|_| turning.len() >= MIN_ROWS_TO_JUDGE_FORM)?;
        (widest > 0.0 && widest <= MAX_LIMIT_RADIANS).then(|| Warning {
            location: first.location.clone(),
            kind: WarningKind::LimitsLookLikeRadians { widest: format!("{widest:.1}") },
        })
    }

    /// Returns a warning if a target, or the payload, is farther from its frame than twice the length
    /// of the arm.
    fn far_target_warning(&self) -> Option<Warning> {
        let tool_location = |key: &str| Location {
            line: None,
            excerpt: None,
            ..self.data.location.clone().with_key(key)
        };
        let farthest = self.targets.iter().max_by(|a, b| a.at.norm().total_cmp(&b.at.norm()));
        let target = farthest.map_or_else(
            || (tool_location("tool.target"), self.tool.target, "target_mm"),
            |target| (target.location.clone(), target.at, "target_mm"),
        );
        let payload = (tool_location("tool.payload_at"), self.tool.payload_at, "payload_at_mm");
        let is_farther = payload.1.norm() > target.1.norm();
        let (location, place, write) = if is_farther { payload } else { target };
        let (links, distance) = (self.length_of_links(), place.norm());
        let kind = WarningKind::FarTarget {
            distance: format!("{distance:.3}"),
            links: format!("{links:.3}"),
            write,
        };
        (links > 0.0 && distance > 2.0 * links).then_some(Warning { location, kind })
    }

    /// Returns a warning for the first fixture, and for the first known distance, that is far beyond
    /// the size of the arm.
    fn far_fixtures(&self) -> Vec<Warning> {
        let links = self.length_of_links();
        let limit = (MAX_FIXTURE_LINKS * links).max(MAX_PLAUSIBLE_LENGTH);
        let warning = |location: &Location, key: &str, length: f64| {
            let kind = WarningKind::FarFixture {
                length: format!("{length:.3}"),
                links: format!("{links:.3}"),
                write: format!("{key}mm"),
            };
            Warning { location: location.of_key(format!("{key}m")), kind }
        };
        let place = |fixture: &Fixture| {
            let axes = fixture.known.iter().take(3).map(|known| known.unwrap_or(0.0).powi(2));
            axes.sum::<f64>().sqrt()
        };
        let has_place = |fixture: &&Fixture| {
            let kind = fixture.kind;
            matches!(kind, FixtureKind::Point | FixtureKind::Anchor | FixtureKind::Sphere)
        };
        let far = self.fixtures.iter().filter(has_place).find(|fixture| place(fixture) > limit);
        let far = far.map(|fixture| warning(&fixture.location, "at_", place(fixture)));
        let long = self.distances.iter().find(|known| known.length > limit);
        let long = long.map(|known| warning(&known.location, "", known.length));
        let size = |fixture: &Fixture| {
            fixture.points.first().map(|first| {
                let distances = fixture.points.iter().map(|point| (point - first).norm());
                distances.fold(0.0, f64::max)
            })
        };
        let is_tiny = |size: f64| size > 0.0 && size < MIN_MARKER;
        let tiny = self.fixtures.iter().find_map(|fixture| {
            let size = size(fixture).filter(|size| is_tiny(*size))?;
            let kind = WarningKind::TinyMarker { size: format!("{:.3}", size * 1e3) };
            Some(Warning { location: fixture.location.of_key("points_mm"), kind })
        });
        let short = self.fixtures.iter().find_map(|fixture| {
            let is_camera = fixture.kind == FixtureKind::Camera;
            let [focal, centre] = [FOCAL_X, CENTRE_X]
                .map(|field| fixture.known.get(field).copied().flatten().filter(|_| is_camera));
            let width = fixture.image.map(|[width, _]| width).or(centre.map(|centre| 2.0 * centre));
            let (focal, width) = (focal?, width?);
            let kind = WarningKind::ShortFocalLength {
                focal: number(focal, 2),
                width: format!("{width:.0}"),
            };
            let location = fixture.location.of_key("focal_px");
            (focal < MIN_FOCAL_LENGTH * width).then_some(Warning { location, kind })
        });
        let exchanged = self.fixtures.iter().find_map(Fixture::exchanged_centre);
        let far = far.into_iter().chain(long).filter(|_| links > 0.0);
        far.chain(tiny).chain(short).chain(exchanged).collect()
    }

    /// Returns the length of all links together, with the travel of sliding joints \[m\].
    pub(crate) fn length_of_links(&self) -> f64 {
        let length = |joint: &Joint| {
            let placed = joint.placement.as_ref().map_or(0.0, |placement| placement.xyz.norm());
            let (min, max) = joint.limits;
            let travel =
                if joint.kind == JointKind::Prismatic { min.abs().max(max.abs()) } else { 0.0 };
            joint.a.hypot(joint.d) + placed + travel
        };
        self.joints.iter().map(length).sum()
    }
}

impl Fixture {
    /// Returns a warning if the centre of the lens of a camera is far from the middle of its images,
    /// and near it with its two coordinates exchanged.
    fn exchanged_centre(&self) -> Option<Warning> {
        let [width, height] = self.image?;
        let &[Some(x), Some(y)] = self.known.get(CENTRE_X..CENTRE_X + 2)? else { return None };
        let off = |x: f64, y: f64| (x - width / 2.0).hypot(y - height / 2.0) / width.hypot(height);
        let centre = [x, y];
        let kind = WarningKind::CentreExchanged {
            centre: centre.map(|value| value.to_string()),
            image: [width, height].map(|size| size.to_string()),
        };
        let is_exchanged = off(x, y) > MIN_EXCHANGED_OFF && off(y, x) < MAX_USUAL_OFF;
        is_exchanged.then(|| Warning { location: self.location.of_key("centre_px"), kind })
    }
}
