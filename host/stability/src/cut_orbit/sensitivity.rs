//! Derivatives of an orbit with respect to parameters of its model.

use super::jumps::JumpSize;
use super::model::{CutModel, Ports};
use super::motion::Motion;
use super::orbit::CutOrbit;
use super::period::Period;
use super::response::Response;
use super::states;

/// Derivative of an orbit with respect to one parameter.
pub struct Sensitivity {
    /// Derivatives of the forces at the nodes, node by node: cutting force along x, y, z, and inputs of the structure.
    pub(super) cutting_n: Vec<[f64; 3]>,
    pub(super) inputs: Vec<f64>,
    /// Derivative of the outputs at the points at constant time.
    outputs: Vec<f64>,
    /// Events at which the forces jump: time, s; jumps of cutting force and inputs times the derivative of the delay.
    pub(super) impulses: Vec<(f64, [f64; 3], Vec<f64>)>,
}

/// What a parameter changes explicitly, at given forces on the structure.
struct Explicit {
    outputs: Vec<f64>,
    cutting_n: Vec<[f64; 3]>,
    inputs: Vec<f64>,
    events: Vec<f64>,
}

impl CutOrbit {
    /// Derivative of the orbit with respect to a parameter p of its model, from two models with p ± `difference`/2.
    ///
    /// By the implicit function theorem: only the forces of the law along the orbit, and the response of the structure
    /// to the forces of the orbit, are differentiated by a difference; the change of the orbit is one back-substitution.
    /// `None` if the models differ in spindle speed, engagement or number of axes, have other structures and further
    /// internal states, or the structure has no periodic response.
    ///
    /// A parameter that vanishes in the orbit's model is possible, such as the coefficient of a further nonlinear
    /// spring. The derivative is one-sided where a restoring force would change its regimes. Internal states of forces
    /// that the orbit lacks are those along its motion, if it has none itself.
    pub fn derivative(&self, plus: &CutModel, minus: &CutModel, difference: f64) -> Option<Sensitivity> {
        let (plus, minus) = (self.explicit(plus)?, self.explicit(minus)?);
        let slope = |a: &[f64], b: &[f64]| -> Vec<f64> {
            a.iter().zip(b).map(|(a, b)| (a - b) / difference).collect()
        };
        let by_outputs = slope(&plus.outputs, &minus.outputs);
        let inputs = slope(&plus.inputs, &minus.inputs);
        let events: Vec<f64> = slope(&plus.events, &minus.events).iter().map(|g| -g).collect();
        let change = self.linearized.changed(&self.mesh, &inputs, &events)?;
        let by_motion = self.linearized.cutting_n(change.outputs.as_slice());
        let explicit = plus.cutting_n.iter().zip(&minus.cutting_n);
        let cutting_n = explicit.zip(&by_motion).map(|((plus, minus), by_motion)| {
            std::array::from_fn(|axis| (plus[axis] - minus[axis]) / difference + by_motion[axis])
        });
        Some(Sensitivity {
            cutting_n: cutting_n.collect(),
            inputs: change.inputs,
            outputs: by_outputs
                .iter()
                .zip(change.outputs.iter())
                .map(|(explicit, change)| explicit + change)
                .collect(),
            impulses: self
                .linearized
                .jump_sizes()
                .zip(&change.delays_s)
                .map(|(jump, delay_s)| self.impulse(jump, *delay_s))
                .collect(),
        })
    }

    fn impulse(&self, jump: &JumpSize, delay_s: f64) -> (f64, [f64; 3], Vec<f64>) {
        let inputs = jump.inputs.iter().map(|size| -delay_s * size);
        let cutting_n = jump.cutting_n.map(|size| -delay_s * size);
        (
            self.mesh.subintervals[jump.subinterval].start_s,
            cutting_n,
            inputs.collect(),
        )
    }

    /// Forces and motion of `model` where the structure feels the forces of this orbit.
    fn explicit(&self, model: &CutModel) -> Option<Explicit> {
        let ports = model.ports_with(self.ports.accelerations.is_some());
        let is_alike = ports.axes == self.ports.axes
            && (model.revolution_s() / self.mesh.revolution_s - 1.0).abs() < 1e-12;
        if !is_alike {
            return None;
        }
        if ports.internal != self.ports.internal {
            return self.with_states(model, &ports);
        }
        let same = ports.a == self.ports.a && ports.b == self.ports.b && ports.output == self.ports.output;
        let motion = if same {
            self.motion.clone()
        } else {
            Motion {
                values: Response::new(&self.mesh, &ports)?.outputs(&self.forces.inputs),
                per_point: ports.outputs(),
            }
        };
        let period = Period {
            model,
            ports: &ports,
            mesh: &self.mesh,
            motion: &motion,
        };
        let forces = period.forces();
        Some(Explicit {
            events: self.linearized.conditions(&period),
            cutting_n: forces.cutting_n,
            inputs: forces.inputs,
            outputs: motion.values,
        })
    }
}

impl CutOrbit {
    /// [`Self::explicit`] of a model with internal states, for an orbit without.
    fn with_states(&self, model: &CutModel, ports: &Ports) -> Option<Explicit> {
        let order = self.ports.a.nrows();
        let same = self.ports.internal == 0
            && ports.a.view((0, 0), (order, order)) == self.ports.a
            && ports.b.view((0, 0), (order, self.ports.inputs())) == self.ports.b;
        if !same {
            return None;
        }
        let mut motion = self.motion.of(&self.ports, ports);
        states::follow(model, ports, &self.mesh, &mut motion);
        let period = Period {
            model,
            ports,
            mesh: &self.mesh,
            motion: &motion,
        };
        let forces = period.forces();
        let own = self.ports.inputs();
        let inputs = forces.inputs.chunks_exact(ports.inputs());
        Some(Explicit {
            events: self.linearized.conditions(&period),
            cutting_n: forces.cutting_n,
            inputs: inputs.flat_map(|inputs| inputs[..own].to_vec()).collect(),
            outputs: self.motion.values.clone(),
        })
    }
}

impl Sensitivity {
    /// Derivative of the displacement of the tool along x, y, z at a time, m per unit of the parameter.
    pub fn displacement(&self, orbit: &CutOrbit, time_s: f64) -> [f64; 3] {
        let motion = Motion {
            values: self.outputs.clone(),
            per_point: orbit.ports.outputs(),
        };
        motion.displacement(&orbit.mesh, &orbit.ports, time_s)
    }
}
