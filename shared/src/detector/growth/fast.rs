//! Growth that linear prediction over a few passings sees.

use super::steadiness::{LEAST_DEVIATION, LIKELY, is_steady};
use crate::detector::finding::{GrowthKind, Multiplier};
use crate::math::sqrt;
use crate::stroboscope::{CAPACITY, Plan, Prediction, Stroboscope};

/// The plans that are tried, shortest first. A step from one root to the next must be within the window, and the strides are chosen so that some
/// stride turns any angle well away from 0 and ½.
const PLANS: [Plan; 9] = [
    plan(8, 2, 1),
    plan(11, 2, 1),
    plan(16, 4, 1),
    plan(16, 2, 4),
    plan(24, 2, 6),
    plan(32, 3, 6),
    plan(32, 2, 8),
    plan(48, 3, 8),
    plan(CAPACITY, 3, 11),
];

const fn plan(window: usize, order: usize, stride: usize) -> Plan {
    Plan {
        window,
        order,
        stride,
    }
}

/// Standard deviations between an estimate and the unit circle that make growth sure (together with a second look).
const SURE: f32 = 5.0;
/// A multiplier nearer to the positive real axis than this, in turns, is that of a forced orbit that is still moving.
const LEAST_ANGLE: f32 = 0.03;
/// Part of the noise of the sensor that is taken off: the data sheet's figure is typical, and more than is there would blow |μ| up.
const COMPENSATED: f32 = 0.8;
/// The deviation must stand out of the noise of the sensor by this factor to be judged.
const LEAST_SIGNAL: f32 = 3.0;
/// A prediction that leaves more than this part of what it predicts says nothing about growth.
const WORST_FIT: f32 = 0.5;
/// Nearer than this to the angle of a class, in turns after one revolution, a multiplier is taken for one only while the forced orbit
/// stands still.
const CLASS_ANGLE: f32 = 0.1;
/// and only over a window of so many passings.
const CLASS_WINDOW: usize = 32;
/// Nearer than this to a half turn the angle of a flip and of a Hopf pair cannot be told.
const FLIP_ANGLE: f32 = 0.006;
/// Passings whose shape tells the cycles per tooth period.
const SHAPE_WINDOW: usize = 32;
/// |μ| above this, surely, over the longest window is called persistent: what would take more than 130 passings to e-fold.
const PERSISTENT: f32 = 0.9925;

/// What the plans say together.
#[derive(Default)]
pub(super) struct Predictions {
    /// The sharpest.
    pub(super) best: Option<Multiplier>,
    /// What surely grows, over the longest window.
    pub(super) growing: Option<Multiplier>,
    /// What surely does not die, over all that is remembered.
    pub(super) persistent: Option<Multiplier>,
}

impl Predictions {
    /// Tries all plans that the passings so far are enough for. `noise` is the mean square of white noise in one channel, `forced` the
    /// level of the forced vibration.
    pub(super) fn new(stroboscope: &Stroboscope, forced: f32, noise: f32) -> Self {
        let (mut best, mut growing, mut steadily, mut persistent) = (None::<Prediction>, None, None, None);
        for plan in PLANS {
            let Some(window) = stroboscope.window(plan.window) else {
                break;
            };
            let Some(prediction) = window.predict(plan, COMPENSATED * noise) else {
                continue;
            };
            let power = prediction.level * prediction.level;
            let signal = power > LEAST_SIGNAL * LEAST_SIGNAL * noise;
            if !signal || prediction.innovation > WORST_FIT * prediction.level {
                continue;
            }
            if best.is_none_or(|best| prediction.deviation < best.deviation) {
                best = Some(prediction);
            }
            let surely = prediction.multiplier_abs - SURE * prediction.deviation;
            if surely > 1.0 && is_steady(&window, forced, prediction.level, noise) {
                growing = Some(prediction);
                if plan.window >= CLASS_WINDOW && is_steady(&window, forced, 0.0, noise) {
                    steadily = Some(prediction);
                }
            }
            let likely = prediction.multiplier_abs - LIKELY * prediction.deviation;
            if plan.window == CAPACITY && likely > PERSISTENT {
                persistent = Some(prediction);
            }
        }
        let multiplier = |prediction: Prediction| multiplier(stroboscope, &prediction, noise);
        let moves = |m: &Multiplier| m.angle_turns > LEAST_ANGLE;
        // A forced orbit that still moves has the angles of the classes in it, runout included.
        let loose =
            |m: &Multiplier| moves(m) && from_classes(m.angle_turns, stroboscope.classes()) > CLASS_ANGLE;
        let strictly = steadily.map(multiplier).filter(moves);
        Self {
            best: best.map(multiplier),
            growing: strictly.or(growing.map(multiplier).filter(loose)),
            persistent: persistent.map(multiplier).filter(moves),
        }
    }
}

/// The multiplier of a prediction, its angle brought back to one tooth period.
fn multiplier(stroboscope: &Stroboscope, prediction: &Prediction, noise: f32) -> Multiplier {
    let window = stroboscope.window(stroboscope.filled().min(SHAPE_WINDOW));
    let angle_turns = match window {
        Some(window) if prediction.stride > 1 => window.unfold(prediction.angle_turns, prediction.stride),
        _ => prediction.angle_turns,
    };
    Multiplier {
        abs: prediction.multiplier_abs,
        deviation: prediction.deviation.max(LEAST_DEVIATION),
        angle_turns,
        kind: if angle_turns > 0.5 - FLIP_ANGLE {
            GrowthKind::Flip
        } else {
            GrowthKind::Hopf
        },
        level: sqrt((prediction.level * prediction.level - noise).max(0.0)),
    }
}

/// Cycles per tooth period of a deviation with this multiplier.
pub(super) fn cycles(stroboscope: &Stroboscope, multiplier: &Multiplier) -> Option<f32> {
    let window = stroboscope.window(stroboscope.filled().min(SHAPE_WINDOW))?;
    match multiplier.kind {
        GrowthKind::Hopf => window.cycles(multiplier.angle_turns),
        GrowthKind::Flip => window.alternating_cycles(),
    }
}

/// Distance in turns, after one revolution, of an angle from those of what comes back with each revolution.
fn from_classes(angle_turns: f32, classes: usize) -> f32 {
    let turns = angle_turns * classes as f32;
    (turns - crate::math::round(turns)).abs()
}
