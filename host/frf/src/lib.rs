//! Frequency response functions: measured from recordings, their table in a file, and what lies between its lines.

mod cross_spectra;
mod driven;
mod error;
mod estimate;
mod hammer;
mod interpolation;
mod measurement;
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
pub use hammer::{Blow, HammerWindows, true_damping};
pub use interpolation::Interpolation;
pub use measurement::{Excitation, Measurement, MeasurementSettings, Part, measure};
pub use record_spectra::{ChannelLines, RecordSpectra, record_spectra};
pub use table::{Frf, FrfTable};
pub use tool_tip::{ModeRatio, calibrate};
pub use window::Window;
