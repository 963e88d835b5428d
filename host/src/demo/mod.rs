//! The demonstration: a virtual robot cell with a simulated device, the cuts that are tried on it, and the report of
//! them.

mod bench;
mod page;
mod trace;
mod trial;

pub use bench::{Bench, BenchError};
pub use page::{Story, page};
pub use trace::Trace;
pub use trial::{Spectrum, Trial};
