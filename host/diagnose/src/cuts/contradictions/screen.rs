//! Ranks other inputs by the orders of the force of the feed, which are linear in what is free.
//!
//! The measured orders M of a record are compared with Σ_b c_b P_b of [`FeedForces`] through the receptances of the
//! baseline, and
//!
//! ```text
//! cost = min over c of Σ 2 |M − Σ_b c_b P_b|²/σ² + Σ_b (c_b − μ_b)²/s_b²,
//! ```
//!
//! with cutting and edge coefficients and runout c, their values μ in the case and wide deviations s. Errors of the
//! structure are part of σ, so that this ranks only; what ranks far before the given input is then fitted.

use std::f64::consts::TAU;

use nalgebra::{Cholesky, DMatrix, SMatrix, SVector, Vector3};
use num_complex::Complex64;
use quietcut_model::Cutter;
use quietcut_model::milling::Material;
use quietcut_model::structure::FirstOrder;
use quietcut_numerics::statistics::chi_squared_quantile;
use quietcut_recording::Quantity;
use quietcut_simulate::effect::Pickup;
use quietcut_stability::cut_orbit::ForceOrders;

use super::alternative::{Alternative, of_channels};
use super::feed_forces::{COLUMNS, Engagement, FeedForces};
use crate::baseline::Baseline;
use crate::cuts::conditions::cut_model;
use crate::cuts::reading::Reading;
use crate::cuts::record::ReducedCut;

/// Highest order that is compared: five harmonics of the passing of eight teeth.
const HIGHEST: usize = 40;
/// Largest number of teeth that is tried.
const TEETH: usize = 8;
/// Allowance of an order for what the force of the feed leaves out, over the order, and over the largest order of its
/// channel.
const ALLOWANCE: [f64; 2] = [0.03, 0.02];
/// The same for the structure, where it is not fitted.
const STRUCTURE: f64 = 0.1;
/// Variance of the noise of an order, over its square, from which on it is compared with noise only.
const SEEN: f64 = 0.1;
/// Standard deviation of a cutting coefficient over its value in the case, of an edge coefficient over the cutting force
/// of 0.3 feeds, of the runout over 10 µm.
const SPREAD: [f64; 3] = [0.5, 1.0, 1.0];
/// An edge coefficient over the cutting coefficient times the feed, and a cutting coefficient that the case lacks over the
/// tangential one.
const SHARE: f64 = 0.3;
/// Least tangential cutting coefficient over that of the case.
pub(super) const LEAST_CUTTING: f64 = 0.2;
/// Share of the predicted orders that a record would show if the tool cut, however wrong the case is, and factor on the
/// χ² of noise from which on it would be seen.
const LEAST_OF_CUT: f64 = 0.1;
const PLAIN: f64 = 10.0;
/// Probability with which noise stays below the χ² of air.
const AIR: f64 = 0.999;
/// Steps of the entry and the exit that are tried, degrees; the first over the half circle, the others about the best.
const STEPS_DEG: [f64; 4] = [10.0, 5.0, 2.0, 1.0];
/// Share of the cost of the given input above which another input is not fitted.
const FAR: f64 = 0.5;
/// Number of inputs of a record that are fitted.
const FITTED: usize = 3;

/// Damping ratio of the damper of one unit at the tool.
const DAMPING_RATIO: f64 = 0.05;

/// The orders of one record beside those of the feed.
pub(super) struct Screen<'a> {
    pub record: &'a ReducedCut,
    pub forces: FeedForces,
    given: Engagement,
    pub structure: FirstOrder,
    /// Axes along which the structure moves.
    pub axes: Vec<usize>,
    /// By axis: spring, N/m, damper, N s/m, and mass, kg, of the baseline at the tool.
    pub at_tool: [[f64; 3]; 3],
    /// By order: channels × axes.
    transfer: Vec<DMatrix<Complex64>>,
    pub mean: SVector<f64, COLUMNS>,
    pub deviation: SVector<f64, COLUMNS>,
    pub orders: usize,
    pub pickups: Vec<Pickup>,
    pub channels: Vec<(String, Quantity)>,
    /// By channel of the record: the largest order.
    largest: Vec<f64>,
    /// Orders in a sampling interval: order k folds onto k minus this number.
    folding: f64,
}

