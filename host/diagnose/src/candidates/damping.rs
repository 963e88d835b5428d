//! The damping differs from the case: linear in its relative change.

use super::linear_parameter::{Linear, Which};

pub(super) const CAUSE: Linear = Linear(Which::Damping);
