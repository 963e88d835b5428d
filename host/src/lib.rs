//! The library behind the `quietcut` command: command line, device client, demonstration and report pages.
//!
//! It re-exports library crates of the workspace: recording, frf, simulate, stability, identify, diagnose, and parts of
//! model. Its own public modules: [`cli`] parses arguments and prints answers, [`report`] draws pictures and pages,
//! [`device`] speaks with a monitor over a serial port, [`demo`] shows the monitor without a machine, [`machine`] reads
//! the folder of a machine, writes the text of its case and proposes the next step, [`doctor`] examines ports, device and
//! lobe table.
//!
//! The stability limit of a case at one spindle speed:
//!
//! ```
//! use quietcut::case::Case;
//! use quietcut::stability::{Collocation, CubicTerms, Method, Problem};
//!
//! let text = r#"
//! [structure]
//! kind = "matrices"
//! directions = ["x"]
//! mass = [[0.0399]]
//! damping = [[5.516]]
//! stiffness = [[1.348e6]]
//! [tool]
//! teeth = 2
//! edge_angle_deg = 90.0
//! [material]
//! ktc_mpa = 600.0
//! krc_mpa = 200.0
//! kac_mpa = 0.0
//! kte_n_per_mm = 0.0
//! kre_n_per_mm = 0.0
//! kae_n_per_mm = 0.0
//! [cut]
//! start_deg = 90.0
//! exit_deg = 180.0
//! feed_per_tooth_mm = 0.1
//! "#;
//! let case = Case::parse("one-mode.toml".as_ref(), text)?;
//! let method = Collocation {
//!     problem: Problem::new(&case, CubicTerms::Refuse)?,
//! };
//! // Depths up to 5 mm at 10 000 rev/min, in 40 steps.
//! let line = method.line(10_000.0, 5.0, 40)?;
//! let limit = line.first_limit.ok_or("stable up to 5 mm")?;
//! assert!(limit.depth_mm > 0.0 && limit.chatter_hz > Some(0.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! No library crate parses a command line, prints or draws; the models of vibration and cutting are in the library
//! crates.

pub use quietcut_diagnose as diagnose;
pub use quietcut_frf as frf;
pub use quietcut_identify as identify;
pub use quietcut_identify::plan;
pub use quietcut_model::{case, cutting_load, milling, structure};
pub use quietcut_recording as recording;
pub use quietcut_recording::file;
pub use quietcut_simulate as simulate;
pub use quietcut_stability as stability;
pub use quietcut_stability::{lobe_table, orbit, trial_cuts};

pub mod cli;
mod criteria;
pub mod demo;
pub mod device;
pub mod doctor;
pub mod machine;
mod messages;
mod monitor;
pub mod report;
