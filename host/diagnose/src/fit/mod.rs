//! Fits the parameters of one candidate model: by linear regression along the measured motion first and then, where
//! possible, by prediction error.

pub(crate) mod candidate_model;
pub(crate) mod closed_fit;
pub(crate) mod covariance;
pub(crate) mod force_noise;
pub(crate) mod library;
pub(crate) mod normal_equations;
pub(crate) mod nuisances;
pub(crate) mod output_error;
pub(crate) mod output_error_fit;
pub(crate) mod own_slopes;
pub(crate) mod projection;
pub(crate) mod refine;
pub(crate) mod regression;
pub(crate) mod relinearization;
pub(crate) mod restarts;
pub(crate) mod search;
pub(crate) mod segment;
pub(crate) mod unknowns;
pub(crate) mod whitening;
