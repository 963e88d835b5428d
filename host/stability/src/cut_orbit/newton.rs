//! The forced orbit by Newton's method.
//!
//! Unknowns are the inputs f of the structure at the nodes and the instants of events at which f jumps. With the
//! response y = G f of the structure and the forces f = Φ(y), a step δy from a motion y solves
//!
//!   δf − Φ' (G δf − Σ_e G_e J_e δt_e) = −Φ' r,       r = y − G Φ(y),
//!   g_e' (G δf − Σ_e' G_e' J_e' δt_e') + ġ_e δt_e = g_e' r − g_e,
//!
//! where J_e is the jump of f at the event e, whose delay by δt_e is an impulse −J_e δt_e with the response G_e, and
//! g_e(t_e, y) = 0 defines its instant.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::events::{Events, Revolution};
use super::jumps::{Jump, JumpSize};
use super::law::{Instant, Slopes};
use super::mesh::{Mesh, Stretches};
use super::model::{CutModel, Ports};
use super::motion::Motion;
use super::period::{Period, SparseRow};
use super::response::Response;
use quietcut_numerics::lu::Lu;

/// The equations of a Newton step, factored.
pub(super) struct Linearization {
    /// First column of the inputs of each subinterval; `None` where no force acts.
    first_column: Vec<Option<usize>>,
    count: usize,
    /// Inputs at the nodes by outputs at the points.
    inputs_by: Vec<SparseRow>,
    /// Cutting forces at the nodes by outputs at the points.
    cutting_by: Vec<SparseRow>,
    jumps: Vec<Jump>,
    /// Outputs by unknowns.
    response: DMatrix<f64>,
    factors: Lu,
}

impl Period<'_> {
    /// Rows of the cutting force (three) and of the inputs at one instant, whose outputs are those of `point`.
    fn rows(&self, slopes: &Slopes, point: usize) -> (Vec<SparseRow>, Vec<SparseRow>) {
        let cutting = |axis: usize| {
            let mut row = self.own_row(point, slopes.cutting.row(axis).iter().copied());
            for (time_s, by) in &slopes.earlier {
                self.add_earlier(&mut row, *time_s, by.row(axis).transpose());
            }
            row
        };
        let by_own = &slopes.inputs + &slopes.by_cutting * &slopes.cutting;
        let input = |input: usize| {
            let mut row = self.own_row(point, by_own.row(input).iter().copied());
            let by_cutting = slopes.by_cutting.row(input);
            for (time_s, by) in &slopes.earlier {
                let weights: Matrix3<f64> = *by;
                let weights = weights.transpose() * Vector3::from_fn(|axis, _| by_cutting[axis]);
                self.add_earlier(&mut row, *time_s, weights);
            }
            row
        };
        (
            (0..3).map(cutting).collect(),
            (0..self.ports.inputs()).map(input).collect(),
        )
    }

    /// The equations of a Newton step about the motion; `None` if they are singular.
    pub(super) fn linearized(&self, response: &Response<'_>) -> Option<Linearization> {
        let (inputs, nodes) = (self.ports.inputs(), self.mesh.nodes());
        let sizes = self.motion.sizes();
        let path = self.path();
        let mut count = 0;
        let mut first_column = Vec::with_capacity(self.mesh.subintervals.len());
        let (mut cutting_by, mut inputs_by) = (Vec::new(), Vec::new());
        for (index, subinterval) in self.mesh.subintervals.iter().enumerate() {
            let driven = self.is_driven(index);
            first_column.push(driven.then_some(count));
            for node in 0..nodes {
                if !driven {
                    cutting_by.extend([const { Vec::new() }; 3]);
                    continue;
                }
                let point = self.mesh.point(index, node + 1);
                let slopes = self.model.slopes(
                    self.ports,
                    &Instant {
                        time_s: self.mesh.time_s(index, node),
                        contact: &subinterval.contact,
                        outputs: self.motion.at_point(point),
                        path: &path,
                    },
                    &sizes,
                );
                let (of_cutting, of_inputs) = self.rows(&slopes, point);
                cutting_by.extend(of_cutting);
                inputs_by.extend(of_inputs);
            }
            count += if driven { nodes * inputs } else { 0 };
        }
        let jumps = self.jumps(&sizes);
        let impulses: Vec<_> = jumps
            .iter()
            .map(|jump| (jump.size.subinterval, -&jump.size.inputs))
            .collect();
        let matrix = response.matrix(&first_column, count, &impulses);
        let factors = Lu::new(self.equations(&inputs_by, &jumps, count, &matrix));
        factors.is_regular().then_some(Linearization {
            first_column,
            count,
            inputs_by,
            cutting_by,
            jumps,
            response: matrix,
            factors,
        })
    }

    fn equations(
        &self,
        inputs_by: &[SparseRow],
        jumps: &[Jump],
        count: usize,
        matrix: &DMatrix<f64>,
    ) -> DMatrix<f64> {
        let size = count + jumps.len();
        let mut equations = DMatrix::identity(size, size);
        let scale = |jump: &Jump| 1.0 / (jump.rate * self.mesh.revolution_s);
        for (column, of_column) in matrix.column_iter().enumerate() {
            let of_column = of_column.as_slice();
            let mut left = equations.column_mut(column);
            for (row, weights) in inputs_by.iter().enumerate() {
                left[row] -= weights
                    .iter()
                    .map(|(at, weight)| weight * of_column[*at])
                    .sum::<f64>();
            }
            for (index, jump) in jumps.iter().enumerate() {
                let mut moved: f64 = jump.row.iter().map(|(at, weight)| weight * of_column[*at]).sum();
                if column == count + index {
                    // The impulse of an event acts after it.
                    moved += (&self.ports.output * &self.ports.b * &jump.size.inputs).dot(&jump.own);
                    left[count + index] = 0.0;
                    moved += jump.rate;
                }
                left[count + index] += scale(jump) * moved;
            }
        }
        equations
    }
}

