//! Map of the state of structure and history over one revolution of a tool with variable pitch; its eigenvalues are the
//! Floquet multipliers (characteristic multipliers).

use std::rc::Rc;

use nalgebra::{DMatrix, DVector, Dyn, LU, Vector3};
use num_complex::Complex64;

use super::chatter_frequency::dominant_frequency_hz;
use super::krylov::LinearMap;
use super::map_spectrum::PeriodMap;
use crate::problem::revolution::Revolution;
use crate::problem::revolution_mesh::{Series, Source};

/// Map over one revolution at one axial depth, of the state of the structure and of the past displacements along the
/// chip normals on which later chips depend.
pub(crate) struct RevolutionMap<'a> {
    revolution: Rc<Revolution<'a>>,
    depth_m: f64,
    /// LU factors of I − w Q, one for each subinterval of the revolution in its order, with the axial depth w and the
    /// kernel Q, the response of the displacements along the chip normals to the regenerative chips, 1/m.
    factors: Vec<LU<f64, Dyn, Dyn>>,
}

/// Motion of a linear cut over a revolution, for several initial states (columns) at once.
struct Trace {
    /// State x of the structure at the end of the revolution, n × columns.
    state: DMatrix<f64>,
    /// Displacements p along the chip normals, one matrix (columns × ports) for each element of the revolution in its
    /// order.
    seen: Vec<DMatrix<f64>>,
    /// Regenerative chips p − p_τ, one matrix (ports × columns) for each element of the revolution in its order.
    chips: Vec<DMatrix<f64>>,
}

impl<'a> RevolutionMap<'a> {
    /// Map of the structure's state and of past displacements along the chip normals over one revolution at an axial
    /// depth, m; `None` if the collocation equations are singular.
    pub(crate) fn new(revolution: Rc<Revolution<'a>>, depth_m: f64) -> Option<Self> {
        let factors = revolution.elements.iter().map(|element| {
            let size = element.kernel.nrows();
            let implicit = DMatrix::identity(size, size) - &element.kernel * depth_m;
            let factor = implicit.lu();
            factor.is_invertible().then_some(factor)
        });
        let factors = factors.collect::<Option<_>>()?;
        Some(Self {
            revolution,
            depth_m,
            factors,
        })
    }

    fn trace(&self, columns: &DMatrix<f64>) -> Option<Trace> {
        let revolution = self.revolution.as_ref();
        let order = revolution.pitched.problem.structure.order();
        let width = columns.ncols();
        let mut trace = Trace {
            state: columns.rows(0, order).into_owned(),
            seen: Vec::with_capacity(revolution.elements.len()),
            chips: Vec::with_capacity(revolution.elements.len()),
        };
        let before = columns.transpose();
        let subintervals = &revolution.mesh.subintervals;
        let parts = subintervals.iter().zip(&revolution.elements).zip(&self.factors);
        for ((subinterval, element), factor) in parts {
            let ports = subinterval.pasts.len();
            let mut past = DMatrix::zeros(width, ports);
            for (port, of) in subinterval.pasts.iter().enumerate() {
                let mut sum = past.column_mut(port);
                for (node, weight) in of.weights.iter().enumerate() {
                    let seen = match of.source {
                        Source::Earlier(first) => before.column(first + node),
                        Source::Own(Series { subinterval, tooth }) => {
                            // No value is known yet if a delay is shorter than a subinterval, so that the delayed time
                            // lies in the subinterval itself; the map then has no image.
                            let values = trace.seen.get(subinterval)?;
                            values.column(node * subintervals[subinterval].cutting.len() + tooth)
                        }
                    };
                    sum.axpy(*weight, &seen, 1.0);
                }
            }
            // Collocation equation of the element, p − w Q p = E x − w Q p_τ, for the displacements p along the chip
            // normals
            let past = past.transpose();
            let mut seen = &element.observe * &trace.state;
            seen.gemm(-self.depth_m, &element.kernel, &past, 1.0);
            if ports > 0 && !factor.solve_mut(&mut seen) {
                return None;
            }
            let chips = &seen - past;
            let mut next = &element.flow * &trace.state;
            next.gemm(self.depth_m, &element.drive, &chips, 1.0);
            trace.state = next;
            trace.seen.push(seen.transpose());
            trace.chips.push(chips);
        }
        Some(trace)
    }
}

impl LinearMap for RevolutionMap<'_> {
    fn size(&self) -> usize {
        self.revolution.mesh.size
    }

    fn apply(&self, columns: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let trace = self.trace(columns)?;
        let mut image = DMatrix::zeros(self.size(), columns.ncols());
        image.rows_mut(0, trace.state.nrows()).copy_from(&trace.state);
        for (series, first) in &self.revolution.mesh.kept {
            let subinterval = &self.revolution.mesh.subintervals[series.subinterval];
            let values = &trace.seen[series.subinterval];
            for node in 0..subinterval.gauss.nodes.len() {
                let column = values.column(node * subinterval.cutting.len() + series.tooth);
                image.row_mut(first + node).tr_copy_from(&column);
            }
        }
        image.iter().all(|entry| entry.is_finite()).then_some(image)
    }
}

impl PeriodMap for RevolutionMap<'_> {
    fn chatter_hz(&self, multiplier: Complex64, vector: &DVector<Complex64>) -> Option<f64> {
        let parts = DMatrix::from_fn(
            vector.len(),
            2,
            |i, j| {
                if j == 0 { vector[i].re } else { vector[i].im }
            },
        );
        let trace = self.trace(&parts)?;
        let problem = &self.revolution.pitched.problem;
        let period_s = self.revolution.mesh.passages.period_s;
        dominant_frequency_hz(problem, self.depth_m, period_s, multiplier, |s| {
            let mut harmonic = Vector3::<Complex64>::zeros();
            for (element, chips) in self.revolution.elements.iter().zip(&trace.chips) {
                for (port, chip) in element.ports.iter().zip(chips.row_iter()) {
                    let chip = Complex64::new(chip[0], chip[1]) * port.weight_s;
                    harmonic += port.force.map(Complex64::from) * (chip * (-s * port.time_s).exp());
                }
            }
            Some((problem.structure.transfer(s)? * harmonic).norm())
        })
    }
}
