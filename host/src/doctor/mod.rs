//! Examination of ports, device and lobe table, with what to do about each finding.
//!
//! | file | content |
//! |---|---|
//! | `finding` | one finding: what was found, and what to do |
//! | `ports` | the serial ports of this computer, and why one cannot be used |
//! | `device` | firmware, settings, memory and counters of a device |
//! | `table` | the lobe table of a device beside that of a machine's folder |

mod device;
mod finding;
mod ports;
mod table;

pub use device::{Examined, examine};
pub use finding::{Finding, State};
pub use ports::{FoundPort, found_ports, obstacle};
pub use table::compare;
