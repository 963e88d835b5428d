//! From the selected candidate model to the answer: parameter estimates, intervals, residual views, gain, effect on the
//! lobes.

pub mod answer;
pub(crate) mod conclude;
pub(crate) mod extended_case;
pub(crate) mod guess;
pub mod lobes;
pub(crate) mod long_records;
pub(crate) mod missing_force;
pub(crate) mod nearest_baseline;
pub(crate) mod parameter_estimates;
pub(crate) mod places;
pub(crate) mod prediction_error;
pub(crate) mod recorded_cuts;
pub(crate) mod residual_views;
pub(crate) mod unexplained;
pub(crate) mod updated_case;
pub(crate) mod updates;
