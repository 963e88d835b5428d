//! Events at which the forces of an orbit jump: what defines their instants, and how these move.

use nalgebra::DVector;

use super::law::{Forces, Instant};
use super::mesh::Contact;
use super::period::{Period, SparseRow};

/// Least jump of an input, over its largest value in the revolution. Where a force only has a kink, an event that is
/// found less exactly than this leaves a jump in proportion.
const LEAST_JUMP: f64 = 1e-6;

/// Forces after an event minus those before it.
pub(super) struct JumpSize {
    /// Subinterval that begins with the event.
    pub(super) subinterval: usize,
    pub(super) inputs: DVector<f64>,
    /// Cutting force along x, y, z, N.
    pub(super) cutting_n: [f64; 3],
}

/// An event at which the inputs jump.
pub(super) struct Jump {
    pub(super) size: JumpSize,
    pub(super) condition: Condition,
    /// Derivative of g_e with respect to the outputs, and to time, 1/s.
    pub(super) row: SparseRow,
    pub(super) rate: f64,
    /// Derivative of g_e by the outputs at its own point.
    pub(super) own: DVector<f64>,
}

impl Period<'_> {
    /// Forces just before and at the start of a subinterval.
    pub(super) fn beside(&self, index: usize) -> [Forces; 2] {
        let subintervals = &self.mesh.subintervals;
        let before = &subintervals[(index + subintervals.len() - 1) % subintervals.len()];
        let path = self.path();
        [&before.contact, &subintervals[index].contact].map(|contact| {
            let at = Instant {
                time_s: subintervals[index].start_s,
                contact,
                outputs: self.motion.at_point(self.mesh.point(index, 0)),
                path: &path,
            };
            self.model.forces(self.ports, &at)
        })
    }

    /// The events at which the inputs jump.
    pub(super) fn jumps(&self, sizes: &[f64]) -> Vec<Jump> {
        let inputs = self.ports.inputs();
        let mut largest = vec![0.0_f64; inputs];
        for (index, input) in self.forces().inputs.iter().enumerate() {
            let most = &mut largest[index % inputs];
            *most = most.max(input.abs());
        }
        let mut jumps = Vec::new();
        for (index, subinterval) in self.mesh.subintervals.iter().enumerate() {
            if subinterval.event.is_none() {
                continue;
            }
            let before = &self.mesh.subintervals
                [(index + self.mesh.subintervals.len() - 1) % self.mesh.subintervals.len()];
            let [left, right] = self.beside(index);
            let pairs = right.inputs.iter().zip(&left.inputs);
            let size = JumpSize {
                subinterval: index,
                inputs: DVector::from_iterator(left.inputs.len(), pairs.map(|(right, left)| right - left)),
                cutting_n: std::array::from_fn(|axis| right.cutting_n[axis] - left.cutting_n[axis]),
            };
            // What is left is a kink of the inputs, which does not move the orbit to first order.
            let is_kink = size
                .inputs
                .iter()
                .zip(&largest)
                .all(|(jump, largest)| jump.abs() <= LEAST_JUMP * largest);
            if is_kink {
                continue;
            }
            jumps.extend(self.jump(size, &before.contact, sizes));
        }
        jumps
    }

    fn jump(&self, size: JumpSize, before: &Contact, sizes: &[f64]) -> Option<Jump> {
        let index = size.subinterval;
        let subinterval = &self.mesh.subintervals[index];
        let (time_s, after) = (subinterval.start_s, &subinterval.contact);
        let point = self.mesh.point(index, 0);
        let condition = Condition::between(before, after)?;
        let path = self.path();
        let value = |time_s: f64, outputs: &[f64]| {
            self.condition(
                &condition,
                &Instant {
                    time_s,
                    contact: before,
                    outputs,
                    path: &path,
                },
            )
        };
        // One-sided: before the event the motion has no kink.
        let earlier = (index + self.mesh.subintervals.len() - 1) % self.mesh.subintervals.len();
        let of_earlier = &self.mesh.subintervals[earlier];
        let end_s = of_earlier.start_s + of_earlier.duration_s;
        let step_s = 1e-3 * of_earlier.duration_s;
        let at = |steps: f64| {
            let time_s = end_s - steps * step_s;
            value(time_s, &self.motion.within(self.mesh, earlier, time_s))
        };
        let rate = (3.0 * at(0.0) - 4.0 * at(1.0) + at(2.0)) / (2.0 * step_s);
        let outputs = self.motion.at_point(point);
        let mut own = DVector::zeros(self.ports.outputs());
        for output in 0..own.len() {
            let step = 1e-6 * sizes[output].max(f64::MIN_POSITIVE.sqrt());
            let moved = |step: f64| {
                let mut moved = outputs.to_vec();
                moved[output] += step;
                value(time_s, &moved)
            };
            own[output] = (moved(step) - moved(-step)) / (2.0 * step);
        }
        let mut row = self.own_row(point, own.iter().copied());
        if let Condition::Gap { tooth, surfaces } = &condition {
            let normal = self.model.normal(*tooth, time_s);
            for (passings, sign) in surfaces {
                if let Some(earlier_s) = self.model.earlier_s(*tooth, *passings, time_s) {
                    self.add_earlier(&mut row, earlier_s, -normal * *sign);
                }
            }
        }
        (rate != 0.0).then_some(Jump {
            size,
            condition,
            row,
            rate,
            own,
        })
    }

    pub(super) fn condition(&self, condition: &Condition, at: &Instant<'_>) -> f64 {
        match condition {
            Condition::Gap { tooth, surfaces } => {
                let x = self.ports.displacement(at.outputs);
                let gap = |(passings, sign): &(usize, f64)| {
                    sign * self.model.gap_m(*tooth, *passings, at.time_s, x, at.path)
                };
                surfaces.iter().map(gap).sum()
            }
            Condition::Regime(index) => self.model.regime_view(self.ports, at, *index).margin,
        }
    }
}

/// What vanishes at an event.
pub(super) enum Condition {
    /// Sum of gaps between a tooth and surfaces, with their signs.
    Gap {
        tooth: usize,
        surfaces: Vec<(usize, f64)>,
    },
    /// Margin of the regime of a restoring force.
    Regime(usize),
}

impl Condition {
    fn between(before: &Contact, after: &Contact) -> Option<Self> {
        let teeth = before
            .teeth
            .iter()
            .zip(&after.teeth)
            .find(|(before, after)| before != after);
        if let Some((from, to)) = teeth {
            let surfaces = match (from.passings, to.passings) {
                (Some(from), Some(to)) => vec![(from, 1.0), (to, -1.0)],
                (Some(one), None) | (None, Some(one)) => vec![(one, 1.0)],
                (None, None) => return None,
            };
            return Some(Self::Gap {
                tooth: from.tooth,
                surfaces,
            });
        }
        let mut regimes = before.regimes.iter().zip(&after.regimes);
        regimes
            .position(|(before, after)| before != after)
            .map(Self::Regime)
    }
}
