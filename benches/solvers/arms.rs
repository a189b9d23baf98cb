//! Problems of robot arms: a rigid UR10, and elastic arms under their loads.

use flexcal::fit::Placement;
use flexcal::least_squares::solver::Bounds;
use flexcal::least_squares::{LeastSquares as _, LinearRows, Loss};
use flexcal::measurement::Dataset;
use flexcal::model::{Model, PoseResiduals};
use flexcal::problem::Problem;
use nalgebra::{DMatrix, DVector};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::bounded::Bounded;
use crate::case::{Case, Class};
use crate::common::file;
use crate::common::ur10::Ur10;
use crate::made;

/// Standard deviation of the errors of the lunar sampler, and its bounds [standard deviations of
/// the priors].
const ERRORS: f64 = 0.3;
/// Distance of a far start from the true value of every parameter [standard deviations of the
/// priors].
const FAR: f64 = 5.0;
/// Number of far starts.
const FAR_STARTS: usize = 3;

/// Names of the limits of `tests/cases/bounded`: from slightly to strongly binding, and contrary to
/// the truth.
const LIMITS: [&str; 5] = [
    "stiffness",
    "tight-geometry",
    "mild-constraints",
    "against-the-truth",
    "constraints-against-the-truth",
];
/// Losses with their names in `[robust]`.
const LOSSES: [(&str, Loss); 2] = [
    ("huber", Loss::Huber { threshold: Loss::HUBER_POSITION }),
    ("l1", Loss::L1 { slope: Loss::L1_POSITION, smoothing: Loss::L1_SMOOTHING }),
];

/// All arms with their poses.
pub struct Arms {
    ur10: [Ur10; 3],
    /// Arms to be fitted with bounds.
    boxed: [Ur10; 2],
    /// Arms with gross errors of some measurements.
    gross: [Ur10; 3],
    pub lunar: [Lunar; 2],
    /// Names and problems of the arms with limits.
    limited: Vec<(String, Bounded)>,
    /// Arm of `tests/cases/bounded` with gross errors of some measurements.
    gross_bounded: Bounded,
}

/// The lunar sampler with random parameter errors smaller than its priors, and its simulated
/// measurements.
pub struct Lunar {
    pub problem: Problem,
    pub data: Dataset,
    model: Model,
    placement: Placement,
    truth: DVector<f64>,
    /// Starting points at the distance [`FAR`] from the truth.
    far: Vec<DVector<f64>>,
}

impl Arms {
    pub fn new() -> Self {
        Self {
            ur10: [100, 1000, 10_000].map(Ur10::new),
            lunar: [28, 200].map(Lunar::new),
            boxed: [28, 200].map(Ur10::new),
            gross: [28, 200, 1000].map(|poses| Ur10::new(poses).with_gross_errors()),
            limited: LIMITS
                .map(|name| (format!("lunar sampler, {name}"), Bounded::read(name)))
                .into_iter()
                .chain([(
                    "service arm".to_owned(),
                    Bounded::of(Problem::read(&file("problems/service-arm")).unwrap()),
                )])
                .collect(),
            gross_bounded: Bounded::read("stiffness").with_gross_errors(),
        }
    }

