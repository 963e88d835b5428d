//! Outputs of the structure over a revolution.

use super::mesh::{Interpolation, Mesh};
use super::model::Ports;

/// Outputs of the structure at the points of a mesh.
#[derive(Clone, Debug)]
pub(super) struct Motion {
    /// Point by point.
    pub(super) values: Vec<f64>,
    pub(super) per_point: usize,
}

impl Motion {
    /// The tool at rest.
    pub(super) fn at_rest(mesh: &Mesh, ports: &Ports) -> Self {
        Self {
            values: vec![0.0; mesh.points() * ports.outputs()],
            per_point: ports.outputs(),
        }
    }

    /// This motion, with the outputs `own`, with others: what these lack is 0.
    pub(super) fn of(&self, own: &Ports, other: &Ports) -> Self {
        if own.outputs() == other.outputs() {
            return self.clone();
        }
        let moved = 2 * own.axes.len();
        let mut values = Vec::with_capacity(self.values.len() / self.per_point * other.outputs());
        for point in self.values.chunks_exact(self.per_point) {
            let first = values.len();
            values.extend_from_slice(&point[..moved]);
            values.resize(first + other.outputs(), 0.0);
        }
        Self {
            values,
            per_point: other.outputs(),
        }
    }

    pub(super) fn at_point(&self, point: usize) -> &[f64] {
        &self.values[point * self.per_point..(point + 1) * self.per_point]
    }

    /// Outputs at an instant of a subinterval, or a little beyond it.
    pub(super) fn within(&self, mesh: &Mesh, subinterval: usize, time_s: f64) -> Vec<f64> {
        self.interpolated(&mesh.interpolation(subinterval, time_s))
    }

    fn interpolated(&self, interpolation: &Interpolation) -> Vec<f64> {
        let mut outputs = vec![0.0; self.per_point];
        for (point, weight) in interpolation.points() {
            for (sum, value) in outputs.iter_mut().zip(self.at_point(point)) {
                *sum += weight * value;
            }
        }
        outputs
    }

    /// Displacement of the tool along x, y, z, m, at any time, s.
    pub(super) fn displacement(&self, mesh: &Mesh, ports: &Ports, time_s: f64) -> [f64; 3] {
        let interpolation = mesh.interpolation_at(time_s);
        let mut moved = [0.0; 3];
        for (point, weight) in interpolation.points() {
            for (axis, value) in ports.axes.iter().zip(self.at_point(point)) {
                moved[*axis] += weight * value;
            }
        }
        moved
    }

    /// This motion at the points of another mesh. Where that has as many subintervals, each takes the motion of its
    /// like, beyond whose ends it may reach: the event between two of them has moved.
    pub(super) fn on(&self, mesh: &Mesh, other: &Mesh) -> Self {
        let mut values = Vec::with_capacity(other.points() * self.per_point);
        if mesh.subintervals.len() == other.subintervals.len() {
            for (index, subinterval) in other.subintervals.iter().enumerate() {
                values.extend(self.within(mesh, index, subinterval.start_s));
                for node in 0..other.nodes() {
                    values.extend(self.within(mesh, index, other.time_s(index, node)));
                }
            }
            return Self {
                values,
                per_point: self.per_point,
            };
        }
        for (index, subinterval) in other.subintervals.iter().enumerate() {
            // A start belongs to the subinterval that contains the middle, so that rounding of the instant of an event
            // does not choose the other side.
            let source = mesh.containing(subinterval.start_s + 0.5 * subinterval.duration_s);
            let start_source = mesh.containing(subinterval.start_s);
            values.extend(self.within(mesh, start_source.min(source), subinterval.start_s));
            for node in 0..other.nodes() {
                let time_s = other.time_s(index, node);
                values.extend(self.within(mesh, mesh.containing(time_s), time_s));
            }
        }
        Self {
            values,
            per_point: self.per_point,
        }
    }

    /// Largest magnitude of each output over the revolution.
    pub(super) fn sizes(&self) -> Vec<f64> {
        let mut sizes = vec![0.0_f64; self.per_point];
        for point in self.values.chunks_exact(self.per_point) {
            for (size, value) in sizes.iter_mut().zip(point) {
                *size = size.max(value.abs());
            }
        }
        sizes
    }
}
