//! The delay equation linearized about a forced orbit, in the form of the linear problem, so that the collocated map
//! and the characteristic matrix apply to orbits as well.
//!
//! About the orbit x*(t), ẋ = J(t) x + B Σ (w − z*) s·cutting·nᵀ(u − u_τ), with J the Jacobian of the orbit equation
//! and s the slope of the chip law, relative to the linear law. The axial displacement z* acts only with axial-depth
//! modulation; otherwise the depth in the regenerative term is w.

use nalgebra::DMatrix;

use super::collocated::Linearized;
use super::tooth_period::{Subinterval, ToothPeriod};
use crate::problem::period::{Element, Period, Port};

/// Elements of the delay equation over a tooth period, linearized about a forced orbit at an axial depth, which is
/// given by its states at the nodes of each subinterval; `None` if a subinterval is singular.
pub(super) fn about(map: &ToothPeriod<'_>, orbit: &[DMatrix<f64>], depth_m: f64) -> Option<Period> {
    let order = map.problem.order();
    let mut elements = Vec::new();
    let mut flight = DMatrix::identity(order, order);
    for (subinterval, states) in map.subintervals.iter().zip(orbit) {
        let linearized = map.linearized(subinterval, states, depth_m);
        if subinterval.teeth == 0 {
            flight = linearized.flow()?.1 * flight;
        } else {
            elements.push(element(map, subinterval, states, depth_m, &linearized)?);
        }
    }
    Some(Period { elements, flight })
}

fn element(
    map: &ToothPeriod<'_>,
    subinterval: &Subinterval,
    states: &DMatrix<f64>,
    depth_m: f64,
    linearized: &Linearized<'_>,
) -> Option<Element> {
    let (problem, gauss) = (map.problem, &map.gauss);
    let structure = &problem.linear.structure;
    let process = &problem.linear.process;
    let (order, nodes, teeth) = (problem.order(), gauss.nodes.len(), subinterval.teeth);
    let seconds_per_radian = subinterval.duration / subinterval.turn;
    let mut seen = DMatrix::zeros(nodes * teeth, order);
    let mut push = DMatrix::zeros(order, nodes * teeth);
    let mut ports = Vec::with_capacity(nodes * teeth);
    for (j, node) in gauss.nodes.iter().enumerate() {
        let phase = subinterval.phase + subinterval.turn * node;
        let modulation = if process.axial_depth_modulation && depth_m > 0.0 {
            1.0 - (structure.c.row(2) * states.column(j))[0] / depth_m
        } else {
            1.0
        };
        for tooth in 0..teeth {
            let port = j * teeth + tooth;
            let of_cut = problem.port(tooth, phase);
            let force = of_cut.force * modulation;
            seen.row_mut(port)
                .copy_from(&(of_cut.normal.transpose() * &structure.c));
            push.column_mut(port).copy_from(&(&structure.b * force));
            ports.push(Port {
                time_s: phase * seconds_per_radian,
                weight_s: gauss.weights[j] * subinterval.duration,
                normal: of_cut.normal,
                force,
            });
        }
    }
    let (by_start, flow) = linearized.flow()?;
    let right = DMatrix::from_fn(order * nodes, nodes * teeth, |row, port| {
        let (i, state) = (row / order, row % order);
        subinterval.duration * gauss.integrals[(i, port / teeth)] * push[(state, port)]
    });
    let by_port = linearized.solve(right)?;
    let mut drive = linearized.gather(&by_port);
    for port in 0..nodes * teeth {
        let mut column = drive.column_mut(port);
        column.axpy(
            subinterval.duration * gauss.weights[port / teeth],
            &push.column(port),
            1.0,
        );
    }
    // Displacement along the chip normal at each port (cutting tooth at a node), from the states at its node.
    let look = |values: &DMatrix<f64>| {
        let mut looked = DMatrix::zeros(nodes * teeth, values.ncols());
        for port in 0..nodes * teeth {
            let node = port / teeth;
            looked
                .row_mut(port)
                .copy_from(&(seen.row(port) * values.rows(node * order, order)));
        }
        looked
    };
    Some(Element {
        observe: look(&by_start),
        kernel: look(&by_port),
        flow,
        drive,
        ports,
        axial: None,
    })
}
