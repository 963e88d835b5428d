//! The lobe table: where this machine is stable.