impl<'a> Screen<'a> {
    /// `None` if the baseline cannot be simulated in the cut, or a sensor does not sit at the tool.
    pub(super) fn new(baseline: &Baseline<'_>, record: &'a ReducedCut) -> Option<Self> {
        let model = cut_model(baseline.case, &baseline.effects, &record.conditions).ok()?;
        let cutter = &model.cutter;
        let orders = record.orders.amplitudes.nrows().min(HIGHEST + 1);
        let names = &record.orders.channels;
        let pickups: Vec<Pickup> = names
            .iter()
            .map(|name| baseline.pickup(name))
            .collect::<Option<_>>()?;
        if pickups.iter().any(|pickup| !pickup.modes.is_empty()) {
            return None;
        }
        let spindle_hz = record.conditions.spindle_hz;
        let reading = Reading::new(
            &model.structure,
            pickups.clone(),
            spindle_hz,
            orders - 1,
            record.rate_hz,
        )?;
        let (mean, deviation, unit) = coefficients(baseline, cutter)?;
        let columns = record.orders.amplitudes.column_iter();
        let largest = columns
            .map(|column| column.iter().skip(1).map(|y| y.norm()).fold(0.0, f64::max))
            .collect();
        Some(Self {
            record,
            forces: FeedForces::new(cutter, &unit, orders),
            given: Engagement::of(cutter),
            axes: baseline.axes.clone(),
            at_tool: at_tool(baseline, &model.structure)?,
            structure: model.structure,
            transfer: transfer(&reading, orders, names.len()),
            mean,
            deviation,
            orders,
            channels: pickups
                .iter()
                .map(|pickup| (pickup.name.clone(), pickup.quantity))
                .collect(),
            pickups,
            largest,
            folding: record.rate_hz / spindle_hz,
        })
    }

    /// Standard deviation of an order of a channel of the record, times `factor`, with the allowance for what is left out
    /// and for orders beyond half the sample rate, which fall as 1/k where the force jumps and fold.
    pub(super) fn deviation_of(&self, order: usize, source: usize, factor: f64) -> f64 {
        let amplitude = self.record.orders.amplitudes[(order, source)].norm();
        let noise = self.record.orders.covariances[order].matrix[(source, source)].re;
        let folded = order as f64 / (self.folding - order as f64).max(1.0);
        let [own, all] = ALLOWANCE;
        let variance = noise + (own.hypot(folded) * amplitude).powi(2) + (all * self.largest[source]).powi(2);
        factor.abs() * variance.max(f64::MIN_POSITIVE).sqrt()
    }

    /// Source of each channel in the record, and its factor.
    pub(super) fn sources(&self, alternative: Option<&Alternative>) -> Vec<(usize, f64)> {
        let names = &self.record.orders.channels;
        let of = |(own, (name, _)): (usize, &(String, Quantity))| {
            let (read, factor) = alternative.map_or((name.as_str(), 1.0), |changed| changed.reads(name));
            (
                names.iter().position(|other| other == read).unwrap_or(own),
                factor,
            )
        };
        self.channels.iter().enumerate().map(of).collect()
    }

    /// The engagement of an input.
    pub(super) fn engagement_of(&self, alternative: Option<&Alternative>) -> Engagement {
        match (alternative, alternative.and_then(Alternative::engagement_deg)) {
            (Some(Alternative::Teeth(teeth)), _) => self.given.with_teeth(*teeth),
            (_, Some(degrees)) => self.given.between(degrees.map(f64::to_radians)),
            _ => self.given.clone(),
        }
    }

