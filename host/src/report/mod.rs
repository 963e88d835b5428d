//! Reports: texts of verdicts and advice, charts as SVG, HTML pages.

pub mod answer;
pub mod backbone_chart;
pub mod branch_chart;
mod branch_lines;
pub mod cell_map;
pub mod comparison;
pub mod curve_chart;
pub mod diagnosis;
pub mod digits;
mod doubled_lines;
pub mod frf_chart;
pub mod frf_comparison_chart;
pub mod lobe_chart;
pub mod lobes_change;
pub mod marks;
pub mod page;
mod picture;
pub mod plan_chart;
mod residual_pictures;
pub mod shape_chart;
pub mod spectrum;
pub mod spindle_area;
pub mod stabilization_chart;
pub mod stroboscope;
pub mod time;
pub mod time_signal;
pub mod words;

pub use picture::PictureError;
