//! A revolution of a model with given contact: forces along its motion, and weights of its points.

use nalgebra::Vector3;

use super::law::Instant;
use super::mesh::Mesh;
use super::model::{CutModel, Ports};
use super::motion::Motion;

/// Row of a sparse matrix: output of a point, with its weight.
pub(super) type SparseRow = Vec<(usize, f64)>;

/// Forces at all nodes of a mesh.
#[derive(Clone, Debug)]
pub(super) struct NodeForces {
    /// Cutting force along x, y, z, N, node by node.
    pub(super) cutting_n: Vec<[f64; 3]>,
    /// Inputs of the structure, node by node.
    pub(super) inputs: Vec<f64>,
}

/// A revolution of a model at given contact.
pub(super) struct Period<'a> {
    pub(super) model: &'a CutModel,
    pub(super) ports: &'a Ports,
    pub(super) mesh: &'a Mesh,
    pub(super) motion: &'a Motion,
}

impl Period<'_> {
    pub(super) fn path(&self) -> impl Fn(f64) -> [f64; 3] + '_ {
        |time_s| self.motion.displacement(self.mesh, self.ports, time_s)
    }

    /// True if a force acts in the subinterval.
    pub(super) fn is_driven(&self, subinterval: usize) -> bool {
        !self.model.restoring_forces.is_empty()
            || self.mesh.subintervals[subinterval]
                .contact
                .teeth
                .iter()
                .any(|tooth| tooth.passings.is_some())
    }

    /// Forces along the motion at all nodes.
    pub(super) fn forces(&self) -> NodeForces {
        let path = self.path();
        let mut all = NodeForces {
            cutting_n: Vec::new(),
            inputs: Vec::new(),
        };
        for (index, subinterval) in self.mesh.subintervals.iter().enumerate() {
            for node in 0..self.mesh.nodes() {
                let forces = self.model.forces(
                    self.ports,
                    &Instant {
                        time_s: self.mesh.time_s(index, node),
                        contact: &subinterval.contact,
                        outputs: self.motion.at_point(self.mesh.point(index, node + 1)),
                        path: &path,
                    },
                );
                all.cutting_n.push(forces.cutting_n);
                all.inputs.extend(forces.inputs);
            }
        }
        all
    }

    /// Outputs of a point with index `point`, weighted by `row`.
    pub(super) fn own_row(&self, point: usize, row: impl Iterator<Item = f64>) -> SparseRow {
        let first = point * self.ports.outputs();
        row.enumerate()
            .filter(|(_, weight)| *weight != 0.0)
            .map(|(output, weight)| (first + output, weight))
            .collect()
    }

    /// Adds `weights` times the displacement at an earlier instant.
    pub(super) fn add_earlier(&self, row: &mut SparseRow, time_s: f64, weights: Vector3<f64>) {
        for (point, share) in self.mesh.interpolation_at(time_s).points() {
            let first = point * self.ports.outputs();
            for (index, axis) in self.ports.axes.iter().enumerate() {
                if weights[*axis] != 0.0 {
                    row.push((first + index, share * weights[*axis]));
                }
            }
        }
    }
}