    /// Number of values that rise above the noise.
    pub(super) fn seen(&self) -> f64 {
        let orders = &self.record.orders;
        let is_seen = |order: usize, channel: usize| {
            let noise = orders.covariances[order].matrix[(channel, channel)].re;
            noise < SEEN * orders.amplitudes[(order, channel)].norm_sqr()
        };
        let channels = self.channels.len();
        let seen = (1..self.orders).flat_map(|order| (0..channels).map(move |channel| (order, channel)));
        2.0 * seen.filter(|(order, channel)| is_seen(*order, *channel)).count() as f64
    }

    /// Number of real values that are compared.
    pub(super) fn count(&self) -> usize {
        2 * (self.orders - 1) * self.channels.len()
    }

    /// True if the orders of a channel are far above its noise.
    fn is_plain(&self, channel: usize) -> bool {
        let orders = &self.record.orders;
        let of = |order: usize| {
            let noise = orders.covariances[order].matrix[(channel, channel)]
                .re
                .max(f64::MIN_POSITIVE);
            2.0 * orders.amplitudes[(order, channel)].norm_sqr() / noise
        };
        let count = 2.0 * (self.orders - 1) as f64;
        (1..self.orders).map(of).sum::<f64>() > PLAIN * chi_squared_quantile(AIR, count)
    }

    /// True if no order above 1, which an unbalanced spindle has in air too, rises above the noise although a tenth of
    /// those of the case would.
    pub(super) fn is_air(&self) -> bool {
        let orders = &self.record.orders;
        let [mut measured, mut expected, mut count] = [0.0; 3];
        for order in 2..self.orders {
            let columns = self.forces.at(&self.given, order);
            let parts = columns.iter().zip(self.mean.iter());
            let force: Vector3<Complex64> = parts.map(|(column, mean)| column * Complex64::from(*mean)).sum();
            let read = &self.transfer[order] * force;
            for channel in 0..self.channels.len() {
                let noise = orders.covariances[order].matrix[(channel, channel)]
                    .re
                    .max(f64::MIN_POSITIVE);
                measured += 2.0 * orders.amplitudes[(order, channel)].norm_sqr() / noise;
                expected += 2.0 * LEAST_OF_CUT * LEAST_OF_CUT * read[channel].norm_sqr() / noise;
                count += 2.0;
            }
        }
        let noise = chi_squared_quantile(AIR, count.max(1.0));
        measured < noise && expected > PLAIN * noise
    }

    /// Inputs of the record that are worth a fit, the best first.
    pub(super) fn suspects(&self) -> Vec<Alternative> {
        let given = self.cost(&self.given, None);
        if given < self.seen() {
            return Vec::new();
        }
        // A channel at rest, as of an axis that sticks, fits any unit.
        let changes = |alternative: &Alternative, name: &str| alternative.reads(name) != (name, 1.0);
        let mut all = of_channels(&self.channels);
        all.retain(|alternative| {
            let mut channels = self.channels.iter().enumerate();
            channels.all(|(channel, (name, _))| !changes(alternative, name) || self.is_plain(channel))
        });
        all.extend(self.of_tool());
        let mut ranked: Vec<(f64, Alternative)> = all
            .into_iter()
            .map(|alternative| (self.cost_of(&alternative), alternative))
            .collect();
        ranked.extend(self.engagement());
        ranked.retain(|(cost, _)| *cost < FAR * given);
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        ranked.truncate(FITTED);
        ranked.into_iter().map(|(_, alternative)| alternative).collect()
    }

