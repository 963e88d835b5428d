//! Frequency response functions: measured from recordings, tabulated in a file, and interpolated between the lines of a
//! table.
//!
//! Main items: [`measure`] turns recordings of shaker, multisine, hammer, sweep or step-sine tests, or of cuts, into a
//! [`Measurement`] (receptances with coherence and standard deviation; estimators H1, H2, their mean and the
//! pseudo-inverse, [`Estimator`]); [`FrfTable`] holds receptances in m/N and reads and writes CSV and UFF 58, and reads
//! the text tables of other programs; [`Interpolation`] evaluates a table between and beyond its lines.
//!
//! "The thesis" in this crate is *Chatter Vibrations in Robotic Milling Considering Structural Nonlinearity*, a
//! doctoral thesis of the University of Victoria; its equation numbers are given as "thesis eq. (4.4)" or "thesis eq.
//! 7.12".
//!
//! ```
//! use std::f64::consts::TAU;
//! use std::path::Path;
//!
//! use num_complex::Complex64;
//! use quietcut_frf::{Frf, FrfTable, Interpolation};
//! use quietcut_model::structure::Direction;
//!
//! // One mode of 20 Hz, 2 % damping and 1 MN/m: H = 1/(k (1 − r² + 2iζr)) with r = f/f_n.
//! let receptance = |hertz: f64| {
//!     let r = hertz / 20.0;
//!     (1e6 * Complex64::new(1.0 - r * r, 2.0 * 0.02 * r)).inv()
//! };
//! let frequency_hz: Vec<f64> = (150..=250).map(|line| 0.1 * f64::from(line)).collect();
//! let entry = Frf {
//!     response: Direction::X,
//!     force: Direction::X,
//!     receptance: frequency_hz.iter().map(|&hertz| receptance(hertz)).collect(),
//!     coherence: None,
//!     folding: None,
//! };
//! let table = FrfTable::new(Path::new("one-mode"), frequency_hz, vec![entry])?;
//!
//! let between = Interpolation::new(&table)?.at(Complex64::from(20.05))[(0, 0)];
//! assert!((between / receptance(20.05) - 1.0).norm() < 0.02);
//! # Ok::<(), quietcut_frf::FrfError>(())
//! ```
//!
//! From the crate `quietcut_model`, this crate uses only the directions and the axes of the feed: no structure, no
//! cutting force, no stability.

mod accelerometer_mass;
mod clipping;
mod criteria;
mod cross_spectra;
mod error;
mod estimate;
mod excitation;
mod exponential_window;
mod force_level;
mod force_levels;
mod frf_unit;
mod hammer;
mod interpolation;
mod level_peaks;
mod measurement;
mod measurement_settings;
mod peak_fit;
mod period;
mod period_average;
mod periodic_test;
mod points;
pub mod rational_fit;
mod record_spectra;
mod small_matrix;
mod step_sine;
mod table;
mod table_column;
mod table_file;
mod table_found;
mod table_uff;
mod test_channels;
mod test_plausibility;
mod tool_tip;
mod window;

pub use accelerometer_mass::{PeakShift, peak_shift, without_accelerometer_mass};
pub use error::FrfError;
pub use estimate::Estimator;
pub use excitation::Excitation;
pub use force_levels::{LevelMeasurement, measure_levels};
pub use hammer::{HammerWindows, MeasuredImpact};
pub use interpolation::Interpolation;
pub use level_peaks::{LevelPeak, PeaksOverLevel, level_peaks};
pub use measurement::{Measurement, RecordingGroup, measure};
pub use measurement_settings::MeasurementSettings;
pub use peak_fit::{FittedPeak, fitted_peaks};
pub use periodic_test::{DistortionLevel, PeriodicTest, ResponseDistortion};
pub use points::{PointGroup, TestPoints, measure_points, points_of};
pub use record_spectra::{ChannelLines, RecordSpectra, record_spectra};
pub use table::{Frf, FrfTable};
pub use table_found::ImportedTable;
pub use test_plausibility::table_doubts;
pub use tool_tip::{ModeRatio, calibrate};
pub use window::Window;
