//! Output-only modal analysis: modes from motion under an unmeasured excitation.

mod recording;
pub mod subspace;

pub use recording::Ambient;