    pub fn cases(&self) -> Vec<Case<'_>> {
        let mut cases = Vec::new();
        for ur10 in &self.ur10 {
            for (class, unknowns) in
                [(Class::Identifiable, &ur10.identifiable), (Class::Redundant, &ur10.geometric)]
            {
                cases.push(of_ur10(ur10, class, unknowns, ""));
            }
        }
        for ur10 in &self.boxed {
            let bounds = Some(ur10.bounds(&ur10.identifiable));
            cases.push(Case { bounds, ..of_ur10(ur10, Class::Bounded, &ur10.identifiable, "") });
        }
        for (name, bounded) in &self.limited {
            let rows = (!bounded.rows.is_empty()).then(|| bounded.rows.clone());
            let case =
                Case::new(Class::Bounded, name.clone(), bounded.residuals(), bounded.nominal());
            cases.push(Case {
                priors: Some(bounded.priors()),
                bounds: Some(bounded.bounds.clone()),
                rows,
                ..case
            });
        }
        for (word, loss) in LOSSES {
            for ur10 in &self.gross {
                cases.push(Case {
                    loss,
                    ..of_ur10(ur10, Class::Robust, &ur10.identifiable, &format!(", {word}"))
                });
            }
            let (name, bounded) = (format!("lunar sampler, 28 poses, {word}"), &self.gross_bounded);
            let case = Case::new(Class::Robust, name, bounded.residuals(), bounded.nominal());
            cases.push(Case { loss, priors: Some(bounded.priors()), ..case });
        }
        for lunar in &self.lunar {
            let nominal = DVector::zeros(lunar.truth.len());
            let sigmas = lunar.sigmas();
            let bounds = Bounds::new(-ERRORS * &sigmas, ERRORS * sigmas).unwrap();
            cases.push(lunar.case(Class::Elastic, "nominal start", nominal.clone(), None));
            for (k, far) in lunar.far.iter().enumerate() {
                cases.push(lunar.case(
                    Class::Elastic,
                    &format!("far start {}", k + 1),
                    far.clone(),
                    None,
                ));
            }
            cases.push(lunar.case(Class::Bounded, "nominal start", nominal, Some(bounds.clone())));
            cases.push(lunar.case(
                Class::Bounded,
                "far start 1",
                lunar.far[0].clone(),
                Some(bounds),
            ));
        }
        cases
    }
}

impl Lunar {
    fn new(poses: usize) -> Self {
        let problem = Problem::read(&file("problems/lunar-sampler/problem.toml")).unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(2025);
        let mut measurements = made::at_random(&problem, poses, 1.5, &mut random);
        let model = made::model_of(&problem, &measurements);
        let truth = ERRORS * made::draw(&model, |_| 0.0, &mut random);
        made::measure(
            &problem,
            &mut measurements,
            &truth,
            problem.data.position_sigma.unwrap(),
            &mut random,
        );
        let split = made::split_at(poses, &measurements);
        let mut lunar = Self {
            placement: Placement::of(&measurements),
            far: Vec::new(),
            problem,
            data: Dataset::new(measurements, split),
            model,
            truth,
        };
        let sigmas = lunar.sigmas();
        let mut far = || {
            &lunar.truth
                + sigmas
                    .map(|sigma| if random.random_bool(0.5) { FAR * sigma } else { -FAR * sigma })
        };
        lunar.far = (0..FAR_STARTS).map(|_| far()).collect();
        lunar
    }

    pub fn name(&self) -> String {
        format!("lunar sampler, {} poses", self.data.measurements.len())
    }

    /// Returns the standard deviations of the priors.
    fn sigmas(&self) -> DVector<f64> {
        DVector::from_iterator(
            self.truth.len(),
            self.model.parameters.iter().map(|parameter| parameter.sigma.unwrap()),
        )
    }

    fn residuals(&self) -> PoseResiduals<'_> {
        let n = self.truth.len();
        let sigma = self.problem.data.position_sigma.unwrap();
        let poses =
            self.placement.poses(&self.data.measurements, &self.data.split.identification, sigma);
        PoseResiduals::new(&self.model, poses, (0..n).collect(), DVector::zeros(n))
    }

    /// Returns the fit of all parameters with their priors from `start`.
    pub fn case(
        &self,
        class: Class,
        start_name: &str,
        start: DVector<f64>,
        bounds: Option<Bounds>,
    ) -> Case<'_> {
        let n = self.truth.len();
        let matrix = DMatrix::from_diagonal(&self.sigmas().map(f64::recip));
        let priors = Some(LinearRows { matrix, constant: DVector::zeros(n) });
        let case =
            Case::new(class, format!("{}, {start_name}", self.name()), self.residuals(), start);
        Case { priors, bounds, ..case }
    }
}

/// Returns the fit of `unknowns` of a UR10 from nominal values; `suffix` completes its name.
fn of_ur10<'a>(ur10: &'a Ur10, class: Class, unknowns: &[usize], suffix: &str) -> Case<'a> {
    let residuals = ur10.residuals(unknowns);
    let name =
        format!("UR10, {} parameters, {} poses{suffix}", unknowns.len(), ur10.configurations.len());
    let start = DVector::zeros(residuals.parameters());
    Case::new(class, name, residuals, start)
}
