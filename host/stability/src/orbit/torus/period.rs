//! Integration of a torus over one tooth period, with derivatives, by the Runge–Kutta method of fourth order.
//!
//! The force has kinks where a tooth leaves or meets the surface, at other times for each angle, so that a higher order
//! would not be reached. Steps end where teeth enter and leave the arc of cut, and become shorter towards these ends as the
//! square of the distance: at full immersion the chip begins and ends with thickness 0, and a vibration of the size a takes a
//! tooth of the feed f from the surface over an angle a/f there.

use nalgebra::DMatrix;

use super::motion::{Motion, Rates};
use crate::orbit::forced::ForcedProblem;
use quietcut_model::structure::FirstOrder;

/// Largest phase angle, rad, of the fastest motion over a step: the fastest pole plus the directional coefficients. A choice:
/// the local error z⁵/120 is then 8e-8, that of a kink z²/8 of the jump of the slope.
const STEP_ANGLE: f64 = 0.1;

/// One step: the phase of the tooth period at its start and its length, rad, and the number of teeth in the arc of cut.
#[derive(Clone, Copy, Debug)]
struct Step {
    phase: f64,
    turn: f64,
    teeth: usize,
}

/// Steps of a tooth period at a spindle speed.
pub(super) struct Steps {
    steps: Vec<Step>,
    seconds_per_radian: f64,
}

/// States at the end of the period, n × angles, with their derivatives with respect to the unknowns.
pub(super) struct Integrated {
    pub(super) end: DMatrix<f64>,
    pub(super) by: DMatrix<f64>,
    /// Smallest chip thickness of a tooth in the arc of cut, m.
    pub(super) smallest_chip_m: f64,
}

impl Steps {
    pub(super) fn new(problem: &ForcedProblem, rpm: f64) -> Self {
        let linear = &problem.linear;
        let engagement = &linear.process.engagement;
        let seconds_per_radian = linear.tooth_period_s(rpm) / engagement.pitch;
        let poles = linear.structure.poles();
        let fastest = poles.iter().map(|pole| pole.norm()).fold(0.0, f64::max);
        let mut steps = Vec::new();
        for interval in engagement.subintervals() {
            let length = interval.to - interval.from;
            // The step in the middle is 3/2 of the mean one.
            let angle = 1.5 * length * (fastest * seconds_per_radian + 2.0);
            let count = (angle / STEP_ANGLE).ceil().max(2.0);
            let phase = |index: usize| {
                let share = index as f64 / count;
                interval.from + length * share * share * (3.0 - 2.0 * share)
            };
            steps.extend((0..count as usize).map(|index| Step {
                phase: phase(index),
                turn: phase(index + 1) - phase(index),
                teeth: interval.teeth,
            }));
        }
        Self {
            steps,
            seconds_per_radian,
        }
    }

    /// Root mean square, over the period and all angles, of the motion less its mean over the angles, which is synchronous
    /// with the teeth: of the displacement, m, and of the acceleration, m/s², in feed, normal and axial direction.
    pub(super) fn asynchronous(
        &self,
        motion: &Motion<'_>,
        structure: &FirstOrder,
        start: &DMatrix<f64>,
    ) -> [[f64; 3]; 2] {
        // No derivative is needed but those by the rotation and the depth, which every motion has.
        let mut here = Integrated::from(start, DMatrix::zeros(start.len(), 2));
        let by_rates = &structure.c * &structure.a;
        let mut squares = [[0.0; 3]; 2];
        let mut turn = 0.0;
        for step in &self.steps {
            let displacement = &structure.c * &here.end;
            let first = self.advance(motion, &mut here, step);
            // Without regard to kinks of the force u̇ = C A x and ü = C A ẋ: a force does not make the velocity jump.
            for (quantity, values) in [displacement, &by_rates * first.rates].iter().enumerate() {
                let mean = values.column_mean();
                for axis in 0..3 {
                    let row = values.row(axis);
                    let of_axis = row.iter().map(|value| (value - mean[axis]).powi(2));
                    squares[quantity][axis] += step.turn * of_axis.sum::<f64>() / values.ncols() as f64;
                }
            }
            turn += step.turn;
        }
        squares.map(|of_quantity| of_quantity.map(|square| (square / turn).sqrt()))
    }

    /// Integrates from states at the start of the period.
    pub(super) fn integrate(&self, motion: &Motion<'_>, start: &DMatrix<f64>) -> Integrated {
        let mut here = Integrated::from(start, DMatrix::identity(start.len(), motion.unknowns()));
        for step in &self.steps {
            self.advance(motion, &mut here, step);
        }
        here
    }

    /// Advances by one step, and returns the rates at its start.
    fn advance(&self, motion: &Motion<'_>, here: &mut Integrated, step: &Step) -> Rates {
        let h = step.turn * self.seconds_per_radian;
        let at = |share: f64, from: Option<&Rates>| {
            let moved = |base: &DMatrix<f64>, rates: Option<&DMatrix<f64>>| match rates {
                Some(rates) => base + rates * (share * h),
                None => base.clone(),
            };
            let states = moved(&here.end, from.map(|rates| &rates.rates));
            let by = moved(&here.by, from.map(|rates| &rates.by));
            motion.rates(&states, &by, step.teeth, step.phase + share * step.turn)
        };
        let first = at(0.0, None);
        let second = at(0.5, Some(&first));
        let third = at(0.5, Some(&second));
        let last = at(1.0, Some(&third));
        for (weight, stage) in [(1.0, &first), (2.0, &second), (2.0, &third), (1.0, &last)] {
            here.end += &stage.rates * (weight * h / 6.0);
            here.by += &stage.by * (weight * h / 6.0);
            here.smallest_chip_m = here.smallest_chip_m.min(stage.smallest_chip_m);
        }
        first
    }
}

impl Integrated {
    fn from(start: &DMatrix<f64>, by: DMatrix<f64>) -> Self {
        Self {
            end: start.clone(),
            by,
            smallest_chip_m: f64::INFINITY,
        }
    }
}
