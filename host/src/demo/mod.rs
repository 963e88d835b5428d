//! Demonstration: test bench with a virtual robot cell and a simulated device, its cuts, and their HTML report.

mod bench;
mod page;
mod trace;
mod trial;

pub use bench::{Bench, BenchError};
pub use page::{Story, page};
pub use trace::Trace;
pub use trial::{Spectrum, Trial};