/// First-order change of the forces and the motion of an orbit.
pub(super) struct Change {
    /// Outputs at the points.
    pub(super) outputs: DVector<f64>,
    /// Inputs at all nodes.
    pub(super) inputs: Vec<f64>,
    /// Delay of each event at which the inputs jump, s.
    pub(super) delays_s: Vec<f64>,
}

impl Linearization {
    /// Inputs where no force acts on the orbit; `None` if all are zero.
    pub(super) fn undriven(&self, mesh: &Mesh, ports: &Ports, inputs: &[f64]) -> Option<Vec<f64>> {
        let per_subinterval = mesh.nodes() * ports.inputs();
        let mut undriven = inputs.to_vec();
        for (own, first) in undriven.chunks_exact_mut(per_subinterval).zip(&self.first_column) {
            if first.is_some() {
                own.fill(0.0);
            }
        }
        undriven.iter().any(|input| *input != 0.0).then_some(undriven)
    }

    /// Solves the equations for right-hand sides: `inputs` at the driven nodes, and `events` for each jump.
    pub(super) fn solve(&self, mesh: &Mesh, ports: &Ports, inputs: &[f64], events: &[f64]) -> Option<Change> {
        let per_subinterval = mesh.nodes() * ports.inputs();
        let mut right = DMatrix::zeros(self.count + self.jumps.len(), 1);
        for (index, first) in self.first_column.iter().enumerate() {
            let Some(first) = first else { continue };
            let own = &inputs[index * per_subinterval..(index + 1) * per_subinterval];
            right.rows_mut(*first, per_subinterval).copy_from_slice(own);
        }
        for (index, (jump, event)) in self.jumps.iter().zip(events).enumerate() {
            right[self.count + index] = event / (jump.rate * mesh.revolution_s);
        }
        // Without unknowns, as where no chip depends on the motion, there is nothing to solve; the solver requires a row.
        if !right.is_empty() && !self.factors.solve_mut(&mut right) {
            return None;
        }
        let right = right.column(0);
        let mut all_inputs = vec![0.0; inputs.len()];
        for (index, first) in self.first_column.iter().enumerate() {
            let Some(first) = first else { continue };
            all_inputs[index * per_subinterval..(index + 1) * per_subinterval]
                .copy_from_slice(right.rows(*first, per_subinterval).as_slice());
        }
        Some(Change {
            inputs: all_inputs,
            delays_s: right.rows(self.count, self.jumps.len()).iter().copied().collect(),
            outputs: &self.response * right,
        })
    }

    /// Change of the cutting forces at all nodes by a change of the outputs, N.
    pub(super) fn cutting_n(&self, outputs: &[f64]) -> Vec<[f64; 3]> {
        let of_row = |row: &SparseRow| row.iter().map(|(at, weight)| weight * outputs[*at]).sum::<f64>();
        self.cutting_by
            .chunks_exact(3)
            .map(|rows| std::array::from_fn(|axis| of_row(&rows[axis])))
            .collect()
    }

