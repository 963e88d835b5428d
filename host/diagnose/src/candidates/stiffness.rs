//! The stiffness differs from the case: linear in its relative change.

use super::linear_parameter::{LinearChange, StructureMatrix};

pub(super) const CAUSE: LinearChange = LinearChange(StructureMatrix::Stiffness);