    /// Other teeth, directions of rotation, and the mirrored engagement.
    fn of_tool(&self) -> Vec<Alternative> {
        let teeth = self.given.teeth.len();
        let others = (1..=TEETH).filter(|other| *other != teeth);
        let mut all: Vec<Alternative> = others.map(Alternative::Teeth).collect();
        let [start, exit] = [self.given.start_rad, self.given.exit_rad].map(f64::to_degrees);
        let mirrored = [180.0 - exit, 180.0 - start];
        let differs =
            (start + exit - 180.0).abs() > STEPS_DEG[3] && mirrored.iter().all(|degrees| *degrees >= 0.0);
        if differs {
            all.push(Alternative::Mirrored(mirrored));
        }
        let names = self.channels.iter().map(|(name, _)| name.clone());
        let normals: Vec<String> = names.filter(|name| name.ends_with('y')).collect();
        // With a feed along x the other direction of rotation mirrors y.
        let is_along_x = self.record.conditions.cut.feed_direction_deg.rem_euclid(180.0) == 0.0;
        if is_along_x && !normals.is_empty() {
            all.push(Alternative::Rotation(None, normals.clone()));
            all.extend(differs.then_some(Alternative::Rotation(Some(mirrored), normals)));
        }
        all
    }

    fn cost_of(&self, alternative: &Alternative) -> f64 {
        self.cost(&self.engagement_of(Some(alternative)), Some(alternative))
    }

    /// The engagement of least cost within the half circle.
    fn engagement(&self) -> Option<(f64, Alternative)> {
        let cost = |degrees: [f64; 2]| self.cost(&self.given.between(degrees.map(f64::to_radians)), None);
        let count = (180.0 / STEPS_DEG[0]) as usize;
        let grid = (0..count).flat_map(|start| (start + 1..=count).map(move |exit| [start, exit]));
        let degrees = grid.map(|pair| pair.map(|index| STEPS_DEG[0] * index as f64));
        let mut best = degrees
            .map(|degrees| (cost(degrees), degrees))
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        for step in &STEPS_DEG[1..] {
            let [start, exit] = best.1;
            for near in [
                [-step, 0.0],
                [*step, 0.0],
                [0.0, -step],
                [0.0, *step],
                [-step, -step],
                [*step, *step],
            ] {
                let moved = [start + near[0], exit + near[1]];
                if moved[0] < 0.0 || moved[1] > 180.0 || moved[1] - moved[0] < STEPS_DEG[3] {
                    continue;
                }
                let here = cost(moved);
                if here < best.0 {
                    best = (here, moved);
                }
            }
        }
        Some((best.0, Alternative::Engagement(best.1)))
    }

    /// The cost of an engagement with the channels of an alternative.
    fn cost(&self, engagement: &Engagement, channels: Option<&Alternative>) -> f64 {
        let orders = &self.record.orders;
        let sources = self.sources(channels);
        let mut normal = SMatrix::<f64, COLUMNS, COLUMNS>::zeros();
        let mut right = SVector::<f64, COLUMNS>::zeros();
        let mut energy = 0.0;
        for order in 1..self.orders {
            let forces = self.forces.at(engagement, order);
            for (channel, (source, factor)) in sources.iter().enumerate() {
                let measured = orders.amplitudes[(order, *source)] * *factor;
                let deviation = self
                    .deviation_of(order, *source, *factor)
                    .hypot(STRUCTURE * measured.norm());
                let row = self.transfer[order].row(channel);
                let read: [Complex64; COLUMNS] = std::array::from_fn(|column| {
                    let force = &forces[column];
                    row[0] * force[0] + row[1] * force[1] + row[2] * force[2]
                });
                let weight = 2.0 / (deviation * deviation);
                energy += weight * measured.norm_sqr();
                for (i, one) in read.iter().enumerate() {
                    right[i] += weight * (one.conj() * measured).re;
                    for (j, other) in read.iter().enumerate().take(i + 1) {
                        let product = weight * (one.conj() * other).re;
                        normal[(i, j)] += product;
                        if i != j {
                            normal[(j, i)] += product;
                        }
                    }
                }
            }
        }
        self.least(energy, normal, right)
    }

