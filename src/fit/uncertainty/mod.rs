//! Uncertainty of a fit: noise, covariance, prior widths that the data contradict, shadow prices,
//! and errors of configurations that are left out.

pub(super) mod active_constraint;
pub(super) mod covariance;
mod curvature;
pub(super) mod hidden_by_limit;
mod left_out;
pub(super) mod noise;
pub(super) mod prices;
pub(super) mod prior_sizes;
pub(super) mod refuted_priors;
pub(super) mod residual_lengths;
pub(super) mod second_solution;
pub(super) mod shadow_price;
pub(super) mod statistics;
mod surroundings;
