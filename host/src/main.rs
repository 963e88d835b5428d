//! The `quietcut` command.
fn main() {}