    /// Inputs at the driven nodes and event functions by a change of the outputs.
    pub(super) fn applied(&self, mesh: &Mesh, ports: &Ports, outputs: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let of_row = |row: &SparseRow| row.iter().map(|(at, weight)| weight * outputs[*at]).sum::<f64>();
        let per_subinterval = mesh.nodes() * ports.inputs();
        let mut inputs = vec![0.0; self.first_column.len() * per_subinterval];
        for (index, first) in self.first_column.iter().enumerate() {
            let Some(first) = first else { continue };
            for (offset, row) in self.inputs_by[*first..*first + per_subinterval]
                .iter()
                .enumerate()
            {
                inputs[index * per_subinterval + offset] = of_row(row);
            }
        }
        (inputs, self.jumps.iter().map(|jump| of_row(&jump.row)).collect())
    }

    /// Sizes of the jumps.
    pub(super) fn jump_sizes(&self) -> impl Iterator<Item = &JumpSize> {
        self.jumps.iter().map(|jump| &jump.size)
    }

    /// Functions g_e of the jumps along a motion at constant time.
    pub(super) fn conditions(&self, period: &Period<'_>) -> Vec<f64> {
        let path = period.path();
        let of = |jump: &Jump| {
            let index = jump.size.subinterval;
            let count = period.mesh.subintervals.len();
            let at = Instant {
                time_s: period.mesh.subintervals[index].start_s,
                contact: &period.mesh.subintervals[(index + count - 1) % count].contact,
                outputs: period.motion.at_point(period.mesh.point(index, 0)),
                path: &path,
            };
            period.condition(&jump.condition, &at)
        };
        self.jumps.iter().map(of).collect()
    }
}

/// Result of a Newton step.
pub(super) struct Step {
    pub(super) motion: Motion,
    /// Largest change of the displacement over the largest displacement.
    pub(super) moved: f64,
    /// Instants of the events at which the inputs jump: number of the event, s.
    pub(super) instants_s: Vec<(usize, f64)>,
    /// The equations, about the motion before the step.
    pub(super) linearized: Linearization,
}

/// The share `share` of a Newton step from `motion` on `mesh`.
pub(super) fn step(
    model: &CutModel,
    ports: &Ports,
    mesh: &Mesh,
    motion: &Motion,
    share: f64,
) -> Option<Step> {
    let period = Period {
        model,
        ports,
        mesh,
        motion,
    };
    let response = Response::new(mesh, ports)?;
    let linearized = period.linearized(&response)?;
    let answered = response.outputs(&period.forces().inputs);
    let residual: Vec<f64> = motion
        .values
        .iter()
        .zip(&answered)
        .map(|(y, answer)| y - answer)
        .collect();
    let (inputs, events) = linearized.applied(mesh, ports, &residual);
    let missed = linearized.conditions(&period);
    let events: Vec<f64> = events
        .iter()
        .zip(missed)
        .map(|(event, missed)| event - missed)
        .collect();
    let minus: Vec<f64> = inputs.iter().map(|x| -x).collect();
    let change = linearized.solve(mesh, ports, &minus, &events)?;
    let mut next = motion.clone();
    for ((value, answer), change) in next.values.iter_mut().zip(&answered).zip(change.outputs.iter()) {
        *value += share * (answer + change - *value);
    }
    let count = ports.axes.len();
    let displacement = |values: &[f64]| -> Vec<f64> {
        values
            .chunks_exact(motion.per_point)
            .flat_map(|point| point[..count].to_vec())
            .collect()
    };
    let (new, old) = (displacement(&next.values), displacement(&motion.values));
    let size = new.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let moved = new
        .iter()
        .zip(&old)
        .fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
    let instants = linearized
        .jumps
        .iter()
        .zip(&change.delays_s)
        .filter_map(|(jump, delay_s)| {
            let of = &mesh.subintervals[jump.size.subinterval];
            Some((of.event?, of.start_s + share * delay_s))
        })
        .collect();
    (size.is_finite() && moved.is_finite()).then(|| Step {
        motion: next,
        moved: if size > 0.0 { moved / size } else { 0.0 },
        instants_s: instants,
        linearized,
    })
}

/// The events along a motion.
pub(super) fn events(
    model: &CutModel,
    ports: &Ports,
    stretches: &Stretches,
    mesh: &Mesh,
    motion: &Motion,
) -> Events {
    Revolution {
        model,
        ports,
        stretches,
        mesh,
        motion,
    }
    .events()
}
