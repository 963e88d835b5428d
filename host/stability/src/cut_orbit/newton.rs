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
//!
//! The inputs at a node often depend on few combinations of the motion: on the chip of each tooth that cuts. With Φ' = B R,
//! node by node, R of full rank, δf = B q + b is found from q = R G (B q + b) alone, where b is what changes explicitly.

use nalgebra::{DMatrix, DVector, Vector3};

use super::events::{Events, Revolution};
use super::jumps::{Jump, JumpSize};
use super::law::{Instant, Slopes};
use super::mesh::{Mesh, Stretches};
use super::model::{CutModel, Ports};
use super::motion::Motion;
use super::period::{Period, SparseRow};
use super::response::{Driven, Response};
use quietcut_numerics::lu::Lu;

/// Length of a row of Φ' that the rows before it do not give, over its own, below which it is a combination of them.
const DEPENDENT: f64 = 1e-12;

/// The equations of a Newton step, factored.
pub(super) struct Linearization {
    response: Response,
    /// What the unknowns of each subinterval do; `None` where no force acts.
    driven: Vec<Option<Driven>>,
    /// Number of unknowns besides the instants of events.
    count: usize,
    /// R: unknowns by outputs at the points.
    condensed_by: Vec<SparseRow>,
    /// Cutting forces at the nodes by outputs at the points.
    cutting_by: Vec<SparseRow>,
    jumps: Vec<Jump>,
    /// Outputs by unknowns.
    by_unknowns: DMatrix<f64>,
    factors: Lu,
}

