//! Frequency response functions: measured from recordings, their table in a file, and what lies between its lines.

mod cross_spectra;
mod driven;
mod error;
mod estimate;
mod excitation;
mod hammer;
mod interpolation;
mod measurement;
mod measurement_settings;
pub mod rational_fit;
mod record_spectra;
mod small_matrix;
mod step_sine;
mod table;
mod table_file;
mod table_uff;
mod tool_tip;
mod window;

pub use error::FrfError;
pub use estimate::Estimator;
pub use excitation::Excitation;
pub use hammer::{Blow, HammerWindows, true_damping};
pub use interpolation::Interpolation;
pub use measurement::{Measurement, Part, measure};
pub use measurement_settings::MeasurementSettings;
pub use record_spectra::{ChannelLines, RecordSpectra, record_spectra};
pub use table::{Frf, FrfTable};
pub use tool_tip::{ModeRatio, calibrate};
pub use window::Window;
