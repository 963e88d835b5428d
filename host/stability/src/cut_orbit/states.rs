//! Internal states of restoring forces along a known motion.

use quietcut_model::MotionState;

use super::mesh::Mesh;
use super::model::{CutModel, Ports};
use super::motion::Motion;

/// Steps between two points of a mesh: an error of the states is only that of a start.
const STEPS: usize = 4;
/// Revolutions after which the states repeat well enough for a start.
const REVOLUTIONS: usize = 3;

/// Sets the internal states of a motion to those that its displacement and velocity lead to, from zero, in a few
/// revolutions: by the method of Heun, each regime chosen by the state at the beginning of a step.
pub(super) fn follow(model: &CutModel, ports: &Ports, mesh: &Mesh, motion: &mut Motion) {
    if ports.internal == 0 {
        return;
    }
    let mut own = vec![0.0; ports.internal];
    for _ in 0..REVOLUTIONS {
        for (index, subinterval) in mesh.subintervals.iter().enumerate() {
            let nodes_s = (0..mesh.nodes()).map(|node| mesh.time_s(index, node));
            let end_s = subinterval.start_s + subinterval.duration_s;
            let ends = nodes_s.chain([end_s]);
            let mut from_s = subinterval.start_s;
            for (point, to_s) in ends.enumerate() {
                let first = mesh.point(index, point) * motion.per_point + ports.states;
                motion.values[first..first + ports.internal].copy_from_slice(&own);
                advance(model, ports, [from_s, to_s], &mut own, &|time_s| {
                    motion.within(mesh, index, time_s)
                });
                from_s = to_s;
            }
        }
    }
}

fn advance(
    model: &CutModel,
    ports: &Ports,
    [from_s, to_s]: [f64; 2],
    own: &mut [f64],
    outputs: &dyn Fn(f64) -> Vec<f64>,
) {
    let step_s = (to_s - from_s) / STEPS as f64;
    let at = |time_s: f64| {
        let outputs = outputs(time_s);
        MotionState {
            t: model.time_s,
            x: ports.displacement(&outputs),
            v: ports.velocity(&outputs),
        }
    };
    let mut now = at(from_s);
    for step in 0..STEPS {
        let next = at(from_s + (step + 1) as f64 * step_s);
        let mut place = 0;
        for force in &model.restoring_forces {
            let own = &mut own[place..place + force.states()];
            place += own.len();
            let regime = force.next(None, &now, own, 0.0);
            let mut rates = [vec![0.0; own.len()], vec![0.0; own.len()]];
            force.rate(regime, &now, own, &mut rates[0]);
            let mut guess: Vec<f64> = own
                .iter()
                .zip(&rates[0])
                .map(|(z, rate)| z + step_s * rate)
                .collect();
            force.confine(&mut guess);
            let regime = force.next(None, &next, &guess, 0.0);
            force.rate(regime, &next, &guess, &mut rates[1]);
            for (index, z) in own.iter_mut().enumerate() {
                *z += 0.5 * step_s * (rates[0][index] + rates[1][index]);
            }
            force.confine(own);
        }
        now = next;
    }
}
