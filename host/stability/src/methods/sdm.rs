//! Semi-discretization: in each step the coefficients are averaged and the delayed displacement is a polynomial; the
//! resulting equation is solved exactly.
//!
//! With means K̄ and β̄ over the step from t_i to t_i + h
//!
//!   ẋ = (A + B (w K̄ − β̄) C) x − w B K̄_d ŷ_d,   ŷ_d ≈ y(t − τ_d),
//!
//! where ŷ is the constant y(t_i − τ_d) (order 0) or linear from y(t_i − τ_d) to y(t_i + h − τ_d) (order 1): Insperger
//! & Stépán, Int. J. Numer. Meth. Engng 61 (2004) 117; Insperger, Stépán & Turi, J. Sound Vib. 313 (2008) 334.
//! Floquet multipliers converge with h for order 0 and with h² for order 1. Steps end where a tooth enters or leaves,
//! so that no mean covers both cutting and free flight.

use nalgebra::DMatrix;

use super::discretized::{Discretization, Discretized};
use super::stepped::{Mesh, Step, Stepped, moments, pushed};
use crate::problem::pitched::Pitched;

/// Polynomial that approximates the delayed displacement within a time step of semi-discretization.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SdmOrder {
    /// Constant within the step: the displacement at the delayed time of the start of the step.
    Zeroth,
    /// Linear within the step, between the displacements at the delayed times of both ends of the step.
    #[default]
    First,
}

/// Time step of semi-discretization of order 0 or 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SemiDiscretization(pub SdmOrder);

/// Semi-discretization with a given number of steps, applied to a problem.
pub type Sdm = Discretized<SemiDiscretization>;

impl Discretization for SemiDiscretization {
    fn name(&self) -> &'static str {
        match self.0 {
            SdmOrder::Zeroth => "sdm of order 0",
            SdmOrder::First => "sdm",
        }
    }

    fn order(&self) -> u32 {
        match self.0 {
            SdmOrder::Zeroth => 1,
            SdmOrder::First => 2,
        }
    }

    fn map<'a>(&self, pitched: &'a Pitched, mesh: &'a Mesh, depth_m: f64) -> Option<Stepped<'a>> {
        let structure = &pitched.problem.structure;
        let b = DMatrix::from_fn(structure.order(), 3, |i, j| structure.b[(i, j)]);
        let c = DMatrix::from_fn(3, structure.order(), |i, j| structure.c[(i, j)]);
        let steps = (0..mesh.count()).map(|index| {
            let (start_s, duration_s) = mesh.step(index);
            let mean = mesh.mean(pitched, index);
            let a = &structure.a + pushed(&b, &mean.present(depth_m)) * &c;
            let (flow, parts) = moments(&a, &b, duration_s, 2);
            let mut step = Step::new(flow);
            for (delay_s, directional) in &mean.regenerative {
                let force = directional * -depth_m;
                let (whole, rising) = (pushed(&parts[0], &force), pushed(&parts[1], &force));
                match self.0 {
                    SdmOrder::Zeroth => step.add_past(mesh, start_s - delay_s, &whole),
                    SdmOrder::First => {
                        step.add_past(mesh, start_s - delay_s, &(whole - &rising));
                        step.add_past(mesh, start_s + duration_s - delay_s, &rising);
                    }
                }
            }
            step
        });
        let steps = steps.collect();
        Some(Stepped::new(pitched, mesh, depth_m, steps))
    }
}
