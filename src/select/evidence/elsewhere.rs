//! Functions without a law that do not act at a single joint: in the measurement, at the base, one
//! value for each configuration, and in links that warm.

use nalgebra::{DMatrix, DVector};

use super::block::Design;
use super::candidate::Candidate;
use super::columns::Columns;
use super::functions::{SampledCovariate, expand, products_of, rough_basis};
use super::hypothesis::{Hypothesis, HypothesisKind, Site};
use crate::model::parameter::{BeamField, ParameterSite};
use crate::problem::Effect;
use crate::residual_tests::Covariate;
use crate::select::data::{bits, numbered};
use crate::select::settings::{ROUGH_LENGTHS, SLOW_LENGTH, SMOOTH_LENGTHS};

impl Columns<'_, '_> {
    /// Adds hypotheses about the instrument: displacements of the measured positions as functions
    /// of one covariate, or of the measured position.
    pub(super) fn add_measurement_functions(&mut self, recorded: &[SampledCovariate]) {
        let Some(axes) = self.columns_at(|axis| ParameterSite::Shift { axis }) else { return };
        let (site, at) = (ParameterSite::Shift { axis: 0 }, axes.iter().collect::<Vec<_>>());
        for of in recorded {
            self.add_smooth("smooth in the measurement", (site, &at), of, (&SMOOTH_LENGTHS, 0));
        }
        let is_time =
            |of: &&SampledCovariate| matches!(of.covariate, Covariate::Time | Covariate::Row);
        for of in recorded.iter().filter(is_time) {
            self.add_wandering(site, &at, of);
        }
        let poses = self.linearised.poses();
        let coordinate = |axis: usize| {
            self.sampled(Covariate::Position, poses.iter().map(|p| p.measured[axis]).collect())
        };
        let coordinates: Vec<SampledCovariate> = (0..3).filter_map(coordinate).collect();
        let linear = DMatrix::from_fn(poses.len(), coordinates.len(), |k, j| {
            let scaled = &coordinates[j].scaled;
            scaled[k]
                - scaled[..self.evidence_poses].iter().sum::<f64>()
                    / self.evidence_poses.max(1) as f64
        });
        let hypothesis =
            |kind| Hypothesis::new(kind, Site::Measurement, None, vec![Covariate::Position]);
        // If the strain of the frame is a candidate, it is the linear law of the position.
        let strain =
            |candidate: &Candidate| candidate.hypothesis.effect() == Some(&Effect::FrameStrain);
        if !self.candidates.iter().any(strain) {
            self.add("field", 1.0, hypothesis(HypothesisKind::Linear), || expand(&at, &linear));
        }
        if let [x, y, z] = coordinates.as_slice() {
            let plane = products_of(&[x, y, z], SLOW_LENGTH);
            self.add("field", 1.0, hypothesis(HypothesisKind::Smooth), || expand(&at, &plane));
        }
        self.covariates.extend(coordinates);
    }

    /// Adds errors that wander in time at `site`: the error of each reading is close to that of the
    /// previous reading.
    pub(super) fn add_wandering(
        &mut self,
        site: ParameterSite,
        at: &[&DVector<f64>],
        of: &SampledCovariate,
    ) {
        let hypothesis = Hypothesis::new(
            HypothesisKind::Wandering,
            Site::Measurement,
            Some(site),
            vec![of.covariate.clone()],
        );
        for (variant, &length) in ROUGH_LENGTHS.iter().enumerate() {
            if let Some(basis) = rough_basis(&of.scaled, length, of.levels) {
                self.add_variant("smooth in the measurement", &hypothesis, variant, || {
                    expand(at, &basis)
                });
            }
        }
    }

    /// Adds rotations of the base as smooth functions of quantities other than commands and
    /// directions of approach, such as temperature, time or payload.
    pub(super) fn add_base_rotations(&mut self, recorded: &[SampledCovariate]) {
        let Some(axes) = self.columns_at(|axis| ParameterSite::Turn { axis }) else { return };
        let (site, at) = (ParameterSite::Turn { axis: 0 }, axes.iter().collect::<Vec<_>>());
        let is_command = |of: &&SampledCovariate| {
            matches!(of.covariate, Covariate::Command(_) | Covariate::Approach(_))
        };
        for of in recorded.iter().filter(|of| !is_command(of)) {
            self.add_smooth("smooth at the base", (site, &at), of, (&SMOOTH_LENGTHS[..2], 0));
        }
    }

    /// Adds a free displacement of every configuration, shared by all positions measured in it.
    pub(super) fn add_repeats(&mut self) {
        let Some(axes) = self.columns_at(|axis| ParameterSite::Shift { axis }) else { return };
        let poses = self.linearised.poses();
        let configurations: Vec<Vec<u64>> =
            poses.iter().map(|pose| bits(pose.setup.configuration)).collect();
        let numbers = numbered(configurations[..self.evidence_poses].iter().cloned());
        let count = numbers.iter().max().map_or(0, |last| last + 1);
        if count == self.evidence_poses {
            return;
        }
        let groups = (0..poses.len()).map(|row| numbers.get(row).copied()).collect();
        let hypothesis = Hypothesis::new(HypothesisKind::PerPose, Site::Arm, None, Vec::new());
        let design = || Design::Grouped { levers: DMatrix::from_columns(&axes), groups };
        self.add_design("per pose", 1.0, hypothesis, design);
    }

    /// Adds curvature and strain of beams as smooth functions of temperature and other quantities,
    /// in addition to the linear laws.
    pub(super) fn add_link_functions(&mut self, recorded: &[SampledCovariate]) {
        if self.problem.data.reference_temperature.is_none() {
            return;
        }
        for joint in 0..self.problem.joints.len() {
            for fields in [&BeamField::STRAINS[1..], &BeamField::STRAINS[..1]] {
                let column = |&field: &BeamField| {
                    self.linearised
                        .column_at(ParameterSite::Beam { joint, field })
                        .filter(|column| column.norm_squared() > 0.0)
                };
                let columns: Vec<DVector<f64>> = fields.iter().filter_map(column).collect();
                if columns.is_empty() {
                    continue;
                }
                let (site, at) = (
                    ParameterSite::Beam { joint, field: fields[0] },
                    columns.iter().collect::<Vec<_>>(),
                );
                let of_covariate =
                    |wanted: &Covariate| recorded.iter().find(|of| of.covariate == *wanted);
                for of in
                    recorded.iter().filter(|of| !matches!(of.covariate, Covariate::Approach(_)))
                {
                    self.add_smooth("smooth in a link", (site, &at), of, (&SMOOTH_LENGTHS[..2], 0));
                }
                let time = Covariate::time(self.coverage.1);
                if let (Some(one), Some(other)) =
                    (of_covariate(&Covariate::Temperature), of_covariate(&time))
                {
                    self.add_surface("surface in a link", site, &at, (one, other));
                }
            }
        }
    }
}
