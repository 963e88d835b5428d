//! Orders of the channels of a cut under given forces.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::{DMatrix, Matrix3, Vector3};
use num_complex::Complex64;

use crate::baseline::derivatives;
use quietcut_model::structure::FirstOrder;
use quietcut_recording::Quantity;
use quietcut_simulate::effect::Pickup;
use quietcut_stability::cut_orbit::ForceOrders;

/// Channels of a machine, with the receptances between the tool and their sensors at the orders.
#[derive(Clone)]
pub(crate) struct Reading {
    pickups: Vec<Pickup>,
    structure: FirstOrder,
    /// The tool, then the places of sensors away from it.
    places: Vec<Place>,
    /// Place of each channel.
    place_of: Vec<usize>,
    spindle_hz: f64,
    /// Sampling interval over which accelerations are means, s; 0 unless the velocity jumps with the force.
    mean_s: f64,
}

/// A place of the structure whose motion is read.
#[derive(Clone)]
struct Place {
    /// [`Pickup::modes`].
    modes: Vec<f64>,
    /// Receptance between the tool and the place at the orders from 0.
    receptances: Arc<Vec<Matrix3<Complex64>>>,
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
        let mut reading = Self {
            pickups,
            structure: structure.clone(),
            places: Vec::new(),
            place_of: Vec::new(),
            spindle_hz,
            mean_s: if structure.velocity_jumps() {
                1.0 / rate_hz
            } else {
                0.0
            },
        };
        reading.locate(highest)?;
        Some(reading)
    }

    /// Other channels, which may be of another structure, at the same orders of the same record.
    pub(crate) fn with(&self, structure: &FirstOrder, pickups: Vec<Pickup>, rate_hz: f64) -> Option<Self> {
        let highest = self.places[0].receptances.len() - 1;
        if *structure != self.structure {
            return Self::new(structure, pickups, self.spindle_hz, highest, rate_hz);
        }
        let is_read = |place: &&Place| pickups.iter().any(|pickup| pickup.modes == place.modes);
        let mut reading = Self {
            places: self
                .places
                .iter()
                .enumerate()
                .filter(|(number, place)| *number == 0 || is_read(place))
                .map(|(_, place)| place.clone())
                .collect(),
            place_of: Vec::new(),
            structure: structure.clone(),
            pickups,
            spindle_hz: self.spindle_hz,
            mean_s: self.mean_s,
        };
        reading.locate(highest)?;
        Some(reading)
    }

    /// Finds the place of each channel, and computes the receptances of places that are not known.
    fn locate(&mut self, highest: usize) -> Option<()> {
        let at_tool: &[f64] = &[];
        let sought = std::iter::once(at_tool).chain(self.pickups.iter().map(|pickup| &pickup.modes[..]));
        for (number, modes) in sought.enumerate() {
            let known = self.places.iter().position(|place| place.modes == modes);
            let place = match known {
                Some(place) => place,
                None => {
                    let moved = self.structure.at_sensor(modes);
                    let receptances: Option<Vec<_>> = (0..=highest)
                        .map(|order| moved.receptance(TAU * self.spindle_hz * order as f64))
                        .collect();
                    self.places.push(Place {
                        modes: modes.to_vec(),
                        receptances: Arc::new(receptances?),
                    });
                    self.places.len() - 1
                }
            };
            if number > 0 {
                self.place_of.push(place);
            }
        }
        Some(())
    }

    /// True for a channel that another reading of the same orders reads otherwise: its place, axes, gain or dynamics
    /// differ.
    pub(crate) fn differs(&self, other: &Self, channel: usize) -> bool {
        self.pickups[channel] != other.pickups[channel]
    }

    /// Fourier coefficients of each channel, orders × channels, in the unit of the channel.
    pub(crate) fn orders(&self, forces: &ForceOrders) -> DMatrix<Complex64> {
        let highest = self.places[0].receptances.len().min(forces.cutting_n.nrows());
        DMatrix::from_fn(highest, self.pickups.len(), |order, channel| {
            let pickup = &self.pickups[channel];
            let s = Complex64::new(0.0, TAU * self.spindle_hz * order as f64);
            let row = |forces: &DMatrix<Complex64>| Vector3::from_fn(|axis, _| forces[(order, axis)]);
            let value = if pickup.quantity == Quantity::Force {
                row(&forces.cutting_n)
            } else {
                let moved = self.places[self.place_of[channel]].receptances[order] * row(&forces.structure_n);
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
