//! Options of a diagnosis, and the stages of its progress.

/// Options of a diagnosis.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// Seed of random numbers. No stage of a diagnosis depends on it: draws of force noise have fixed seeds.
    pub seed: u64,
}

/// Stage of a diagnosis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Stage of a diagnosis in which recordings are compared with the prediction of the baseline.
    Records,
    /// Stage in which the regressors of each cause are computed.
    Library,
    /// Stage in which candidate models with this number of causes are compared.
    Causes(usize),
    /// Stage in which parameters and intervals of the selected candidate model are computed.
    Answer,
}
