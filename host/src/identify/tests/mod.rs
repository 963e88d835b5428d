//! Identification of what a virtual rig has measured.

mod steady;
