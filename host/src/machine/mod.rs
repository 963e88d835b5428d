//! The folder of one machine: its case, taps, receptances, cuts and lobe table, and the next useful step.

mod case_text;
mod contradiction;
mod folder;
mod material_table;
mod next_step;
mod spindle_speed;

pub use case_text::{Answers, Immersion, MaterialAnswer, Section, case_text, section_text};
pub use folder::{BrokenFile, FileKind, FolderError, MachineFolder};
pub use material_table::{MaterialRange, RANGES};
pub use next_step::{NextStep, next_step};
pub use spindle_speed::spindle_rpm;
