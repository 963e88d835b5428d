//! The mass of the structure differs from the case; the regressor is linear in its relative change.

use super::linear_parameter::{LinearChange, StructureMatrix};

pub(super) const CAUSE: LinearChange = LinearChange(StructureMatrix::Mass);
