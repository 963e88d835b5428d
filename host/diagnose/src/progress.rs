//! What a caller may set, and how far a diagnosis is.

/// How to diagnose.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// Seed of whatever is drawn.
    pub seed: u64,
}

/// How far a diagnosis is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Recordings are set against what the case predicts.
    Records,
    /// What each cause would look like in them.
    Library,
    /// So many causes at a time are tried.
    Causes(usize),
    /// What was found is put into figures.
    Answer,
}
