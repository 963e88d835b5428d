//! Orders of the channels of a cut under given forces.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, Matrix3, Vector3};
use num_complex::Complex64;

use crate::baseline::derivatives;
use quietcut_model::structure::FirstOrder;
use quietcut_recording::Quantity;
use quietcut_simulate::effect::Pickup;
use quietcut_stability::cut_orbit::ForceOrders;

/// Channels of a machine, with the receptances between the tool and their sensors at the orders.
pub(crate) struct Reading {
    pickups: Vec<Pickup>,
    /// Receptance at the orders, by sensor place; the first is the tool.
    places: Vec<Vec<Matrix3<Complex64>>>,
    /// Place of each channel.
    place_of: Vec<usize>,
    spindle_hz: f64,
    /// Sampling interval over which accelerations are means, s; 0 unless the velocity jumps with the force.
    mean_s: f64,
}

impl Reading {
    /// Channels of `structure` at the orders 0 to `highest`; `None` if it has an undamped mode at one of them.
    pub(crate) fn new(
        structure: &FirstOrder,
        pickups: Vec<Pickup>,
        spindle_hz: f64,
        highest: usize,
        rate_hz: f64,
    ) -> Option<Self> {
        let receptances = |structure: &FirstOrder| -> Option<Vec<Matrix3<Complex64>>> {
            (0..=highest)
                .map(|order| structure.receptance(TAU * spindle_hz * order as f64))
                .collect()
        };
        let mut places = vec![receptances(structure)?];
        let mut known: Vec<Vec<f64>> = vec![Vec::new()];
        let mut place_of = Vec::with_capacity(pickups.len());
        for pickup in &pickups {
            let place = match known.iter().position(|modes| *modes == pickup.modes) {
                Some(place) => place,
                None => {
                    places.push(receptances(&structure.at_sensor(&pickup.modes))?);
                    known.push(pickup.modes.clone());
                    known.len() - 1
                }
            };
            place_of.push(place);
        }
        Some(Self {
            pickups,
            places,
            place_of,
            spindle_hz,
            mean_s: if structure.velocity_jumps() {
                1.0 / rate_hz
            } else {
                0.0
            },
        })
    }

    /// Fourier coefficients of each channel, orders × channels, in the unit of the channel.
    pub(crate) fn orders(&self, forces: &ForceOrders) -> DMatrix<Complex64> {
        let highest = self.places[0].len().min(forces.cutting_n.nrows());
        DMatrix::from_fn(highest, self.pickups.len(), |order, channel| {
            let pickup = &self.pickups[channel];
            let s = Complex64::new(0.0, TAU * self.spindle_hz * order as f64);
            let row = |forces: &DMatrix<Complex64>| Vector3::from_fn(|axis, _| forces[(order, axis)]);
            let value = if pickup.quantity == Quantity::Force {
                row(&forces.cutting_n)
            } else {
                let moved = self.places[self.place_of[channel]][order] * row(&forces.structure_n);
                moved * s.powi(derivatives(pickup.quantity))
            };
            let read: Complex64 = pickup
                .weights
                .iter()
                .zip(value.iter())
                .map(|(weight, value)| value * *weight)
                .sum();
            read * pickup.dynamics(s) * (-s * pickup.delay_s).exp() * self.mean(pickup.quantity, s)
        })
    }

    /// Delay of a channel, s.
    pub(crate) fn delay_s(&self, channel: usize) -> f64 {
        self.pickups[channel].delay_s
    }

    /// By channel: its jump where the cutting force jumps by `force_n` along x, y, z.
    pub(crate) fn jump(&self, structure: &FirstOrder, force_n: [f64; 3]) -> Vec<f64> {
        // Accelerations jump with the force, unless velocities do.
        let jumped = if self.mean_s == 0.0 {
            &structure.c * (&structure.a * (&structure.b * Vector3::from(force_n)))
        } else {
            Vector3::zeros()
        };
        self.pickups
            .iter()
            .map(|pickup| match pickup.quantity {
                Quantity::Force => pickup.read(force_n),
                Quantity::Acceleration => pickup.read(jumped.into()),
                _ => 0.0,
            })
            .collect()
    }

    fn mean(&self, quantity: Quantity, s: Complex64) -> Complex64 {
        let turn = s * self.mean_s;
        if quantity != Quantity::Acceleration || turn.norm() == 0.0 {
            return Complex64::ONE;
        }
        // Mean of e^{st} over the interval about the sample.
        ((0.5 * turn).exp() - (-0.5 * turn).exp()) / turn
    }
}
