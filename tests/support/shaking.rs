//! A random force on the structure: what floor, drives and the material itself do besides the cut.

use quietcut::simulate::Drive;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// White noise of the force in each axis, constant over steps of 0.5 ms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaking {
    /// One-sided density, N per √Hz.
    pub newton_per_root_hertz: f64,
    /// Makes it repeat.
    pub seed: u64,
}

/// One force after another.
struct Steps(Vec<[f64; 3]>);

impl Shaking {
    /// A hundredth of the period of the robot's modes at 17 to 19 Hz: for them it is white.
    const STEP_S: f64 = 0.5e-3;

    /// The force from 0 on.
    pub fn for_seconds(self, seconds: f64) -> Box<dyn Drive> {
        let mut source = ChaCha8Rng::seed_from_u64(self.seed);
        let deviation_n = self.newton_per_root_hertz * (0.5 / Self::STEP_S).sqrt();
        let mut normal =
            || deviation_n * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut source);
        let steps = (seconds / Self::STEP_S).ceil() as usize;
        Box::new(Steps(
            (0..steps).map(|_| [normal(), normal(), normal()]).collect(),
        ))
    }
}

impl Drive for Steps {
    fn force_n(&self, t: f64) -> [f64; 3] {
        let step = (t / Shaking::STEP_S) as usize;
        self.0.get(step).copied().unwrap_or_default()
    }

    fn next_knot_s(&self, t: f64) -> f64 {
        // Times within a billionth of a step of a knot count as the knot.
        ((t / Shaking::STEP_S + 1e-9).floor() + 1.0) * Shaking::STEP_S
    }
}
