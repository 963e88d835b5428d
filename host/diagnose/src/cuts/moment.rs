//! The orbit of a machine in a cut at one time of its record, and its derivatives.

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::jumps::ChannelJump;
use super::machine::Machine;
use super::record::ReducedCut;
use super::space::{Space, Variable};
use quietcut_stability::cut_orbit::{CutOrbit, ForceOrders, OrderWeights};

/// Step of a difference of what a variable changes explicitly, in its standard deviations. The relative error is half of it times
/// the curvature, and rounding over it, 1e-8. Derivatives of an effect and of what is uncertain of the baseline in the same
/// parameter must agree beyond what the records resolve, 1e-4 of a deviation, so that their common direction is paid for by the
/// prior alone.
const DIFFERENCE: f64 = 1e-6;

/// A machine in a cut at one time.
pub(super) struct Moment {
    machine: Machine,
    pub(super) orbit: CutOrbit,
    weights: OrderWeights,
    forces: ForceOrders,
    /// Where teeth enter or leave at the angles of the engagement: time, s, and jump of the cutting force, N.
    jumps: Vec<(f64, [f64; 3])>,
    /// Fourier coefficients of the channels.
    pub(super) coefficients: DMatrix<Complex64>,
    /// Amplitudes of the channels as the record would show them.
    pub(super) seen: DMatrix<Complex64>,
    /// Their derivative by the phase of the tachometer, 1/rad.
    pub(super) by_phase: DMatrix<Complex64>,
}

impl Moment {
    /// The machine of `space` at `z` in the cut `number`; `None` if it has no orbit, or none that is near.
    pub(super) fn new(
        space: &Space<'_>,
        z: &[f64],
        number: usize,
        record: &ReducedCut,
        time_s: f64,
        near: Option<&Self>,
    ) -> Option<Self> {
        let known = near.map(|near| &near.machine.reading);
        let mut machine = space.machine(z, number, record, time_s, known)?;
        // Where Newton's method does not follow from a known orbit, it may do so from rest.
        let orbit = match near {
            Some(near) => {
                CutOrbit::near(&machine.model, &near.orbit).or_else(|_| CutOrbit::new(&machine.model))
            }
            None => CutOrbit::along_depth(&mut machine.model),
        }
        .inspect_err(|error| tracing::trace!(%error, "no orbit"))
        .ok()?;
        let weights = orbit.order_weights(record.highest);
        let forces = orbit.force_orders(&weights);
        let mut coefficients = machine.reading.orders(&forces);
        let phase_rad = phase(space, z, number, record);
        turn(&mut coefficients, phase_rad);
        let jumps = orbit.jumps_of_engagement(&machine.model);
        let [seen, by_phase] = seen(&machine, &jumps, &coefficients, record, phase_rad, &|_| true);
        Some(Self {
            jumps,
            seen,
            by_phase,
            machine,
            orbit,
            weights,
            forces,
            coefficients,
        })
    }

    /// Derivative of the amplitudes of the channels, as the record shows them, by the variable `index`, for a space whose
    /// machine at `z` has this orbit. Of a variable that moves the orbit, the part of the jumps beyond half the sample
    /// rate, which changes little, is taken as that of the other orders.
    pub(super) fn slope(
        &self,
        space: &Space<'_>,
        z: &[f64],
        index: usize,
        number: usize,
        record: &ReducedCut,
        time_s: f64,
    ) -> Option<DMatrix<Complex64>> {
        let mut moved = z.to_vec();
        moved[index] += DIFFERENCE;
        let known = Some(&self.machine.reading);
        let plus = space.machine(&moved, number, record, time_s, known)?;
        let phase_rad = phase(space, z, number, record);
        // The moment may be that of a space without the effect of the variable, which is not absent at `z`.
        let own = match space.variables[index] {
            Variable::Coordinate(..) => Some(space.machine(z, number, record, time_s, known)?),
            _ => None,
        };
        let own = own.as_ref().unwrap_or(&self.machine);
        let step = Complex64::from(DIFFERENCE);
        if space.is_of_reading(index) {
            let is_read = |channel| plus.reading.differs(&own.reading, channel);
            let read = |machine: &Machine| {
                let mut coefficients = machine.reading.orders(&self.forces);
                turn(&mut coefficients, phase_rad);
                let [seen, _] = seen(machine, &self.jumps, &coefficients, record, phase_rad, &is_read);
                seen
            };
            return Some((read(&plus) - read(own)) / step);
        }
        let mut slope = (plus.reading.orders(&self.forces) - own.reading.orders(&self.forces)) / step;
        let sensitivity = self.orbit.derivative(&plus.model, &own.model, DIFFERENCE)?;
        let forces = self.orbit.force_order_slopes(&self.weights, &sensitivity);
        slope += self.machine.reading.orders(&forces);
        turn(&mut slope, phase_rad);
        Some(record.orders.of_channels(&slope))
    }
}

/// Amplitudes of the channels that are `read`, as a record shows them, and their derivative by the phase of its
/// tachometer; zero for the others.
fn seen(
    machine: &Machine,
    jumps: &[(f64, [f64; 3])],
    coefficients: &DMatrix<Complex64>,
    record: &ReducedCut,
    phase_rad: f64,
    is_read: &dyn Fn(usize) -> bool,
) -> [DMatrix<Complex64>; 2] {
    let jumps: Vec<(f64, Vec<f64>)> = jumps
        .iter()
        .map(|(time_s, force_n)| {
            let sizes = machine.reading.jump(&machine.model.structure, *force_n);
            (machine.model.rad_per_s * time_s, sizes)
        })
        .collect();
    let (rows, columns) = record.orders.amplitudes.shape();
    let mut found = [DMatrix::zeros(rows, columns), DMatrix::zeros(rows, columns)];
    for channel in (0..columns).filter(|channel| is_read(*channel)) {
        let of_channel: Vec<ChannelJump> = jumps
            .iter()
            .map(|(angle_rad, sizes)| ChannelJump {
                angle_rad: *angle_rad,
                early_rad: phase_rad - machine.model.rad_per_s * machine.reading.delay_s(channel),
                size: sizes[channel],
            })
            .filter(|jump| jump.size != 0.0)
            .collect();
        let coefficients: Vec<Complex64> = coefficients.column(channel).iter().copied().collect();
        let seen = record.jumps.seen(&record.orders, &coefficients, &of_channel);
        for (found, seen) in found.iter_mut().zip(seen) {
            found.column_mut(channel).copy_from_slice(&seen);
        }
    }
    found
}

/// Standard deviation of the phase of the tachometer of a record, rad.
pub(super) fn phase_deviation(record: &ReducedCut) -> f64 {
    record.orders.angle.phase_deviation_rad
}

/// Phase of the tachometer of a record at a point of the space, rad.
fn phase(space: &Space<'_>, z: &[f64], number: usize, record: &ReducedCut) -> f64 {
    let of = |(variable, z): (&Variable, &f64)| match variable {
        Variable::Phase(own) if *own == number => z * phase_deviation(record),
        _ => 0.0,
    };
    space.variables.iter().zip(z).map(of).sum()
}

/// The same signals at a spindle angle that is larger by `angle_rad`.
fn turn(coefficients: &mut DMatrix<Complex64>, angle_rad: f64) {
    if angle_rad != 0.0 {
        for (order, mut row) in coefficients.row_iter_mut().enumerate() {
            row *= Complex64::cis(order as f64 * angle_rad);
        }
    }
}
