//! Equation of motion of a torus at one time: all angles, coupled by the surface that earlier passings left.

use nalgebra::{DMatrix, DVector, RowDVector, Vector3};

use super::circle::Circle;
use crate::orbit::forced::ForcedProblem;

/// Number of earlier passings whose surfaces a tooth may meet. A choice: a tooth that has missed the workpiece so often is
/// in a motion beyond every practical one; the vibrations of the tests miss it at most three times.
const PASSINGS: usize = 6;

/// Time derivatives of the states, and their derivatives with respect to the unknowns.
pub(super) struct Rates {
    /// Time derivatives, n states × angles.
    pub(super) rates: DMatrix<f64>,
    /// Their derivatives, (n · angles) × unknowns.
    pub(super) by: DMatrix<f64>,
    /// Smallest chip thickness of a tooth in the arc of cut, m; below 0 the tooth has left the surface.
    pub(super) smallest_chip_m: f64,
}

/// The equation at a rotation ρ per tooth period and an axial depth.
pub(super) struct Motion<'a> {
    problem: &'a ForcedProblem,
    circle: Circle,
    depth_m: f64,
    /// Shifts by −pρ, and their derivatives with respect to the shift, for p = 1, 2, …
    shifts: Vec<[DMatrix<f64>; 2]>,
}

/// Chip thicknesses of one tooth over all angles.
struct Chips {
    /// Chip thickness, m, 0 out of contact.
    thickness: RowDVector<f64>,
    /// Derivative of the chip thickness with respect to the displacements along the normal, angles × angles.
    by_displacement: DMatrix<f64>,
    /// Explicit derivative with respect to ρ.
    by_rotation: DVector<f64>,
    smallest: f64,
}

impl<'a> Motion<'a> {
    pub(super) fn new(problem: &'a ForcedProblem, circle: Circle, rotation: f64, depth_m: f64) -> Self {
        Self {
            problem,
            circle,
            depth_m,
            shifts: (1..=PASSINGS)
                .map(|passing| circle.shift(-(passing as f64) * rotation))
                .collect(),
        }
    }

    /// Number of unknowns: states at the start of the period, ρ and the depth.
    pub(super) fn unknowns(&self) -> usize {
        self.problem.order() * self.circle.angles + 2
    }

    /// Chip thicknesses for the displacements along the normal, m, at an angle of the tooth whose feed is `feed_m` along
    /// the normal.
    fn chips(&self, along: &DVector<f64>, feed_m: f64) -> Chips {
        let count = self.circle.angles;
        let mut chips = Chips {
            thickness: RowDVector::zeros(count),
            by_displacement: DMatrix::zeros(count, count),
            by_rotation: DVector::zeros(count),
            smallest: f64::INFINITY,
        };
        let earlier: Vec<DVector<f64>> = self.shifts.iter().map(|[shift, _]| shift * along).collect();
        for k in 0..count {
            let over = |passing: usize| along[k] - earlier[passing][k] + (passing + 1) as f64 * feed_m;
            let (passing, chip) = (0..PASSINGS).map(|passing| (passing, over(passing))).fold(
                (0, f64::INFINITY),
                |least, next| {
                    if next.1 < least.1 { next } else { least }
                },
            );
            chips.smallest = chips.smallest.min(chip);
            if chip <= 0.0 {
                continue;
            }
            chips.thickness[k] = chip;
            let [shift, by_shift] = &self.shifts[passing];
            let mut row = chips.by_displacement.row_mut(k);
            row -= shift.row(k);
            row[k] += 1.0;
            chips.by_rotation[k] = (passing + 1) as f64 * (by_shift.row(k) * along)[0];
        }
        chips
    }

    /// Rates of states (n × angles) with the derivatives `by` of these states, at a phase of the tooth period (rad) at which
    /// `teeth` teeth are in the arc of cut.
    pub(super) fn rates(&self, states: &DMatrix<f64>, by: &DMatrix<f64>, teeth: usize, phase: f64) -> Rates {
        let (problem, count) = (self.problem, self.circle.angles);
        let (structure, process) = (&problem.linear.structure, &problem.linear.process);
        let order = problem.order();
        let mut rates = &structure.a * states;
        let mut rates_by = DMatrix::zeros(order * count, by.ncols());
        for (k, state) in states.column_iter().enumerate() {
            let mut rate = rates.column(k).into_owned();
            problem.subtract_smooth(state.as_slice(), &mut rate);
            rates.set_column(k, &rate);
            let jacobian = problem.jacobian(state.as_slice(), &Vector3::zeros());
            rates_by
                .rows_mut(k * order, order)
                .gemm(1.0, &jacobian, &by.rows(k * order, order), 0.0);
        }
        let mut smallest_chip_m = f64::INFINITY;
        for tooth in 0..teeth {
            let angle = process.engagement.angle(tooth, phase);
            let normal = process.force.normal.at(angle);
            let seen = normal.transpose() * &structure.c;
            let push_per_depth = &structure.b * process.force.cutting.at(angle);
            let along = (&seen * states).transpose();
            let chips = self.chips(&along, normal.x * process.feed_per_tooth_m);
            smallest_chip_m = smallest_chip_m.min(chips.smallest);
            rates.gemm(self.depth_m, &push_per_depth, &chips.thickness, 1.0);
            let mut along_by = DMatrix::zeros(count, by.ncols());
            for k in 0..count {
                along_by
                    .row_mut(k)
                    .gemm(1.0, &seen, &by.rows(k * order, order), 0.0);
            }
            let mut chips_by = &chips.by_displacement * along_by;
            let mut by_rotation = chips_by.column_mut(by.ncols() - 2);
            by_rotation += &chips.by_rotation;
            for k in 0..count {
                let mut block = rates_by.rows_mut(k * order, order);
                block.gemm(self.depth_m, &push_per_depth, &chips_by.row(k), 1.0);
                let mut by_depth = block.column_mut(by.ncols() - 1);
                by_depth.axpy(chips.thickness[k], &push_per_depth, 1.0);
            }
        }
        Rates {
            rates,
            by: rates_by,
            smallest_chip_m,
        }
    }
}
