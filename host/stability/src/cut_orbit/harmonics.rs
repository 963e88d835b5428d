//! Fourier coefficients of the forces of an orbit.

use std::collections::HashMap;
use std::f64::consts::TAU;

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::mesh::{Mesh, SAME_TIME};
use super::model::CutModel;
use super::orbit::CutOrbit;
use super::period::Period;
use super::sensitivity::Sensitivity;

/// Fourier coefficients F_k of forces along x, y, z, N, at the multiples k = 0, 1, … of the spindle frequency:
/// F(t) = Σ_k F_k e^{ikΩt} over positive and negative k, F_{−k} the conjugate of F_k.
#[derive(Clone, Debug)]
pub struct ForceOrders {
    /// Cutting force on the tool, (orders) × 3.
    pub cutting_n: DMatrix<Complex64>,
    /// Force on the structure, cutting force minus restoring forces, (orders) × 3; 0 along axes in which the tool does
    /// not move.
    pub structure_n: DMatrix<Complex64>,
}

/// Weights of the nodes of a mesh in Fourier coefficients up to an order.
pub struct OrderWeights {
    /// By subinterval: ∫ ℓ_j e^{−ikΩt} dt/T, orders × nodes.
    weights: Vec<DMatrix<Complex64>>,
    orders: usize,
    revolution_s: f64,
}

impl OrderWeights {
    fn new(mesh: &Mesh, orders: usize) -> Self {
        let mut known: HashMap<u64, DMatrix<Complex64>> = HashMap::new();
        let unit_s = SAME_TIME * mesh.revolution_s;
        let of = |subinterval: &super::mesh::Subinterval| {
            let key = (subinterval.duration_s / unit_s).round() as u64;
            let share = subinterval.duration_s / mesh.revolution_s;
            let base = known
                .entry(key)
                .or_insert_with(|| mesh.gauss.fourier(TAU * share, orders) * Complex64::from(share));
            let mut weights = base.clone();
            let phase = -TAU * subinterval.start_s / mesh.revolution_s;
            let turns: Vec<Complex64> = (0..orders)
                .map(|order| Complex64::cis(phase * order as f64))
                .collect();
            for mut column in weights.column_iter_mut() {
                for (weight, turn) in column.iter_mut().zip(&turns) {
                    *weight *= turn;
                }
            }
            weights
        };
        Self {
            weights: mesh.subintervals.iter().map(of).collect(),
            orders,
            revolution_s: mesh.revolution_s,
        }
    }

    /// Coefficients of a force with `count` components at the nodes, node by node.
    fn sum(&self, count: usize, of: impl Fn(usize, usize) -> f64) -> DMatrix<Complex64> {
        let mut orders = DMatrix::zeros(self.orders, count);
        let mut node = 0;
        for weights in &self.weights {
            for of_node in weights.column_iter() {
                for component in 0..count {
                    let force = of(node, component);
                    if force != 0.0 {
                        for (sum, weight) in orders.column_mut(component).iter_mut().zip(of_node.iter()) {
                            *sum += weight * force;
                        }
                    }
                }
                node += 1;
            }
        }
        orders
    }
}

impl CutOrbit {
    /// Where teeth enter or leave at the angles of the engagement: time, s from the beginning of the revolution, and the
    /// cutting force along x, y, z after it minus that before it, N.
    pub fn jumps_of_engagement(&self, model: &CutModel) -> Vec<(f64, [f64; 3])> {
        let period = Period {
            model,
            ports: &self.ports,
            mesh: &self.mesh,
            motion: &self.motion,
        };
        let subintervals = &self.mesh.subintervals;
        let mut jumps = Vec::new();
        for (index, subinterval) in subintervals.iter().enumerate() {
            let before = &subintervals[(index + subintervals.len() - 1) % subintervals.len()];
            if before.stretch != subinterval.stretch {
                let [before, after] = period.beside(index);
                let jump_n = std::array::from_fn(|axis| after.cutting_n[axis] - before.cutting_n[axis]);
                jumps.push((subinterval.start_s, jump_n));
            }
        }
        jumps
    }
}

impl CutOrbit {
    /// Weights for Fourier coefficients of the orders 0 to `highest`.
    pub fn order_weights(&self, highest: usize) -> OrderWeights {
        OrderWeights::new(&self.mesh, highest + 1)
    }

    /// Fourier coefficients of the forces.
    pub fn force_orders(&self, weights: &OrderWeights) -> ForceOrders {
        self.orders_of(weights, &self.forces.cutting_n, &self.forces.inputs)
    }

    /// Derivatives of the Fourier coefficients of the forces with respect to a parameter.
    pub fn force_order_slopes(&self, weights: &OrderWeights, sensitivity: &Sensitivity) -> ForceOrders {
        let mut orders = self.orders_of(weights, &sensitivity.cutting_n, &sensitivity.inputs);
        for (time_s, cutting_n, inputs) in &sensitivity.impulses {
            let turn = Complex64::cis(-TAU * time_s / weights.revolution_s);
            let mut factor = Complex64::from(1.0 / weights.revolution_s);
            for order in 0..weights.orders {
                for (axis, force) in cutting_n.iter().enumerate() {
                    orders.cutting_n[(order, axis)] += factor * force;
                }
                for (axis, force) in self.ports.axes.iter().zip(inputs) {
                    orders.structure_n[(order, *axis)] += factor * force;
                }
                factor *= turn;
            }
        }
        orders
    }

    fn orders_of(&self, weights: &OrderWeights, cutting_n: &[[f64; 3]], inputs: &[f64]) -> ForceOrders {
        let count = self.ports.inputs();
        let along = weights.sum(self.ports.axes.len(), |node, axis| inputs[node * count + axis]);
        let mut structure_n = DMatrix::zeros(weights.orders, 3);
        for (index, axis) in self.ports.axes.iter().enumerate() {
            structure_n.set_column(*axis, &along.column(index));
        }
        ForceOrders {
            cutting_n: weights.sum(3, |node, axis| cutting_n[node][axis]),
            structure_n,
        }
    }
}
