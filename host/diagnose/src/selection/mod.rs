//! Selects the candidate model that explains the records: evidence, held-out error, equivalence.

pub(crate) mod closed_selection;
pub(crate) mod compatibility;
pub(crate) mod rebaselined;
pub(crate) mod search;
pub(crate) mod select;
pub(crate) mod stepwise;