    /// Least of energy − 2 rᵀc + cᵀNc + Σ (c − μ)²/s²; infinite if the teeth would not cut.
    fn least(
        &self,
        energy: f64,
        mut normal: SMatrix<f64, COLUMNS, COLUMNS>,
        right: SVector<f64, COLUMNS>,
    ) -> f64 {
        // From the mean on: c = μ + d.
        let moved = right - normal * self.mean;
        let start = energy - 2.0 * right.dot(&self.mean) + self.mean.dot(&(normal * self.mean));
        for (index, deviation) in self.deviation.iter().enumerate() {
            normal[(index, index)] += deviation.powi(-2);
        }
        let Some(change) = Cholesky::new(normal).map(|factor| factor.solve(&moved)) else {
            return f64::INFINITY;
        };
        if self.mean[0] + change[0] < LEAST_CUTTING {
            return f64::INFINITY;
        }
        start - moved.dot(&change)
    }
}

/// By order: what each channel reads of a unit force along each axis.
fn transfer(reading: &Reading, orders: usize, channels: usize) -> Vec<DMatrix<Complex64>> {
    let along = |axis: usize| {
        let is_own = |own: usize| f64::from(u8::from(own == axis));
        let unit = DMatrix::from_fn(orders, 3, |_, own| Complex64::from(is_own(own)));
        reading.orders(&ForceOrders {
            cutting_n: unit.clone(),
            structure_n: unit,
        })
    };
    let by_axis = [along(0), along(1), along(2)];
    let of = |order: usize| DMatrix::from_fn(channels, 3, |channel, axis| by_axis[axis][(order, channel)]);
    (0..orders).map(of).collect()
}

/// By axis: the static stiffness at the tool, and the damper and the mass with which it would have the lowest natural
/// frequency and the damping ratio [`DAMPING_RATIO`].
fn at_tool(baseline: &Baseline<'_>, structure: &FirstOrder) -> Option<[[f64; 3]; 3]> {
    let omega = TAU * baseline.lowest_hz()?;
    let soft = structure.receptance(0.0)?;
    Some(std::array::from_fn(|axis| {
        let spring = soft[(axis, axis)].re.abs().recip();
        let damper = 2.0 * DAMPING_RATIO * spring / omega;
        [spring, damper, spring / (omega * omega)]
    }))
}

/// Mean and deviation of coefficients and runout in the case, and the size of each coefficient that counts as one.
fn coefficients(
    baseline: &Baseline<'_>,
    cutter: &Cutter,
) -> Option<(SVector<f64, COLUMNS>, SVector<f64, COLUMNS>, Material)> {
    let material = cutter.force.material();
    let unit = unit_of(&material, 1e3 * cutter.feed_per_tooth_m);
    let runout = baseline.case.tool().ok()?.runout;
    let [cosine, sine] = runout.map_or([0.0; 2], |runout| {
        let (sine, cosine) = runout.angle_deg.to_radians().sin_cos();
        [0.1 * runout.offset_um * cosine, -0.1 * runout.offset_um * sine]
    });
    let [cutting, edge, offset] = SPREAD;
    let mean = SVector::from([
        material.ktc_mpa / unit.ktc_mpa,
        material.krc_mpa / unit.krc_mpa,
        material.kac_mpa / unit.kac_mpa,
        material.kte_n_per_mm / unit.kte_n_per_mm,
        material.kre_n_per_mm / unit.kre_n_per_mm,
        material.kae_n_per_mm / unit.kae_n_per_mm,
        cosine,
        sine,
    ]);
    let deviation = SVector::from([cutting, cutting, cutting, edge, edge, edge, offset, offset]);
    Some((mean, deviation, unit))
}

/// Size of each coefficient that counts as one.
fn unit_of(material: &Material, feed_mm: f64) -> Material {
    let cutting = |mpa: f64| mpa.abs().max(SHARE * material.ktc_mpa);
    let edge_n_per_mm = SHARE * material.ktc_mpa * feed_mm;
    Material {
        ktc_mpa: material.ktc_mpa,
        krc_mpa: cutting(material.krc_mpa),
        kac_mpa: cutting(material.kac_mpa),
        kte_n_per_mm: edge_n_per_mm,
        kre_n_per_mm: edge_n_per_mm,
        kae_n_per_mm: edge_n_per_mm,
    }
}
