//! Stability limits: one cut, one speed, charts and cells; derivatives and spread of limits. `Method` is the interface
//! of all methods.

mod along_variable;
pub(crate) mod between_speeds;
pub(crate) mod bounds;
pub(crate) mod cell;
pub(crate) mod cell_chart;
pub(crate) mod cells;
pub(crate) mod chart;
pub(crate) mod islands;
pub(crate) mod line;
pub(crate) mod method;
mod multiplier_path;
pub(crate) mod percentiles;
pub(crate) mod plane;
pub(crate) mod point;
pub(crate) mod resolution;
pub(crate) mod sampling;
mod scan;
pub(crate) mod sensitivity;
pub(crate) mod speed_line;
pub(crate) mod speeds;
pub(crate) mod spread;
pub(crate) mod uncertainty;