impl Period<'_> {
    /// Rows of the cutting force at one instant, whose outputs are those of `point`.
    fn cutting_rows(&self, slopes: &Slopes, point: usize) -> [SparseRow; 3] {
        std::array::from_fn(|axis| {
            let mut row = self.own_row(point, slopes.cutting.row(axis).iter().copied());
            for (time_s, by) in &slopes.earlier {
                self.add_earlier(&mut row, *time_s, by.row(axis).transpose());
            }
            row
        })
    }

    /// B and R of one instant, whose outputs are those of `point`: the rows of Φ', orthogonalized one after the other.
    fn condensed(&self, slopes: &Slopes, point: usize, sizes: &[f64]) -> (DMatrix<f64>, Vec<SparseRow>) {
        let (inputs, outputs) = (self.ports.inputs(), self.ports.outputs());
        let width = outputs + 3 * slopes.earlier.len();
        // In units of the size of each output.
        let mut unit = vec![1.0; width];
        for (unit, size) in unit.iter_mut().zip(sizes) {
            *unit = size.max(f64::MIN_POSITIVE.sqrt());
        }
        for earlier in unit[outputs..].chunks_exact_mut(3) {
            for (index, axis) in self.ports.axes.iter().enumerate() {
                earlier[*axis] = sizes[index].max(f64::MIN_POSITIVE.sqrt());
            }
        }
        let mut rest = DMatrix::zeros(inputs, width);
        rest.columns_mut(0, outputs)
            .copy_from(&(&slopes.inputs + &slopes.by_cutting * &slopes.cutting));
        for (index, (_, by)) in slopes.earlier.iter().enumerate() {
            rest.columns_mut(outputs + 3 * index, 3)
                .copy_from(&(&slopes.by_cutting * by));
        }
        for (mut column, unit) in rest.column_iter_mut().zip(&unit) {
            column *= *unit;
        }
        let whole: Vec<f64> = rest.row_iter().map(|row| row.norm()).collect();
        let mut basis: Vec<DVector<f64>> = Vec::new();
        let mut rows = Vec::new();
        for (index, whole) in whole.iter().enumerate() {
            let row = rest.row(index).clone_owned();
            let square = row.norm_squared();
            if square.sqrt() <= DEPENDENT * whole || square == 0.0 {
                continue;
            }
            let shares = &rest * row.transpose() / square;
            rest -= &shares * &row;
            basis.push(shares);
            let weights: Vec<f64> = row.iter().zip(&unit).map(|(value, unit)| value / unit).collect();
            let mut sparse = self.own_row(point, weights[..outputs].iter().copied());
            for ((time_s, _), weights) in slopes.earlier.iter().zip(weights[outputs..].chunks_exact(3)) {
                self.add_earlier(&mut sparse, *time_s, Vector3::from_column_slice(weights));
            }
            rows.push(sparse);
        }
        let basis = DMatrix::from_fn(inputs, basis.len(), |input, unknown| basis[unknown][input]);
        (basis, rows)
    }

    /// The equations of a Newton step about the motion; `None` if they are singular.
    pub(super) fn linearized(&self, response: Response) -> Option<Linearization> {
        let (inputs, nodes) = (self.ports.inputs(), self.mesh.nodes());
        let sizes = self.motion.sizes();
        let path = self.path();
        let mut driven = Vec::with_capacity(self.mesh.subintervals.len());
        let (mut cutting_by, mut condensed_by) = (Vec::new(), Vec::new());
        for (index, subinterval) in self.mesh.subintervals.iter().enumerate() {
            if !self.is_driven(index) {
                driven.push(None);
                cutting_by.extend(std::iter::repeat_n(Vec::new(), 3 * nodes));
                continue;
            }
            let first_column = condensed_by.len();
            let mut bases = Vec::with_capacity(nodes);
            for node in 0..nodes {
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
                cutting_by.extend(self.cutting_rows(&slopes, point));
                let (basis, rows) = self.condensed(&slopes, point, &sizes);
                condensed_by.extend(rows);
                bases.push(basis);
            }
            let mut basis = DMatrix::zeros(nodes * inputs, condensed_by.len() - first_column);
            let mut column = 0;
            for (node, own) in bases.iter().enumerate() {
                basis
                    .view_mut((node * inputs, column), own.shape())
                    .copy_from(own);
                column += own.ncols();
            }
            driven.push(Some(Driven { first_column, basis }));
        }
        let count = condensed_by.len();
        let jumps = self.jumps(&sizes);
        let impulses: Vec<_> = jumps
            .iter()
            .map(|jump| (jump.size.subinterval, -&jump.size.inputs))
            .collect();
        let by_unknowns = response.matrix(&driven, count, &impulses);
        let factors = Lu::new(self.equations(&condensed_by, &jumps, count, &by_unknowns));
        factors.is_regular().then_some(Linearization {
            response,
            driven,
            count,
            condensed_by,
            cutting_by,
            jumps,
            by_unknowns,
            factors,
        })
    }

    fn equations(
        &self,
        condensed_by: &[SparseRow],
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
            for (row, weights) in condensed_by.iter().enumerate() {
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
    /// Change of an orbit whose inputs change by `inputs` at all nodes, and its event functions by −`events`.
    pub(super) fn changed(&self, mesh: &Mesh, inputs: &[f64], events: &[f64]) -> Option<Change> {
        let moved = self.response.outputs(inputs);
        let events: Vec<f64> = events
            .iter()
            .zip(self.of_events(&moved))
            .map(|(event, by)| event - by)
            .collect();
        let mut change = self.solve(mesh, self.of_unknowns(&moved), &events)?;
        for (sum, own) in change.inputs.iter_mut().zip(inputs) {
            *sum += own;
        }
        for (sum, own) in change.outputs.iter_mut().zip(&moved) {
            *sum += own;
        }
        Some(change)
    }

    /// Solves the equations for right-hand sides of the unknowns, and `events` for each jump.
    fn solve(&self, mesh: &Mesh, unknowns: Vec<f64>, events: &[f64]) -> Option<Change> {
        let mut right = DMatrix::zeros(self.count + self.jumps.len(), 1);
        right.rows_mut(0, self.count).copy_from_slice(&unknowns);
        for (index, (jump, event)) in self.jumps.iter().zip(events).enumerate() {
            right[self.count + index] = event / (jump.rate * mesh.revolution_s);
        }
        // Without unknowns, as where no chip depends on the motion, there is nothing to solve; the solver requires a row.
        if !right.is_empty() && !self.factors.solve_mut(&mut right) {
            return None;
        }
        let right = right.column(0);
        let mut inputs = Vec::new();
        let per_subinterval = self.response.inputs_of_subinterval();
        for driven in &self.driven {
            match driven {
                Some(Driven { first_column, basis }) => {
                    inputs.extend((basis * right.rows(*first_column, basis.ncols())).iter());
                }
                None => inputs.resize(inputs.len() + per_subinterval, 0.0),
            }
        }
        Some(Change {
            inputs,
            delays_s: right.rows(self.count, self.jumps.len()).iter().copied().collect(),
            outputs: &self.by_unknowns * right,
        })
    }

    /// R applied to a change of the outputs.
    fn of_unknowns(&self, outputs: &[f64]) -> Vec<f64> {
        self.condensed_by
            .iter()
            .map(|row| applied(row, outputs))
            .collect()
    }

    /// Change of the event functions by a change of the outputs.
    fn of_events(&self, outputs: &[f64]) -> Vec<f64> {
        self.jumps
            .iter()
            .map(|jump| applied(&jump.row, outputs))
            .collect()
    }

    /// Change of the cutting forces at all nodes by a change of the outputs, N.
    pub(super) fn cutting_n(&self, outputs: &[f64]) -> Vec<[f64; 3]> {
        self.cutting_by
            .chunks_exact(3)
            .map(|rows| std::array::from_fn(|axis| applied(&rows[axis], outputs)))
            .collect()
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

fn applied(row: &SparseRow, outputs: &[f64]) -> f64 {
    row.iter().map(|(at, weight)| weight * outputs[*at]).sum()
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
    let answered = response.outputs(&period.forces().inputs);
    let linearized = period.linearized(response)?;
    let missed_by: Vec<f64> = answered
        .iter()
        .zip(&motion.values)
        .map(|(answer, y)| answer - y)
        .collect();
    let events: Vec<f64> = linearized
        .of_events(&missed_by)
        .iter()
        .zip(linearized.conditions(&period))
        .map(|(event, missed)| -event - missed)
        .collect();
    let change = linearized.solve(mesh, linearized.of_unknowns(&missed_by), &events)?;
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
